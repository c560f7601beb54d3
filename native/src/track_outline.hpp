// A track's lines as they come from Python; what the rules' geometry and the ground map are built from.
#pragma once

#include <cstddef>

namespace racecraft {

struct TrackOutline {
    size_t num_waypoints;      // W
    bool is_closed;            // first and last row are then equal
    const double* centerline;  // m, x and y interleaved   (W, 2)
    const double* inner;       // m                        (W, 2)
    const double* outer;       // m                        (W, 2)
};

}  // namespace racecraft
