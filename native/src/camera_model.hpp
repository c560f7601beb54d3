// Camera tables and the renderer of driver's frames.
#pragma once

#include <vector>

#include "ground_map.hpp"
#include "racecraft/camera.hpp"

namespace racecraft {

class CameraModel {
  public:
    // Throws std::invalid_argument for a size, angle or height that no camera can have.
    explicit CameraModel(const CameraSpec& spec);

    // Becomes the model of another camera, in the memory it has.
    void rebuild(const CameraSpec& spec);
    size_t num_bytes() const;

    CameraModel(CameraModel&&) = default;
    CameraModel& operator=(CameraModel&&) = default;

    const CameraSpec& spec() const { return view_.spec; }
    const CameraView& view() const { return view_; }

  private:
    void resize_samples(size_t count);

    std::vector<int32_t> row_begin_;
    std::vector<uint8_t> kind_;
    std::vector<int8_t> exponent_;
    std::vector<float> distance_, start_, step_, sharpness_, corner_scale_;
    CameraView view_{};
};

// What the camera of a car at (x, y, heading) sees, into out (height, width). Allocates nothing and may be
// called from any thread. Poses outside the room are moved to its walls.
void render_grey(const CameraModel& camera, const GroundMap& ground, const GreyPalette& palette,
                 const Sheen& sheen, float x, float y, float heading, uint8_t* out);

}  // namespace racecraft
