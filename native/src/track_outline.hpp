// A track's lines as they come from Python; what the rules' geometry and the ground map are built from.
#pragma once

namespace racecraft {

// Each line is (count, 2) row-major, metres. A closed track may repeat its first point at the end.
struct TrackOutline {
    const double* center;
    const double* inner;
    const double* outer;
    int count;
    bool is_closed;
};

}  // namespace racecraft
