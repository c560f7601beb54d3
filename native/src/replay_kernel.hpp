// Drives a car open loop through windows of a log: some rows tell the model how the car moved, then it is on
// its own with the log's commands and durations.
//
//     row        first  ...  first + known - 1 | first + known  ...  first + known + free - 1
//     pose        observed by the model        |  predicted, to be compared with the log's
//
// While rows are known the model predicts each next pose as well; what it missed by corrects its speeds (an
// observer with fixed gains), and the pose itself is taken from the log.
#pragma once

#include "dispatch.hpp"
#include "racecraft/vehicle.hpp"

namespace racecraft {

constexpr int kReplayLanes = 16;  // windows that a kernel drives together; fewer may be asked for

// Shares of the observed error, over the step's duration, that correct each speed.
constexpr float kForwardCorrection = 0.25f;
constexpr float kLateralCorrection = 0.9f;
constexpr float kYawCorrection = 0.9f;

struct ReplayLog {
    const double* poses;     // m, m and rad of the car's origin               (R, 3)
    const float* commands;   // rad and m/s, acting from a row to the next     (R, 2)
    const float* durations;  // s, from a row to the next                      (R,)
};

struct ReplayWindows {
    const int64_t* first;  // row where a window begins
    int known;             // rows whose poses are given, at least 2
    int free;              // rows predicted after them
    int substeps;          // of every row
};

// Poses predicted for windows [begin, begin + count), count in 1..kReplayLanes, into out (windows, free, 3).
#define RC_DECLARE(isa)                                                                                   \
    namespace isa {                                                                                       \
    void replay_windows(const VehicleParameters& car, const ReplayLog& log, const ReplayWindows& windows, \
                        size_t begin, int count, double* out);                                            \
    }
RC_FOR_EACH_ISA(RC_DECLARE)
#undef RC_DECLARE

}  // namespace racecraft
