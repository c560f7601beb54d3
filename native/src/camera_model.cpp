#include "camera_model.hpp"

#include <string>

#include "camera_kernel.hpp"
#include "racecraft/camera_tables.hpp"
#include "refuse.hpp"

namespace racecraft {
namespace {

void check(const CameraSpec& spec) {
    const auto fail = [](const std::string& what) { refuse("Camera " + what); };
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
    const size_t rows = static_cast<size_t>(spec.height);
    row_begin_.resize(rows + 1);
    corner_scale_.resize(rows);
    resize_samples(rows * kMaxRowSamples);
    const CameraTables tables{row_begin_.data(), kind_.data(), exponent_.data(),  distance_.data(),
                              start_.data(),     step_.data(), sharpness_.data(), corner_scale_.data()};
    view_ = fill_camera(spec, tables);
    resize_samples(static_cast<size_t>(view_.num_samples));  // keeps its memory, and so the tables' places
}

void CameraModel::resize_samples(size_t count) {
    kind_.resize(count);
    exponent_.resize(count);
    for (std::vector<float>* table : {&distance_, &start_, &step_, &sharpness_}) table->resize(count);
}

void render_grey(const CameraModel& camera, const GroundMap& ground, const GreyPalette& palette,
                 const Sheen& sheen, float x, float y, float heading, uint8_t* out) {
    const LensPose lens = place_lens(camera.view(), ground.view(), x, y, heading);
    RC_DISPATCH(render_room, camera.view(), ground.view(), &palette, sheen, 1, lens, out);
}

}  // namespace racecraft
