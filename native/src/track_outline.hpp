// A track's lines as they come from Python; what the rules' geometry and the ground map are built from.
#pragma once

#include <cstdint>

namespace racecraft {

// Each line is (count, 2) row-major, metres. A closed track may repeat its first point at the end.
struct TrackOutline {
    const double* center;
    const double* inner;
    const double* outer;
    int count;
    bool is_closed;
    // Index of the waypoint that each segment starts at, (count - 1,): routes may name a point twice in a
    // row, which is no segment but counts. Null where none does.
    const int32_t* waypoints = nullptr;
};

}  // namespace racecraft
