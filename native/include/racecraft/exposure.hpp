// What lens and sensor do to a pixel: uneven light, then blur. Halves of 16 bits throughout, so that vectors
// hold twice as many as with whole words.
#pragma once

#include "racecraft/math.hpp"

namespace racecraft {

constexpr float kVariance = 2.0f / 3.0f;  // px^2, most that one pass of (a, 1 - 2a, a) blurs

// Light at a column or row, 1 is 1 << 14.
RC_HD uint16_t light_at(int index, int count, float gradient) {
    const float across = 2.0f * (static_cast<float>(index) + 0.5f) / static_cast<float>(count) - 1.0f;
    return static_cast<uint16_t>(16384.0f * (1.0f + gradient * across) + 0.5f);
}

// A pixel in the light of its column and row.
RC_HD uint8_t lit_pixel(uint8_t pixel, uint16_t column_light, uint16_t row_light) {
    const uint16_t factor =
        static_cast<uint16_t>((uint32_t{column_light} * row_light) >> 16);  // 1 is 1 << 12
    const uint16_t bright = static_cast<uint16_t>(pixel << 8);
    const uint16_t lit = static_cast<uint16_t>((uint32_t{bright} * factor) >> 16);  // 1 is 1 << 4
    const uint16_t level = static_cast<uint16_t>((lit + 8) >> 4);
    return static_cast<uint8_t>(level < 255 ? level : 255);
}

// A blur of `blur` pixels standard deviation is so many passes of (side, 256 - 2 side, side) / 256.
struct BlurFilter {
    int32_t passes;
    uint16_t side;
};

RC_HD BlurFilter blur_filter(float blur) {
    const float variance = blur * blur;
    const int32_t passes = static_cast<int32_t>(variance / kVariance) + 1;
    const uint16_t side = static_cast<uint16_t>(128.0f * variance / static_cast<float>(passes) + 0.5f);
    return {side > 0 ? passes : 0, side};
}

RC_HD uint8_t blurred_pixel(uint8_t before, uint8_t here, uint8_t after, uint16_t side) {
    const uint16_t middle = static_cast<uint16_t>(256 - 2 * side);
    const uint16_t sum = static_cast<uint16_t>((before + after) * side + here * middle + 128);
    return static_cast<uint8_t>(sum >> 8);
}

}  // namespace racecraft
