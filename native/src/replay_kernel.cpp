#include "replay_kernel.hpp"

namespace racecraft::RC_ISA {
namespace {

constexpr int kLanes = kReplayLanes;

struct Lanes {
    float x[kLanes], y[kLanes], heading[kLanes], speed[kLanes], lateral_speed[kLanes], yaw_rate[kLanes],
        steering[kLanes];
};

}  // namespace

void replay_windows(const VehicleParameters& car, const ReplayLog& log, const ReplayWindows& windows,
                    size_t begin, int count, double* out) {
    const VehicleConstants constants = vehicle_constants(car);
    alignas(64) Lanes lanes;
    alignas(64) float steering_command[kLanes], speed_command[kLanes], sim_dt[kLanes];
    double origin_x[kLanes], origin_y[kLanes];  // lanes are relative to their window's first pose
    size_t first[kLanes];                       // unused lanes repeat the last window and are not stored
    for (int i = 0; i < kLanes; ++i) {
        first[i] = static_cast<size_t>(windows.first[begin + static_cast<size_t>(i < count ? i : count - 1)]);
        const double* pose = log.poses + 3 * first[i];
        origin_x[i] = pose[0];
        origin_y[i] = pose[1];
        float sine, cosine;
        sincos_of(static_cast<float>(pose[2]), sine, cosine);
        const float rate = 1.0f / log.durations[first[i]];
        const float dx = static_cast<float>(pose[3] - pose[0]) * rate;
        const float dy = static_cast<float>(pose[4] - pose[1]) * rate;
        lanes.x[i] = static_cast<float>(pose[3] - pose[0]);
        lanes.y[i] = static_cast<float>(pose[4] - pose[1]);
        lanes.heading[i] = static_cast<float>(pose[5]);
        lanes.speed[i] = max_of(dx * cosine + dy * sine, 0.0f);
        lanes.lateral_speed[i] = dy * cosine - dx * sine;
        lanes.yaw_rate[i] = wrap_angle(static_cast<float>(pose[5] - pose[2])) * rate;
        lanes.steering[i] = log.commands[2 * first[i]];
    }

    for (int step = 1; step < windows.known + windows.free - 1; ++step) {
        float before[kLanes];
        for (int i = 0; i < kLanes; ++i) {
            const size_t row = first[i] + static_cast<size_t>(step);
            before[i] = lanes.heading[i];
            steering_command[i] = log.commands[2 * row];
            speed_command[i] = log.commands[2 * row + 1];
            sim_dt[i] = log.durations[row] / static_cast<float>(windows.substeps);
        }
        for (int substep = 0; substep < windows.substeps; ++substep) {
#pragma GCC ivdep
            for (int i = 0; i < kLanes; ++i) {
                const VehicleState state{lanes.x[i],
                                         lanes.y[i],
                                         lanes.heading[i],
                                         lanes.speed[i],
                                         lanes.lateral_speed[i],
                                         lanes.yaw_rate[i],
                                         lanes.steering[i]};
                const VehicleState next =
                    vehicle_substep(constants, state, steering_command[i], speed_command[i], sim_dt[i]);
                lanes.x[i] = next.x;
                lanes.y[i] = next.y;
                lanes.heading[i] = next.heading;
                lanes.speed[i] = next.speed;
                lanes.lateral_speed[i] = next.lateral_speed;
                lanes.yaw_rate[i] = next.yaw_rate;
                lanes.steering[i] = next.steering;
            }
        }
        if (step >= windows.known - 1) {
            for (int i = 0; i < count; ++i) {
                const size_t window = begin + static_cast<size_t>(i);
                double* pose = out + 3 * (window * static_cast<size_t>(windows.free) +
                                          static_cast<size_t>(step - windows.known + 1));
                pose[0] = origin_x[i] + static_cast<double>(lanes.x[i]);
                pose[1] = origin_y[i] + static_cast<double>(lanes.y[i]);
                pose[2] = static_cast<double>(lanes.heading[i]);
            }
            continue;
        }
        for (int i = 0; i < kLanes; ++i) {
            const size_t row = first[i] + static_cast<size_t>(step);
            const double* pose = log.poses + 3 * (row + 1);
            const float x = static_cast<float>(pose[0] - origin_x[i]);
            const float y = static_cast<float>(pose[1] - origin_y[i]);
            const float rate = 1.0f / log.durations[row];
            const float dx = (x - lanes.x[i]) * rate;
            const float dy = (y - lanes.y[i]) * rate;
            const float turn = wrap_angle(static_cast<float>(pose[2]) - lanes.heading[i]) * rate;
            float sine, cosine;
            sincos_of(before[i], sine, cosine);
            lanes.speed[i] = max_of(lanes.speed[i] + kForwardCorrection * (dx * cosine + dy * sine), 0.0f);
            lanes.lateral_speed[i] += kLateralCorrection * (dy * cosine - dx * sine);
            lanes.yaw_rate[i] += kYawCorrection * turn;
            lanes.x[i] = x;
            lanes.y[i] = y;
            lanes.heading[i] = static_cast<float>(pose[2]);
        }
    }
}

}  // namespace racecraft::RC_ISA
