#include "exposure_kernel.hpp"

#include "racecraft/exposure.hpp"

namespace racecraft::RC_ISA {
namespace {

// Halves of 16 x 16 bits throughout: twice as many lanes as with whole words.
void shade(uint8_t* frame, int width, int height, float gradient_across, float gradient_down) {
    alignas(64) uint16_t light[kMaxExposedWidth];
    for (int x = 0; x < width; ++x) light[x] = light_at(x, width, gradient_across);
    for (int y = 0; y < height; ++y) {
        const uint16_t row_light = light_at(y, height, gradient_down);
        uint8_t* line = frame + static_cast<size_t>(y) * static_cast<size_t>(width);
#pragma GCC ivdep
        for (int x = 0; x < width; ++x) {
            line[x] = lit_pixel(line[x], light[x], row_light);
        }
    }
}

// (side, 256 - 2 side, side) / 256 across, then down; borders repeat.
void blur_once(uint8_t* frame, int width, int height, uint16_t side) {
    alignas(64) uint8_t padded[kMaxExposedWidth + 2];
    alignas(64) uint8_t lines[3][kMaxExposedWidth];  // blurred across: the line above, this one, the next
    const auto blur_across = [&](int y, uint8_t* out) {
        const uint8_t* line = frame + static_cast<size_t>(y) * static_cast<size_t>(width);
        padded[0] = line[0];
        for (int x = 0; x < width; ++x) padded[x + 1] = line[x];
        padded[width + 1] = line[width - 1];
#pragma GCC ivdep
        for (int x = 0; x < width; ++x) {
            out[x] = blurred_pixel(padded[x], padded[x + 1], padded[x + 2], side);
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
            line[x] = blurred_pixel(above[x], here[x], below[x], side);
        }
    }
}

}  // namespace

void expose(uint8_t* frame, int width, int height, float gradient_across, float gradient_down, float blur) {
    if (gradient_across != 0.0f || gradient_down != 0.0f) {
        shade(frame, width, height, gradient_across, gradient_down);
    }
    const BlurFilter filter = blur_filter(blur);
    for (int pass = 0; pass < filter.passes; ++pass) blur_once(frame, width, height, filter.side);
}

}  // namespace racecraft::RC_ISA
