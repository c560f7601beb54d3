// A scan of the LIDAR, compiled once per instruction set.
#pragma once

#include "dispatch.hpp"
#include "racecraft/lidar.hpp"

namespace racecraft {

// Distances of all rays into out (kLidarRays,), m.
#define RC_DECLARE(isa)                                                                                \
    namespace isa {                                                                                    \
    void scan_lidar(const Room& room, const LidarPose& pose, const ObjectsAround& around, float* out); \
    }
RC_FOR_EACH_ISA(RC_DECLARE)
#undef RC_DECLARE

}  // namespace racecraft
