#include "camera_model.hpp"

#include <stdexcept>
#include <string>

#include "camera_kernel.hpp"

namespace racecraft {
namespace {

constexpr float kFarthest = 60.0f;  // m; rows that look farther along the ground show only wall
constexpr float kStretch = 4.25f;  // length over width of a sample's footprint on the ground, at most, before
constexpr int32_t kMaxRowSamples = 8;  // the row is split into twice as many, up to this many
constexpr float kSteep = 1.0f;         // rad; cameras that look down more steeply see no walls, as on a map
constexpr int32_t kSkySamples = 4;     // of rows above the horizon: they only smooth the walls' upper edge

// Sideways shifts of the samples of a row, in pixels, so that upright borders are smoothed as well.
constexpr float kShift[4][8] = {{0.0f},
                                {-0.25f, 0.25f},
                                {-0.375f, 0.125f, 0.375f, -0.125f},
                                {-0.4375f, 0.0625f, -0.1875f, 0.3125f, 0.4375f, -0.0625f, 0.1875f, -0.3125f}};

struct Ray {
    float down, ahead;  // per unit along the optical axis
};

void check(const CameraSpec& spec) {
    const auto fail = [](const std::string& what) { throw std::invalid_argument("Camera " + what); };
    if (spec.width < 1 || spec.width > kMaxImageWidth || spec.height < 1 || spec.height > kMaxImageWidth) {
        fail("size " + std::to_string(spec.width) + " x " + std::to_string(spec.height) + " must be 1 to " +
             std::to_string(kMaxImageWidth) + " pixels in each direction.");
    }
    if (spec.min_samples != 1 && spec.min_samples != 2 && spec.min_samples != 4 && spec.min_samples != 8) {
        fail("min_samples = " + std::to_string(spec.min_samples) + " must be 1, 2, 4 or 8.");
    }
    if (!(spec.hfov > 0.01f && spec.hfov < 3.0f)) {
        fail("hfov = " + std::to_string(spec.hfov) +
             " rad must lie between 0.01 and 3 rad; the car's is 1.13.");
    }
    if (!(abs_of(spec.pitch) <= 1.5708f)) {
        fail("pitch = " + std::to_string(spec.pitch) +
             " rad must lie between -pi/2 and pi/2; the car's is 0.2385.");
    }
    if (!(spec.above > 0.001f && spec.above < 100.0f)) {
        fail("height above the ground = " + std::to_string(spec.above) +
             " m must lie between 0.001 and 100 m.");
    }
    if (!(abs_of(spec.yaw) <= kPi)) {
        fail("yaw = " + std::to_string(spec.yaw) + " rad must lie between -pi and pi.");
    }
    if (!(abs_of(spec.forward) < 100.0f && abs_of(spec.left) < 100.0f)) {
        fail("position (" + std::to_string(spec.forward) + ", " + std::to_string(spec.left) +
             ") must be within 100 m of the car.");
    }
}

}  // namespace

CameraModel::CameraModel(const CameraSpec& spec) {
    rebuild(spec);
}

size_t CameraModel::num_bytes() const {
    return row_begin_.size() * sizeof(int32_t) + kind_.size() * (2 + 4 * sizeof(float)) +
           corner_scale_.size() * sizeof(float);
}

void CameraModel::rebuild(const CameraSpec& spec) {
    check(spec);
    row_begin_.clear();
    kind_.clear();
    exponent_.clear();
    for (std::vector<float>* table : {&distance_, &start_, &step_, &sharpness_, &corner_scale_})
        table->clear();
    float sine, cosine, half_sine, half_cosine;
    sincos_of(spec.pitch, sine, cosine);
    sincos_of(0.5f * spec.hfov, half_sine, half_cosine);
    const float width = static_cast<float>(spec.width);
    const float focal = 0.5f * width * half_cosine / half_sine;
    const auto ray = [&](float row) {  // row in pixels from the image's upper edge
        const float b = (row - 0.5f * static_cast<float>(spec.height)) / focal;
        return Ray{sine + b * cosine, cosine - b * sine};
    };
    const auto ground_distance = [&](const Ray& r) { return spec.above * r.ahead / r.down; };
    // Samples that lie beside each other as well may each be sharper.
    const float narrowing = spec.min_samples >= 4 ? 0.65f : 0.9f;
    const float farthest_slope = spec.above / kFarthest;

    for (int32_t row = 0; row < spec.height; ++row) {
        const Ray middle = ray(static_cast<float>(row) + 0.5f);
        row_begin_.push_back(static_cast<int32_t>(kind_.size()));
        corner_scale_.push_back(focal * max_of(middle.ahead, 0.01f));
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
        for (int32_t k = 0; k < samples; ++k) {
            const float part = 1.0f / static_cast<float>(samples);
            const float upper = static_cast<float>(row) + part * static_cast<float>(k);
            const Ray r = ray(upper + 0.5f * part);
            const float middle_pixel = 0.5f * width - 0.5f - shifts[k];
            // The plane that the walk lies in: the ground, or that of the walls' upper edge.
            const float drop = r.down > 0.0f ? spec.above : spec.above - kWallHeight;
            const bool is_seen = drop / r.down > 0.0f && abs_of(r.down) * kFarthest > abs_of(drop);
            const float reach = is_seen ? drop / r.down : 0.0f;
            const float step = reach / focal;
            float filter = step;
            if (is_seen && r.down > 0.0f) {
                const Ray first = ray(upper);
                const float length = first.down > farthest_slope
                                         ? abs_of(ground_distance(first) - ground_distance(ray(upper + part)))
                                         : kFarthest;
                filter = narrowing * (length > step ? sqrt_of(step * length) : step);
            }
            int8_t exponent = -8;
            for (float texel = 0.01f / 256.0f; texel * 1.41421356f < filter && exponent < 8; texel *= 2.0f)
                ++exponent;
            kind_.push_back(is_seen ? (r.down > 0.0f ? kSampleGround : kSampleSky) : kSampleWall);
            exponent_.push_back(exponent);
            distance_.push_back(reach * r.ahead);
            start_.push_back(-middle_pixel * step);
            step_.push_back(step);
            sharpness_.push_back(filter > 0.0f ? 256.0f / filter : 0.0f);
        }
    }
    row_begin_.push_back(static_cast<int32_t>(kind_.size()));
    view_ = {spec,
             static_cast<int32_t>(kind_.size()),
             row_begin_.data(),
             kind_.data(),
             exponent_.data(),
             distance_.data(),
             start_.data(),
             step_.data(),
             sharpness_.data(),
             corner_scale_.data(),
             spec.pitch > kSteep ? 1.0f : (spec.above - kWallHeight) / spec.above};
}

void render_grey(const CameraModel& camera, const GroundMap& ground, const GreyPalette& palette, float x,
                 float y, float heading, uint8_t* out) {
    const ShadeTable table = shade_table(palette);
    const LensPose lens = place_lens(camera.view(), ground.view(), x, y, heading);
    RC_DISPATCH(render_room, camera.view(), ground.view(), &table, 1, lens, out);
}

}  // namespace racecraft
