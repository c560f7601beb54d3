// What cars' sensors tell a policy.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "actor_critic.hpp"
#include "engine.hpp"
#include "racecraft/lidar.hpp"
#include "settings.hpp"

namespace racecraft {

// What the cars' sensors tell a network that was made for them: their frames as they lie there, or behind
// each the LIDAR's distances times 255 as bytes, as racecraft.agent.SensorSuite.read() has AWS's sensor
// LIDAR.
class Senses {
  public:
    Senses(Engine& cars, const ActorCriticShape& shape) : cars_(cars), num_pixels_(pixels_of(cars)) {
        const bool has_lidar = shape.sight_size != num_pixels_;
        const size_t rays = has_lidar && cars.lidar() != nullptr ? static_cast<size_t>(kLidarRays) : 0;
        require(num_pixels_ + rays == shape.sight_size, "The network was made for other sensors.");
        if (rays > 0) bytes_.resize(cars.num_envs() * shape.sight_size);
    }

    // What they tell now, good until the next call of this or of the cars.
    const uint8_t* read() {
        if (bytes_.empty()) return cars_.frames();
        constexpr float kNearest = 0.15f, kFarthest = 1.0f;
        const uint8_t* frame = cars_.frames();
        const float* ray = cars_.lidar();
        uint8_t* to = bytes_.data();
        for (size_t car = 0; car < cars_.num_envs(); ++car, frame += num_pixels_) {
            to = std::copy_n(frame, num_pixels_, to);
            for (int32_t i = 0; i < kLidarRays; ++i) {
                const float distance = std::clamp(*ray++, kNearest, kFarthest);
                *to++ = static_cast<uint8_t>(std::rint(distance * 255.0f));  // halves to even, as NumPy
            }
        }
        return bytes_.data();
    }

    static size_t pixels_of(const Engine& cars) {
        const CameraModel* camera = cars.camera();
        return camera == nullptr ? 0 : static_cast<size_t>(camera->spec().width * camera->spec().height);
    }

  private:
    Engine& cars_;
    size_t num_pixels_;
    std::vector<uint8_t> bytes_;  // (N, sight_size), or empty
};

}  // namespace racecraft
