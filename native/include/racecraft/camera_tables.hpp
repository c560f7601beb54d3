// What does not depend on a camera's pose, computed from its specification: how every image row is sampled.
#pragma once

#include "racecraft/camera.hpp"

namespace racecraft {

constexpr float kFarthest = 60.0f;  // m; rows that look farther along the ground show only wall
constexpr float kStretch = 4.25f;  // length over width of a sample's footprint on the ground, at most, before
constexpr int32_t kMaxRowSamples = 8;  // the row is split into twice as many, up to this many
constexpr int32_t kSkySamples = 4;     // of rows above the horizon: they only smooth the walls' upper edge

// Sideways shifts of the samples of a row, in pixels, so that upright borders are smoothed as well.
constexpr float kShift[4][8] = {{0.0f},
                                {-0.25f, 0.25f},
                                {-0.375f, 0.125f, 0.375f, -0.125f},
                                {-0.4375f, 0.0625f, -0.1875f, 0.3125f, 0.4375f, -0.0625f, 0.1875f, -0.3125f}};

struct CameraRay {
    float down, ahead;  // per unit along the optical axis
};

// Memory for the tables of a CameraView; those of samples have room for kMaxRowSamples * height.
struct CameraTables {
    int32_t* row_begin;  // (height + 1,)
    uint8_t* kind;
    int8_t* exponent;
    float *distance, *start, *step, *sharpness;
    float* corner_scale;  // (height,)
};

// Fills the tables of a camera.
RC_HD CameraView fill_camera(const CameraSpec& spec, const CameraTables& out) {
    float sine, cosine, half_sine, half_cosine;
    sincos_of(spec.pitch, sine, cosine);
    sincos_of(0.5f * spec.hfov, half_sine, half_cosine);
    const float width = static_cast<float>(spec.width);
    const float focal = 0.5f * width * half_cosine / half_sine;
    const auto ray = [&](float row) {  // row in pixels from the image's upper edge
        const float b = (row - 0.5f * static_cast<float>(spec.height)) / focal;
        return CameraRay{sine + b * cosine, cosine - b * sine};
    };
    const auto ground_distance = [&](const CameraRay& r) { return spec.above * r.ahead / r.down; };
    // Samples that lie beside each other as well may each be sharper.
    const float narrowing = spec.min_samples >= 4 ? 0.65f : 0.9f;
    const float farthest_slope = spec.above / kFarthest;

    int32_t count = 0;
    for (int32_t row = 0; row < spec.height; ++row) {
        const CameraRay middle = ray(static_cast<float>(row) + 0.5f);
        out.row_begin[row] = count;
        out.corner_scale[row] = focal * max_of(middle.ahead, 0.01f);
        // How many samples: enough that none is much longer on the ground than wide.
        int32_t samples = kSkySamples;
        if (ray(static_cast<float>(row)).down > farthest_slope) {
            const float wide = spec.above / (middle.down * focal);
            const float length = abs_of(ground_distance(ray(static_cast<float>(row))) -
                                        ground_distance(ray(static_cast<float>(row + 1))));
            samples = spec.min_samples;
            while (samples < kMaxRowSamples && length > kStretch * wide * static_cast<float>(samples))
                samples *= 2;
        }
        const float* shifts = kShift[samples == 1 ? 0 : samples == 2 ? 1 : samples == 4 ? 2 : 3];
        for (int32_t k = 0; k < samples; ++k, ++count) {
            const float part = 1.0f / static_cast<float>(samples);
            const float upper = static_cast<float>(row) + part * static_cast<float>(k);
            const CameraRay r = ray(upper + 0.5f * part);
            const float middle_pixel = 0.5f * width - 0.5f - shifts[k];
            // The plane that the walk lies in: the ground, or that of the walls' upper edge.
            const float drop = r.down > 0.0f ? spec.above : spec.above - spec.wall_height;
            const bool is_seen = drop / r.down > 0.0f && abs_of(r.down) * kFarthest > abs_of(drop);
            const float reach = is_seen ? drop / r.down : 0.0f;
            const float step = reach / focal;
            float filter = step;
            if (is_seen && r.down > 0.0f) {
                const CameraRay first = ray(upper);
                const float length = first.down > farthest_slope
                                         ? abs_of(ground_distance(first) - ground_distance(ray(upper + part)))
                                         : kFarthest;
                filter = narrowing * (length > step ? sqrt_of(step * length) : step);
            }
            int8_t exponent = -8;
            for (float texel = 0.01f / 256.0f; texel * 1.41421356f < filter && exponent < 8; texel *= 2.0f)
                ++exponent;
            const SampleKind plane = r.down > 0.0f ? kSampleGround : kSampleSky;
            out.kind[count] = is_seen ? plane : kSampleWall;
            out.exponent[count] = exponent;
            out.distance[count] = reach * r.ahead;
            out.start[count] = -middle_pixel * step;
            out.step[count] = step;
            out.sharpness[count] = filter > 0.0f ? 256.0f / filter : 0.0f;
        }
    }
    out.row_begin[spec.height] = count;
    CameraView view{};
    view.spec = spec;
    view.num_samples = count;
    view.row_begin = out.row_begin;
    view.kind = out.kind;
    view.exponent = out.exponent;
    view.distance = out.distance;
    view.start = out.start;
    view.step = out.step;
    view.sharpness = out.sharpness;
    view.corner_scale = out.corner_scale;
    view.down = ray(0.5f).down;
    view.down_step = cosine / focal;
    view.upper_scale = spec.pitch > kSteep ? 1.0f : (spec.above - spec.wall_height) / spec.above;
    return view;
}

}  // namespace racecraft
