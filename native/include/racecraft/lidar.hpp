// The scanner on the car's roof: 64 rays over 300 degrees in a plane, looking backwards.
//
//               front
//        ray 0 \       / ray 63      The gap of 60 degrees that the camera looks into is the only one. Rays
//        go
//                \ ^ /                counter-clockwise: over the left side, behind the car, over the right
//                side.
//        left  --- o ---  right
//                / | \                A ray ends at a wall of the room, a box or a car, whichever is nearest.
//               behind
#pragma once

#include "racecraft/objects.hpp"

namespace racecraft {

constexpr int32_t kLidarRays = 64;
constexpr float kLidarForward = 0.02913f;    // m ahead of the car's origin
constexpr float kLidarHalfAngle = 2.61799f;  // rad to either side of straight back
constexpr float kLidarNearest = 0.15f;       // m; nothing is reported nearer
constexpr float kLidarFarthest = 12.0f;      // m; reported where there is nothing
constexpr float kLidarNoise = 0.01f;         // m, standard deviation

// Angle of a ray against the car's heading, rad, counter-clockwise.
RC_HD float lidar_angle(int32_t ray) {
    return kPi - kLidarHalfAngle + static_cast<float>(ray) * (2.0f * kLidarHalfAngle / (kLidarRays - 1));
}

// Where a scan is made from, and what it draws its noise by.
struct LidarPose {
    float x, y, sine, cosine;  // m, of the car's origin, and of its heading
    uint64_t seed;
    uint32_t stream, episode, step;
};

// m along a ray of unit length to the walls of the room, from inside it.
RC_HD float distance_to_walls(const Room& room, float x, float y, float dx, float dy) {
    constexpr float tiny = 1e-9f;
    const float wall_x = dx < 0.0f ? room.min_x : room.max_x;
    const float wall_y = dy < 0.0f ? room.min_y : room.max_y;
    const float to_x = (wall_x - x) / (abs_of(dx) < tiny ? tiny : dx);
    const float to_y = (wall_y - y) / (abs_of(dy) < tiny ? tiny : dy);
    return min_of(to_x, to_y);
}

// m along a ray to a rectangle about the origin, or kLidarFarthest; 0 from inside.
RC_HD float distance_to_rectangle(float half_length, float half_width, float x, float y, float dx, float dy) {
    constexpr float tiny = 1e-9f;
    const float inverse_x = 1.0f / (abs_of(dx) < tiny ? tiny : dx);
    const float inverse_y = 1.0f / (abs_of(dy) < tiny ? tiny : dy);
    const float x0 = (-half_length - x) * inverse_x;
    const float x1 = (half_length - x) * inverse_x;
    const float y0 = (-half_width - y) * inverse_y;
    const float y1 = (half_width - y) * inverse_y;
    const float enter = max_of(max_of(min_of(x0, x1), min_of(y0, y1)), 0.0f);
    const float leave = min_of(max_of(x0, x1), max_of(y0, y1));
    return enter <= leave ? enter : kLidarFarthest;
}

}  // namespace racecraft
