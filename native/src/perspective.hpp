// Points of the world in a picture, for pictures of people.
#pragma once

#include "camera_model.hpp"
#include "car_mesh.hpp"

namespace racecraft {

constexpr float kNearestSeen = 0.02f;  // m along the optical axis

// From the world to the image: x right, y down, both in pixels; depth along the optical axis.
class Perspective {
  public:
    Perspective(const CameraSpec& spec, const LensPose& lens) : spec_(spec), lens_(lens) {
        float sine, cosine;
        sincos_of(0.5f * spec.hfov, sine, cosine);
        focal_ = 0.5f * static_cast<float>(spec.width) * cosine / sine;
        sincos_of(spec.pitch, pitch_sine_, pitch_cosine_);
    }

    Vector3 project(Vector3 p) const {
        const float dx = p.x - lens_.x;
        const float dy = p.y - lens_.y;
        const float ahead = dx * lens_.cosine + dy * lens_.sine;
        const float right = dx * lens_.sine - dy * lens_.cosine;
        const float up = p.z - spec_.above;
        const float depth = ahead * pitch_cosine_ - up * pitch_sine_;
        const float down = -ahead * pitch_sine_ - up * pitch_cosine_;
        const float scale = focal_ / max_of(depth, kNearestSeen);
        return {0.5f * static_cast<float>(spec_.width) + scale * right,
                0.5f * static_cast<float>(spec_.height) + scale * down, depth};
    }

    // The ground under the centre of a pixel; false at and above the horizon.
    bool find_ground(int column, int row, float& x, float& y) const {
        const float a = (static_cast<float>(column) + 0.5f - 0.5f * static_cast<float>(spec_.width)) / focal_;
        const float b = (static_cast<float>(row) + 0.5f - 0.5f * static_cast<float>(spec_.height)) / focal_;
        const float down = pitch_sine_ + b * pitch_cosine_;
        if (down <= 1e-4f) return false;
        const float reach = spec_.above / down;
        const float ahead = reach * (pitch_cosine_ - b * pitch_sine_);
        x = lens_.x + ahead * lens_.cosine + reach * a * lens_.sine;
        y = lens_.y + ahead * lens_.sine - reach * a * lens_.cosine;
        return true;
    }

    // Pixels that a metre across takes, at a depth in m.
    float scale(float depth) const { return focal_ / max_of(depth, kNearestSeen); }

  private:
    CameraSpec spec_;
    LensPose lens_;
    float focal_, pitch_sine_, pitch_cosine_;
};

}  // namespace racecraft
