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

// One ray of a scan, noise included, as native/src/lidar_kernel.cpp measures all of them at once.
RC_HD float measure_ray(const Room& room, const LidarPose& pose, const ObjectsAround& around, int32_t ray) {
    float ray_sine, ray_cosine;
    sincos_of(lidar_angle(ray), ray_sine, ray_cosine);
    const float x = pose.x + kLidarForward * pose.cosine;
    const float y = pose.y + kLidarForward * pose.sine;
    const float dx = pose.cosine * ray_cosine - pose.sine * ray_sine;
    const float dy = pose.sine * ray_cosine + pose.cosine * ray_sine;
    float distance = distance_to_walls(room, x, y, dx, dy);
    for (int32_t k = 0; k < around.count; ++k) {
        const ObjectState& object = object_at(around, k);
        if (!is_there(object)) continue;
        const float from_x = x - object.x;
        const float from_y = y - object.y;
        const float half_x = half_length(object.kind);
        const float half_y = half_width(object.kind);
        const float reach = kLidarFarthest + half_x + half_y;
        if (from_x * from_x + from_y * from_y > reach * reach) continue;
        const float hit = distance_to_rectangle(half_x, half_y, from_x * object.cosine + from_y * object.sine,
                                                from_y * object.cosine - from_x * object.sine,
                                                dx * object.cosine + dy * object.sine,
                                                dy * object.cosine - dx * object.sine);
        distance = min_of(distance, hit);
    }
    // Normal numbers by Box and Muller's method: two rays share two uniform ones.
    constexpr int32_t pairs = kLidarRays / 2;
    constexpr int32_t blocks = kLidarRays / 4;
    const int32_t pair = ray % pairs;
    const uint32_t number = pose.step * blocks + static_cast<uint32_t>(pair / 2);
    const RandomBlock random = philox(pose.seed, pose.stream, pose.episode, number, Purpose::lidar_noise);
    const bool is_first = pair % 2 == 0;
    const float radius = uniform_of(is_first ? random.words[0] : random.words[2]) + 1.0f / 16777216.0f;
    float sine, cosine;
    sincos_of(kPi * symmetric_of(is_first ? random.words[1] : random.words[3]), sine, cosine);
    const float length = kLidarNoise * sqrt_of(-2.0f * log_of(radius));
    const float measured = distance + length * (ray < pairs ? cosine : sine);
    return distance < kLidarFarthest ? clamp(measured, kLidarNearest, kLidarFarthest) : kLidarFarthest;
}

}  // namespace racecraft
