#include "lidar_kernel.hpp"

namespace racecraft::RC_ISA {
namespace {

struct RayTable {
    float sine[kLidarRays], cosine[kLidarRays];

    RayTable() {
        for (int32_t i = 0; i < kLidarRays; ++i) sincos_of(lidar_angle(i), sine[i], cosine[i]);
    }
};

// Normal numbers by Box and Muller's method: two from two uniform ones.
void draw_noise(const LidarPose& pose, float* noise) {
    constexpr int32_t kPairs = kLidarRays / 2;
    constexpr int32_t kBlocks = kLidarRays / 4;
    float radius[kPairs];
    float angle[kPairs];
    for (int32_t k = 0; k < kBlocks; ++k) {
        const uint32_t number = pose.step * kBlocks + static_cast<uint32_t>(k);
        const RandomBlock random = philox(pose.seed, pose.stream, pose.episode, number, Purpose::lidar_noise);
        for (int32_t i = 0; i < 2; ++i) {
            radius[2 * k + i] = uniform_of(random.words[2 * i]) + 1.0f / 16777216.0f;  // (0, 1]
            angle[2 * k + i] = kPi * symmetric_of(random.words[2 * i + 1]);
        }
    }
#pragma GCC ivdep
    for (int32_t i = 0; i < kPairs; ++i) {
        float sine, cosine;
        sincos_of(angle[i], sine, cosine);
        const float length = kLidarNoise * sqrt_of(-2.0f * log_of(radius[i]));
        noise[i] = length * cosine;
        noise[kPairs + i] = length * sine;
    }
}

}  // namespace

void scan_lidar(const Room& room, const LidarPose& pose, const ObjectsAround& around, float* out) {
    static const RayTable rays;
    const float x = pose.x + kLidarForward * pose.cosine;
    const float y = pose.y + kLidarForward * pose.sine;
    float dx[kLidarRays], dy[kLidarRays], distance[kLidarRays], noise[kLidarRays];
#pragma GCC ivdep
    for (int32_t i = 0; i < kLidarRays; ++i) {
        dx[i] = pose.cosine * rays.cosine[i] - pose.sine * rays.sine[i];
        dy[i] = pose.sine * rays.cosine[i] + pose.cosine * rays.sine[i];
        distance[i] = distance_to_walls(room, x, y, dx[i], dy[i]);
    }
    for (int32_t k = 0; k < around.count; ++k) {
        const ObjectState& object = object_at(around, k);
        if (!is_there(object)) continue;
        const float from_x = x - object.x;
        const float from_y = y - object.y;
        const float half_x = half_length(object.kind);
        const float half_y = half_width(object.kind);
        const float reach = kLidarFarthest + half_x + half_y;
        if (from_x * from_x + from_y * from_y > reach * reach) continue;
        const float sine = object.sine;
        const float cosine = object.cosine;
        const float ox = from_x * cosine + from_y * sine;
        const float oy = from_y * cosine - from_x * sine;
#pragma GCC ivdep
        for (int32_t i = 0; i < kLidarRays; ++i) {
            const float hit = distance_to_rectangle(half_x, half_y, ox, oy, dx[i] * cosine + dy[i] * sine,
                                                    dy[i] * cosine - dx[i] * sine);
            distance[i] = min_of(distance[i], hit);
        }
    }
    draw_noise(pose, noise);
#pragma GCC ivdep
    for (int32_t i = 0; i < kLidarRays; ++i) {
        const float measured = distance[i] + noise[i];
        out[i] =
            distance[i] < kLidarFarthest ? clamp(measured, kLidarNearest, kLidarFarthest) : kLidarFarthest;
    }
}

}  // namespace racecraft::RC_ISA
