#include "exposure_kernel.hpp"

#include "racecraft/math.hpp"

namespace racecraft::RC_ISA {
namespace {

constexpr float kVariance = 2.0f / 3.0f;  // px^2, most that one pass of (a, 1 - 2a, a) blurs

// Light at a column or row, 1 is 1 << 14.
uint16_t light_at(int index, int count, float gradient) {
    const float across = 2.0f * (static_cast<float>(index) + 0.5f) / static_cast<float>(count) - 1.0f;
    return static_cast<uint16_t>(16384.0f * (1.0f + gradient * across) + 0.5f);
}

// Halves of 16 x 16 bits throughout: twice as many lanes as with whole words.
void shade(uint8_t* frame, int width, int height, float gradient_across, float gradient_down) {
    alignas(64) uint16_t light[kMaxExposedWidth];
    for (int x = 0; x < width; ++x) light[x] = light_at(x, width, gradient_across);
    for (int y = 0; y < height; ++y) {
        const uint16_t row_light = light_at(y, height, gradient_down);
        uint8_t* line = frame + static_cast<size_t>(y) * static_cast<size_t>(width);
#pragma GCC ivdep
        for (int x = 0; x < width; ++x) {
            const uint16_t factor =
                static_cast<uint16_t>((uint32_t{light[x]} * row_light) >> 16);  // 1 is 1 << 12
            const uint16_t bright = static_cast<uint16_t>(line[x] << 8);
            const uint16_t lit = static_cast<uint16_t>((uint32_t{bright} * factor) >> 16);  // 1 is 1 << 4
            const uint16_t level = static_cast<uint16_t>((lit + 8) >> 4);
            line[x] = static_cast<uint8_t>(level < 255 ? level : 255);
        }
    }
}

// (side, 256 - 2 side, side) / 256 across, then down; borders repeat.
void blur_once(uint8_t* frame, int width, int height, uint16_t side) {
    const uint16_t middle = static_cast<uint16_t>(256 - 2 * side);
    alignas(64) uint8_t padded[kMaxExposedWidth + 2];
    alignas(64) uint8_t lines[3][kMaxExposedWidth];  // blurred across: the line above, this one, the next
    const auto blur_across = [&](int y, uint8_t* out) {
        const uint8_t* line = frame + static_cast<size_t>(y) * static_cast<size_t>(width);
        padded[0] = line[0];
        for (int x = 0; x < width; ++x) padded[x + 1] = line[x];
        padded[width + 1] = line[width - 1];
#pragma GCC ivdep
        for (int x = 0; x < width; ++x) {
            const uint16_t sum =
                static_cast<uint16_t>((padded[x] + padded[x + 2]) * side + padded[x + 1] * middle + 128);
            out[x] = static_cast<uint8_t>(sum >> 8);
        }
    };
    blur_across(0, lines[0]);
    for (int x = 0; x < width; ++x) lines[2][x] = lines[0][x];
    for (int y = 0; y < height; ++y) {
        const uint8_t* above = lines[(y + 2) % 3];
        const uint8_t* here = lines[y % 3];
        uint8_t* below = lines[(y + 1) % 3];
        if (y + 1 < height) {
            blur_across(y + 1, below);
        } else {
            for (int x = 0; x < width; ++x) below[x] = here[x];
        }
        uint8_t* line = frame + static_cast<size_t>(y) * static_cast<size_t>(width);
#pragma GCC ivdep
        for (int x = 0; x < width; ++x) {
            const uint16_t sum = static_cast<uint16_t>((above[x] + below[x]) * side + here[x] * middle + 128);
            line[x] = static_cast<uint8_t>(sum >> 8);
        }
    }
}

}  // namespace

void expose(uint8_t* frame, int width, int height, float gradient_across, float gradient_down, float blur) {
    if (gradient_across != 0.0f || gradient_down != 0.0f) {
        shade(frame, width, height, gradient_across, gradient_down);
    }
    const float variance = blur * blur;
    const int passes = static_cast<int>(variance / kVariance) + 1;
    const uint16_t side = static_cast<uint16_t>(128.0f * variance / static_cast<float>(passes) + 0.5f);
    for (int pass = 0; side > 0 && pass < passes; ++pass) blur_once(frame, width, height, side);
}

}  // namespace racecraft::RC_ISA
