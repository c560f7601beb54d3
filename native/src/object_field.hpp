// The worlds of a batch: what stands and drives on the track around the cars of every race, placed, driven,
// hit and written by the plain functions of racecraft/objects.hpp and racecraft/collision.hpp. Without
// objects and with one car to a race nothing here costs anything.
//
//   world of a race:  [obstacles | bots | its cars, where there are several]
//   around a car:     the same without itself
#pragma once

#include <vector>

#include "racecraft/camera.hpp"
#include "racecraft/grid.hpp"
#include "racecraft/start.hpp"

namespace racecraft {

class ObjectField {
  public:
    // Throws std::invalid_argument for a rule that no track could follow. The camera decides which objects
    // are in view; a car without one has the default camera's eyes.
    ObjectField(const ObjectRule& rule, size_t num_envs, size_t cars_per_race, const CameraSpec* camera);

    int32_t count() const { return count_; }  // around a car
    bool has_bots() const { return rule_.bots.count > 0; }
    bool has_racers() const { return num_racers_ > 0; }
    int32_t row_width() const { return object_row_width(count_); }
    int32_t state_width() const { return count_ > 0 ? kNumObjectState : 0; }
    ObjectsAround around(size_t env) const {
        const size_t car = env % cars_per_race_;
        return {world(env / cars_per_race_), count_, first_racer_, first_racer_ + static_cast<int32_t>(car)};
    }

    // Obstacles and bots at the beginning of a race.
    void place(size_t race, const TrackGeometry& track, const Draws& draws);

    // One control step of the bots. A bot waits where it would run into the back of one of these cars.
    void advance(size_t race, const TrackGeometry& track, const Draws& draws, const Footprint* cars,
                 int32_t num_cars);

    // Shows a car to the others of its race as what it is now; nothing where it races alone.
    void publish(size_t env, const TrackGeometry& track, const VehicleState& car, ObjectKind kind);

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

    size_t width() const { return static_cast<size_t>(first_racer_ + num_racers_); }
    ObjectState* world(size_t race) { return objects_.data() + race * width(); }
    const ObjectState* world(size_t race) const { return objects_.data() + race * width(); }

    ObjectRule rule_;
    size_t cars_per_race_;
    int32_t first_racer_;  // obstacles and bots of a world
    int32_t num_racers_;   // 0 where every car races alone
    int32_t count_;
    float lens_forward_, lens_left_, half_tangent_;
    std::vector<ObjectState> objects_;  // (races, width)
};

}  // namespace racecraft
