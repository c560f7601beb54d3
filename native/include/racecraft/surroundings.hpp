// What is in the hall besides the track: panels and prints on the walls, people and lamps above them.
//
// Seen from the track they are patches of brightness that hold their direction as the car turns. Directions
// are 65536ths of a turn, the lens's to the left, so that all from a picture's first column on is integers.
#pragma once

#include "racecraft/camera.hpp"

namespace racecraft {

constexpr int32_t kCrowdRows = 8;   // rows that show the same of the hall above the walls
constexpr int32_t kPrintRows = 16;  // and on them

// Where a picture's columns look.
struct Bearing {
    uint32_t first, step;
};

RC_HD Bearing bearing_of(const CameraSpec& spec, const LensPose& lens) {
    constexpr float unit = 65536.0f / (2.0f * kPi);
    const float heading = atan2_of(lens.sine, lens.cosine);
    const uint32_t step = static_cast<uint32_t>(spec.hfov / static_cast<float>(spec.width) * unit + 0.5f);
    const int32_t middle = static_cast<int32_t>(heading * unit);
    return {static_cast<uint32_t>(middle) + step * static_cast<uint32_t>(spec.width / 2), step};
}

// How far a patch is off its mean, -128 to 127.
RC_HD int32_t patch(uint32_t place, uint32_t row, uint32_t hall) {
    uint32_t word = place * 0x9E3779B1u ^ row * 0x85EBCA77u ^ hall * 0xC2B2AE3Du;
    word ^= word >> 15;
    word *= 0x2C1B3C6Du;
    word ^= word >> 13;
    return static_cast<int32_t>(word >> 24) - 128;
}

// Brightness times 64 of column x, row `row`, where the hall's mean is `mean` times 64. Above the walls
// patches are as wide as people; on them they are wider and paler.
RC_HD int32_t above_walls(const GreyPalette& palette, Bearing bearing, int32_t row, int32_t x, int32_t mean) {
    const uint32_t at = (bearing.first - static_cast<uint32_t>(x) * bearing.step) & 0xffffu;
    const int32_t off = patch(at >> 8, static_cast<uint32_t>(row / kCrowdRows), palette.hall);
    return clamp(mean + ((off * palette.crowd) >> 2), 0, 255 * kCoverageUnit);
}

// How much a wall is off its mean, brightness times 64; the same for kPrintRows rows.
RC_HD int32_t print_on_wall(const GreyPalette& palette, Bearing bearing, int32_t row, int32_t x) {
    const uint32_t at = (bearing.first - static_cast<uint32_t>(x) * bearing.step) & 0xffffu;
    const int32_t off = patch(at >> 10, 255u + static_cast<uint32_t>(row / kPrintRows), palette.hall);
    return (off * palette.crowd) >> 5;
}

}  // namespace racecraft
