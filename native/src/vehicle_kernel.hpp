// Physics of many cars at once.
#pragma once

#include "dispatch.hpp"
#include "racecraft/vehicle.hpp"

namespace racecraft {

constexpr int kLanes = 16;  // cars that a kernel advances together; fewer may be asked for

// Struct of arrays, (num_envs,) each.
struct VehicleArrays {
    float* x;
    float* y;
    float* heading;
    float* speed;
    float* lateral_speed;
    float* yaw_rate;
    float* steering;
    const float* steering_command;  // rad, clipped
    const float* speed_command;     // m/s, clipped
    const float* is_moving;         // 1 to advance the car, 0 to leave it as it stands
    const float* parameters;        // (kNumVehicleParameters, stride)
    size_t stride;                  // num_envs
    // Commands that act late, see acting_command(); all null where none does.
    const int32_t* delay = nullptr;  // substeps, 0 to twice as many as a step has
    const float* earlier = nullptr;  // steering and speed command of the last step and of the one before
                                     // it, (4, stride)
};

// Advances cars [begin, begin + count), count in 1..kLanes, by substeps [first, last) of the `substeps` of a
// control step.
#define RC_DECLARE(isa)                                                                              \
    namespace isa {                                                                                  \
    void advance_vehicles(const VehicleArrays& arrays, size_t begin, int count, int first, int last, \
                          int substeps);                                                             \
    }
RC_FOR_EACH_ISA(RC_DECLARE)
#undef RC_DECLARE

}  // namespace racecraft
