// A camera that does not roll, over a plane: every image row is a straight walk over the ground at constant
// speed.
//
//        lens, h above the ground            row j looks  down_j = sin(pitch) + b_j cos(pitch)   below the
//        horizon
//          *-._                                  and     ahead_j = cos(pitch) - b_j sin(pitch)   ahead,
//          |   `-._  ray of row j                b_j = (j + 1/2 - height/2) / focal length.
//        h |       `-._                      It meets the ground h ahead_j / down_j ahead of the lens, and
//        one pixel
//     _____|___________`*_____ ground        to the right is h / (down_j focal length) metres to the right.
//
// A row is the mean of 1, 2, 4 or 8 *samples*: thinner rows, one below the other, each with its own walk and
// its own sideways shift. All that does not depend on the pose is in CameraView, made once per camera model.
// The room's four walls need no division per pixel: a sample row shows ground (below the horizon) or sky
// (above it) exactly where its walk is inside the room, on the plane of the ground or of the walls' upper
// edge; the rest is wall.
#pragma once

#include "racecraft/ground.hpp"
#include "racecraft/palette.hpp"

namespace racecraft {

constexpr int32_t kMaxImageWidth = 4096;
constexpr float kSteep = 1.0f;  // rad; cameras that look down more steeply see no walls, as on a map

struct CameraSpec {
    int32_t width = 160;       // pixels
    int32_t height = 120;      // pixels
    float hfov = 1.13f;        // rad, horizontal field of view
    float pitch = 0.2385f;     // rad, looking down; 0.2618 on the car's plan, less as the car squats
    float forward = 0.14529f;  // m, lens ahead of the car's origin
    float left = 0.0f;         // m, lens to the left of it; +-0.03 are the stereo pair
    float above = 0.1314f;     // m, lens above the ground
    int32_t min_samples = 1;   // of every row: 1, 2, 4 or 8; 4 gives pictures for people their smooth edges
    float yaw = 0.0f;          // rad, looking to the left of where the car points
    float wall_height = kWallHeight;  // m, of the room that it is in
};

enum SampleKind : uint8_t {
    kSampleWall =
        0,  // at the horizon: too far away to be anything but wall (or outside, from above the walls)
    kSampleGround = 1,  // below the horizon
    kSampleSky = 2,     // above the horizon
};

// Everything about a camera that does not depend on its pose. Points at memory owned by CameraModel.
struct CameraView {
    CameraSpec spec;
    int32_t num_samples;        // M, samples of all rows together
    const int32_t* row_begin;   // first sample of a row; a row has 1, 2, 4 or 8           (height + 1,)
    const uint8_t* kind;        // SampleKind                                               (M,)
    const int8_t* exponent;     // wanted texel size is 0.01 m * 2^exponent                 (M,)
    const float* distance;      // m ahead of the lens where the walk passes the image's middle    (M,)
    const float* start;         // m to the right of the middle, of pixel 0                 (M,)
    const float* step;          // m to the right per pixel                                 (M,)
    const float* sharpness;     // 256 / filter width, 1/m                                  (M,)
    const float* corner_scale;  // pixels to the right of the middle per unit of right/ahead   (height,)
    float down, down_step;      // what a ray through row 0 falls per unit along the axis, and each row more
    float upper_scale;          // what stretches a walk on the ground to the plane of the walls' upper edge
};

// Where the lens is and looks.
struct LensPose {
    float x, y;          // m
    float sine, cosine;  // of the heading
};

// Lens of a car whose origin is at (x, y). The lens stays inside the room, and any finite or non-finite pose
// is safe.
RC_HD LensPose place_lens(const CameraView& camera, const GroundView& ground, float x, float y,
                          float heading) {
    LensPose lens;
    const bool is_usable = abs_of(heading) < 1000.0f && abs_of(x) < 1e6f && abs_of(y) < 1e6f;
    sincos_of(is_usable ? heading : 0.0f, lens.sine, lens.cosine);
    const float ahead = camera.spec.forward;
    const float left = camera.spec.left;
    const float wanted_x = (is_usable ? x : 0.0f) + ahead * lens.cosine - left * lens.sine;
    const float wanted_y = (is_usable ? y : 0.0f) + ahead * lens.sine + left * lens.cosine;
    constexpr float margin = 0.02f;
    lens.x = clamp(wanted_x, ground.min_x + margin, ground.max_x - margin);
    lens.y = clamp(wanted_y, ground.min_y + margin, ground.max_y - margin);
    if (camera.spec.yaw != 0.0f) {
        sincos_of((is_usable ? heading : 0.0f) + camera.spec.yaw, lens.sine, lens.cosine);
    }
    return lens;
}

// Pixels [begin, end) of a walk that lie inside the room.
struct PixelSpan {
    int32_t begin, end;
};

RC_HD PixelSpan clip_walk(const GroundView& ground, float x, float y, float step_x, float step_y,
                          int32_t width) {
    constexpr float tiny = 1e-9f;
    const float inverse_x = 1.0f / (abs_of(step_x) < tiny ? tiny : step_x);
    const float inverse_y = 1.0f / (abs_of(step_y) < tiny ? tiny : step_y);
    const float x0 = (ground.min_x - x) * inverse_x;
    const float x1 = (ground.max_x - x) * inverse_x;
    const float y0 = (ground.min_y - y) * inverse_y;
    const float y1 = (ground.max_y - y) * inverse_y;
    const float limit = static_cast<float>(width);
    const float first = clamp(max_of(min_of(x0, x1), min_of(y0, y1)), 0.0f, limit);
    const float last = clamp(min_of(max_of(x0, x1), max_of(y0, y1)) + 1.0f, 0.0f, limit);
    const int32_t whole = static_cast<int32_t>(first);
    const int32_t begin = whole + static_cast<int32_t>(static_cast<float>(whole) < first);
    const int32_t end = static_cast<int32_t>(last);
    return {begin, max_of(begin, end)};
}

// A wall as the lens sees it: between two directions, each as right / ahead.
struct WallSpan {
    float left, right;
    int32_t wall;  // index into a palette's walls
};

// The walls in view, at most four, from left to right; returns their number.
RC_HD int32_t walls_in_view(const GroundView& ground, const LensPose& lens, WallSpan* spans) {
    // Corners clockwise as seen from above, which is left to right as seen from inside; wall i begins at
    // corner i.
    const float corner_x[5] = {ground.max_x, ground.max_x, ground.min_x, ground.min_x, ground.max_x};
    const float corner_y[5] = {ground.max_y, ground.min_y, ground.min_y, ground.max_y, ground.max_y};
    constexpr int32_t walls[kNumWalls] = {0, 3, 2, 1};
    constexpr float nearest = 1e-3f;
    constexpr float everything = 1e6f;
    int32_t count = 0;
    for (int32_t i = 0; i < kNumWalls; ++i) {
        const float ahead0 = (corner_x[i] - lens.x) * lens.cosine + (corner_y[i] - lens.y) * lens.sine;
        const float right0 = (corner_x[i] - lens.x) * lens.sine - (corner_y[i] - lens.y) * lens.cosine;
        const float ahead1 =
            (corner_x[i + 1] - lens.x) * lens.cosine + (corner_y[i + 1] - lens.y) * lens.sine;
        const float right1 =
            (corner_x[i + 1] - lens.x) * lens.sine - (corner_y[i + 1] - lens.y) * lens.cosine;
        if (ahead0 <= nearest && ahead1 <= nearest) continue;
        spans[count].left = ahead0 > nearest ? right0 / ahead0 : -everything;
        spans[count].right = ahead1 > nearest ? right1 / ahead1 : everything;
        spans[count].wall = walls[i];
        ++count;
    }
    for (int32_t i = 1; i < count; ++i) {
        for (int32_t k = i; k > 0 && spans[k].left < spans[k - 1].left; --k) {
            const WallSpan span = spans[k];
            spans[k] = spans[k - 1];
            spans[k - 1] = span;
        }
    }
    return count;
}

}  // namespace racecraft
