// Judges the poses of a log by the very rules that judge a training.
#pragma once

#include <cstddef>

#include "racecraft/rules.hpp"

namespace racecraft {

// One logged row. x and y are of the reference point, 0.14 m ahead of the car's origin.
struct LoggedRow {
    double x, y, heading;  // m, m, rad
    double steering_angle, speed;
    double progress;   // fraction of a lap, read in the first row of an episode: it tells where the lap began
    double is_first;   // 1 in the first row of an episode
    double is_paused;  // 1 while the car stands for a penalty
};

// Writes a row of the simulation, (kNumRowColumns,) each, for every logged one. An episode goes on as long as
// the log does; laps flow.
void judge_log(const TrackGeometry& track, bool is_reversed, const LoggedRow* log, size_t count,
               double* rows);

}  // namespace racecraft
