// The objects around every car of a batch: one row of them per car, placed, driven, hit and written by the
// plain functions of racecraft/objects.hpp and racecraft/collision.hpp. Without objects nothing here costs
// anything.
#pragma once

#include <vector>

#include "racecraft/camera.hpp"
#include "racecraft/collision.hpp"

namespace racecraft {

class ObjectField {
  public:
    // Throws std::invalid_argument for a rule that no track could follow. The camera decides which objects
    // are in view; a car without one has the default camera's eyes.
    ObjectField(const ObjectRule& rule, size_t num_envs, const CameraSpec* camera);

    int32_t count() const { return count_; }
    bool has_bots() const { return rule_.bots.count > 0; }
    int32_t row_width() const { return object_row_width(count_); }
    int32_t state_width() const { return count_ > 0 ? kNumObjectState : 0; }
    ObjectState* objects_of(size_t env) { return objects_.data() + env * static_cast<size_t>(count_); }
    const ObjectState* objects_of(size_t env) const {
        return objects_.data() + env * static_cast<size_t>(count_);
    }

    void place(size_t env, const TrackGeometry& track, uint64_t seed, uint32_t stream, uint32_t episode);

    // One control step of the bots. A bot waits where it would run into the back of a car that can be hit.
    void advance(size_t env, const TrackGeometry& track, uint64_t seed, uint32_t stream,
                 const Episode& episode, const VehicleState& car);

    // The object the car has run into at its current pose, or -1.
    int32_t find_crash(size_t env, const TrackGeometry& track, const Episode& episode,
                       const VehicleState& car) const;

    void write_row(size_t env, const Episode& episode, const VehicleState& car, int32_t crashed,
                   double* out) const;
    void observe(size_t env, const TrackGeometry& track, const Episode& episode, float* out) const;

    std::vector<ObjectState>& states() { return objects_; }
    // Null if the states are ones that this field can go on from.
    const char* find_fault() const;

  private:
    friend class DevicePlan;

    ObjectRule rule_;
    int32_t count_;
    float lens_forward_, lens_left_, half_tangent_;
    std::vector<ObjectState> objects_;  // (N, count)
};

}  // namespace racecraft
