// Folds of the floor: straight lines on the ground, light on one side and dark on the other.
//
// A line on the ground is a line in the picture. With the lens h above the ground at l, looking along a, and
// right of it r, the points with n (p - l) = d are where, b pixels below the middle over the focal length f,
//
//     x / f = (d / h (sin + b cos) - n a (cos - b sin)) / (n r)          of the pitch
//
// pixels to the right of the middle.
#pragma once

#include "racecraft/lens.hpp"

namespace racecraft {

constexpr float kFoldReach = 0.8f;  // m ahead of the lens; the fold nearest to there is the one that is drawn

// Lightens a pixel and darkens the next along `stride`.
RC_HD void draw_fold_pixel(uint8_t* light, ptrdiff_t stride, int32_t strength) {
    light[0] = static_cast<uint8_t>(min_of(light[0] + strength, 255));
    light[stride] = static_cast<uint8_t>(max_of(light[stride] - strength, 0));
}

// Draws the line n (p - l) = d, whose n makes these parts along the lens's axis and to its right.
RC_HD void draw_fold(const CameraSpec& spec, float focal, float distance, float ahead, float right,
                     int32_t strength, uint8_t* picture) {
    float sine, cosine;
    sincos_of(spec.pitch, sine, cosine);
    const float width = static_cast<float>(spec.width);
    const float height = static_cast<float>(spec.height);
    const float reach = distance / spec.above;
    // A pixel is on the line where right x + down y = level, from the middle.
    const float down = ahead * -sine - reach * cosine;
    const float level = focal * (reach * sine - ahead * cosine);
    const float horizon = max_of(0.5f * height - focal * sine / cosine + 2.0f, 0.0f);
    if (horizon >= height - 1.0f) return;
    const int32_t first = static_cast<int32_t>(horizon);
    constexpr float limit = 20000.0f;     // pixels; in 16.16 fixed point
    if (abs_of(right) >= abs_of(down)) {  // steep: a pixel in every row
        const float slope = -down / right;
        const float y = static_cast<float>(first) + 0.5f - 0.5f * height;
        const float x = level / right + slope * y + 0.5f * width;
        if (!(abs_of(x) < limit)) return;
        int32_t at = static_cast<int32_t>(65536.0f * x);
        const int32_t step = static_cast<int32_t>(65536.0f * slope);
        for (int32_t row = first; row < spec.height; ++row, at += step) {
            const int32_t column = at >> 16;
            if (static_cast<uint32_t>(column) >= static_cast<uint32_t>(spec.width - 1)) continue;
            draw_fold_pixel(picture + static_cast<ptrdiff_t>(row) * spec.width + column, 1, strength);
        }
        return;
    }
    const float slope = -right / down;
    const float y = level / down + slope * (0.5f - 0.5f * width) + 0.5f * height;
    if (!(abs_of(y) < limit)) return;
    int32_t at = static_cast<int32_t>(65536.0f * y);
    const int32_t step = static_cast<int32_t>(65536.0f * slope);
    for (int32_t column = 0; column < spec.width; ++column, at += step) {
        const int32_t row = at >> 16;
        if (row < first || row + 1 >= spec.height) continue;
        draw_fold_pixel(picture + static_cast<ptrdiff_t>(row) * spec.width + column, spec.width, strength);
    }
}

// Draws the fold in view.
RC_HD void draw_folds(const CameraSpec& spec, const LensPose& lens, const Shot& shot, float contrast,
                      uint8_t* picture) {
    const int32_t strength = static_cast<int32_t>(255.0f * clamp(contrast, 0.0f, 1.0f) + 0.5f);
    if (strength == 0) return;
    float sine, cosine;
    sincos_of(shot.fold_heading, sine, cosine);
    const float ahead = cosine * lens.cosine + sine * lens.sine;
    const float right = cosine * lens.sine - sine * lens.cosine;
    const float here = cosine * lens.x + sine * lens.y;
    const float distance =
        round_of((here + kFoldReach * ahead) / shot.fold_spacing) * shot.fold_spacing - here;
    draw_fold(spec, shot.focal, distance, ahead, right, strength, picture);
}

}  // namespace racecraft
