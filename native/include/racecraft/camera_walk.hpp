// The walk of one sample row over the ground from where the lens is, and what it adds to a row of pixels.
#pragma once

#include "racecraft/camera.hpp"

namespace racecraft {

constexpr float kFixedOne = 65536.0f;  // a texel in 16.16 fixed point

struct SampleWalk {
    int32_t begin, end;    // pixels inside the room
    int32_t u, v, du, dv;  // GroundWalk
};

// Level of the pyramid that a sample reads.
RC_HD int32_t sample_level(const CameraView& camera, const GroundView& ground, int32_t sample) {
    return clamp(camera.exponent[sample] - ground.exponent, 0, ground.num_levels - 1);
}

// scale: texels per metre of the level, in fixed point. plane_scale stretches the walks of the ground to
// another horizontal plane.
RC_HD SampleWalk sample_walk(const CameraView& camera, const GroundView& ground, const LensPose& lens,
                             int32_t sample, float plane_scale, float scale) {
    constexpr float limit = 2.0e9f;
    const float right_x = lens.sine;
    const float right_y = -lens.cosine;
    const float ahead = camera.distance[sample] * plane_scale;
    const float start = camera.start[sample] * plane_scale;
    const float step = camera.step[sample] * plane_scale;
    const float x = lens.x + ahead * lens.cosine + start * right_x;
    const float y = lens.y + ahead * lens.sine + start * right_y;
    const PixelSpan span = clip_walk(ground, x, y, step * right_x, step * right_y, camera.spec.width);
    // The ring of one texel is where a level's texels begin.
    const float u = (x - ground.min_x) * scale + kFixedOne;
    const float v = (y - ground.min_y) * scale + kFixedOne;
    const float farthest = max_of(abs_of(u), abs_of(v));
    return {span.begin,
            farthest < limit ? span.end : span.begin,
            static_cast<int32_t>(clamp(u, -limit, limit)),
            static_cast<int32_t>(clamp(v, -limit, limit)),
            static_cast<int32_t>(clamp(step * right_x * scale, -limit, limit)),
            static_cast<int32_t>(clamp(step * right_y * scale, -limit, limit))};
}

// The factor of shade_edge() for a sample.
RC_HD int32_t sample_sharpness(const CameraView& camera, const GroundView& ground, int32_t sample) {
    return static_cast<int32_t>(min_of(camera.sharpness[sample] * ground.texel, 32767.0f));
}

// Whether two neighbouring pixels of a sample may share the texel under their common edge: the row is all
// ground, and pixels are small against an edge texel.
RC_HD bool can_share_texels(const CameraView& camera, const GroundView& ground, int32_t sample, int32_t begin,
                            int32_t end, int32_t level) {
    constexpr float largest_step = 0.95f;  // texels
    return camera.kind[sample] == kSampleGround && begin == 0 && end == camera.spec.width && level == 0 &&
           camera.step[sample] < largest_step * ground.texel;
}

constexpr int32_t kSheenRows = 4;  // neighbouring rows that share the shades of their sheen

// How much of its sheen the ground shows to a lens; from above, where there is no way it looks, none.
RC_HD float sheen_share(const CameraView& camera, const Sheen& sheen, const LensPose& lens) {
    return camera.spec.pitch > kSteep ? 0.0f : sheen_towards(sheen, lens.sine, lens.cosine);
}

// The shades of the ground in a row of a lens to which it shows that much.
RC_HD GroundShades row_shades(const CameraView& camera, const GreyPalette& palette, const Sheen& sheen,
                              float share, int32_t row) {
    const int32_t first = row / kSheenRows * kSheenRows;
    const float middle = static_cast<float>(first) + 0.5f * static_cast<float>(kSheenRows - 1);
    return shades_in_sheen(palette, sheen, share, camera.down + middle * camera.down_step);
}

// Half of a signed step of a walk.
RC_HD uint32_t half_step(uint32_t step) {
    return static_cast<uint32_t>(static_cast<int32_t>(step) >> 1);
}

// Sums of a row's samples are brightness times 64 times samples; this divides them.
RC_HD int32_t row_shift(int32_t samples) {
    return samples == 1 ? 6 : samples == 2 ? 7 : samples == 4 ? 8 : 9;
}

// Where wall `index` of those in view meets the next one in a row: a pixel, and what that pixel shows of
// both.
struct WallEdge {
    int32_t pixel;
    int32_t mixture;  // brightness times 64
};

RC_HD WallEdge wall_edge(const WallSpan* walls, int32_t index, float corner_scale, int32_t width,
                         const int32_t* shades) {
    const float middle = 0.5f * static_cast<float>(width);
    const float edge = clamp(middle + corner_scale * walls[index].right, 0.0f, static_cast<float>(width));
    const int32_t pixel = static_cast<int32_t>(edge);
    const int32_t share = static_cast<int32_t>((edge - static_cast<float>(pixel)) * 64.0f);
    return {pixel, (shades[walls[index].wall] * share + shades[walls[index + 1].wall] * (64 - share)) >> 6};
}

}  // namespace racecraft
