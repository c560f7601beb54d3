#include "vehicle_kernel.hpp"

#include <algorithm>

namespace racecraft::RC_ISA {
namespace {

struct Lanes {
    float x[kLanes], y[kLanes], heading[kLanes], speed[kLanes], lateral_speed[kLanes], yaw_rate[kLanes],
        steering[kLanes];
};

struct ConstantLanes {
#define RC_FIELD(name) float name[kLanes];
    RC_VEHICLE_CONSTANTS(RC_FIELD)
#undef RC_FIELD
};

}  // namespace

void advance_vehicles(const VehicleArrays& arrays, size_t begin, int count, int first, int last,
                      int substeps) {
    const float sim_dt = kControlDt / static_cast<float>(substeps);
    alignas(64) Lanes lanes;
    alignas(64) ConstantLanes constants;
    alignas(64) float steering_command[kLanes];
    alignas(64) float speed_command[kLanes];
    alignas(64) float earlier[4][kLanes];
    alignas(64) int32_t delay[kLanes];
    const auto load = [&](auto car_of) {
        for (int i = 0; i < kLanes; ++i) {
            const size_t car = car_of(i);
            lanes.x[i] = arrays.x[car];
            lanes.y[i] = arrays.y[car];
            lanes.heading[i] = arrays.heading[car];
            lanes.speed[i] = arrays.speed[car];
            lanes.lateral_speed[i] = arrays.lateral_speed[car];
            lanes.yaw_rate[i] = arrays.yaw_rate[car];
            lanes.steering[i] = arrays.steering[car];
            steering_command[i] = arrays.steering_command[car];
            speed_command[i] = arrays.speed_command[car];
#define RC_LOAD(name) arrays.parameters[kVehicle_##name * arrays.stride + car],
            const VehicleConstants c = vehicle_constants({RC_VEHICLE_PARAMETERS(RC_LOAD)});
#undef RC_LOAD
#define RC_STORE(name) constants.name[i] = c.name;
            RC_VEHICLE_CONSTANTS(RC_STORE)
#undef RC_STORE
        }
        for (int i = 0; i < kLanes; ++i) {
            const size_t car = car_of(i);
            delay[i] = arrays.delay != nullptr ? arrays.delay[car] : 0;
            for (size_t k = 0; k < 4; ++k) {
                earlier[k][i] = arrays.earlier != nullptr ? arrays.earlier[k * arrays.stride + car] : 0.0f;
            }
        }
    };
    const size_t last_car = begin + static_cast<size_t>(count) - 1;
    if (count == kLanes) {
        load([&](int i) { return begin + static_cast<size_t>(i); });  // in a row: vector code
    } else {  // unused lanes repeat the last car and are not stored
        load([&](int i) { return std::min(begin + static_cast<size_t>(i), last_car); });
    }

    for (int substep = first; substep < last; ++substep) {
#pragma GCC ivdep
        for (int i = 0; i < kLanes; ++i) {
#define RC_LOAD(name) constants.name[i],
            const VehicleConstants c{RC_VEHICLE_CONSTANTS(RC_LOAD)};
#undef RC_LOAD
            const VehicleState state{
                lanes.x[i],        lanes.y[i],       lanes.heading[i], lanes.speed[i], lanes.lateral_speed[i],
                lanes.yaw_rate[i], lanes.steering[i]};
            const float steering = acting_command(substep, substeps, delay[i], steering_command[i],
                                                  earlier[0][i], earlier[2][i]);
            const float speed =
                acting_command(substep, substeps, delay[i], speed_command[i], earlier[1][i], earlier[3][i]);
            const VehicleState next = vehicle_substep(c, state, steering, speed, sim_dt);
            lanes.x[i] = next.x;
            lanes.y[i] = next.y;
            lanes.heading[i] = next.heading;
            lanes.speed[i] = next.speed;
            lanes.lateral_speed[i] = next.lateral_speed;
            lanes.yaw_rate[i] = next.yaw_rate;
            lanes.steering[i] = next.steering;
        }
    }

    for (int i = 0; i < count; ++i) {
        const size_t car = begin + static_cast<size_t>(i);
        if (arrays.is_moving[car] == 0.0f) continue;
        arrays.x[car] = lanes.x[i];
        arrays.y[car] = lanes.y[i];
        arrays.heading[car] = lanes.heading[i];
        arrays.speed[car] = lanes.speed[i];
        arrays.lateral_speed[car] = lanes.lateral_speed[i];
        arrays.yaw_rate[car] = lanes.yaw_rate[i];
        arrays.steering[car] = lanes.steering[i];
    }
}

}  // namespace racecraft::RC_ISA
