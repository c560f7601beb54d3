// A scan: the vector code against one ray after the other, and its noise.
#include <algorithm>
#include <numbers>
#include <vector>

#include "check.hpp"
#include "lidar_kernel.hpp"

namespace racecraft {
namespace {

constexpr Room kSmall{-0.5f, -0.6f, 0.6f, 0.5f};  // walls so near that a distance keeps all bits of its noise
constexpr ObjectsAround kNothing{nullptr, 0, 0, 0};

LidarPose pose_in(uint32_t step, float heading = 0.0f) {
    LidarPose pose{.x = 0.02f,
                   .y = -0.03f,
                   .sine = 0.0f,
                   .cosine = 1.0f,
                   .seed = 11,
                   .stream = 4,
                   .episode = 2,
                   .step = step};
    sincos_of(heading, pose.sine, pose.cosine);
    return pose;
}

// Of the rays without their noise, by the angles of the car's plan.
std::vector<double> distances(const LidarPose& pose, const Room& room) {
    std::vector<double> found;
    for (int32_t ray = 0; ray < kLidarRays; ++ray) {
        const double angle =
            std::numbers::pi - 2.61799 + ray * 2.0 * 2.61799 / 63.0;  // 300 degrees about straight back
        const double dx = pose.cosine * std::cos(angle) - pose.sine * std::sin(angle);
        const double dy = pose.sine * std::cos(angle) + pose.cosine * std::sin(angle);
        const double x = pose.x + 0.02913 * pose.cosine, y = pose.y + 0.02913 * pose.sine;
        found.push_back(std::fmin(((dx < 0.0 ? room.min_x : room.max_x) - x) / dx,
                                  ((dy < 0.0 ? room.min_y : room.max_y) - y) / dy));
    }
    return found;
}

std::vector<float> scan(const LidarPose& pose, const Room& room = kSmall,
                        const ObjectsAround& around = kNothing) {
    std::vector<float> rays(kLidarRays);
    RC_DISPATCH(scan_lidar, room, pose, around, rays.data());
    return rays;
}

std::vector<double> noise_of(uint32_t step) {
    const LidarPose pose = pose_in(step);
    const std::vector<float> measured = scan(pose);
    std::vector<double> noise = distances(pose, kSmall);
    for (size_t i = 0; i < noise.size(); ++i) noise[i] = measured[i] - noise[i];
    return noise;
}

std::vector<ObjectState> some_objects() {
    std::vector<ObjectState> objects;
    for (int i = 0; i < 6; ++i) {
        ObjectState object{};
        object.kind = static_cast<ObjectKind>(i);
        object.x = 2.5f * static_cast<float>(std::cos(i + 0.3));
        object.y = 2.0f * static_cast<float>(std::sin(i + 0.3));
        object.heading = 0.7f * static_cast<float>(i);
        sincos_of(object.heading, object.sine, object.cosine);
        objects.push_back(object);
    }
    return objects;
}

}  // namespace

TEST(rays_end_at_the_walls_give_or_take_their_noise) {
    Room room{-3.0f, -2.0f, 4.0f, 5.0f};
    for (int turn = 0; turn < 20; ++turn) {
        const LidarPose pose = pose_in(static_cast<uint32_t>(turn), 0.3f * static_cast<float>(turn));
        const std::vector<float> measured = scan(pose, room);
        const std::vector<double> expected = distances(pose, room);
        double bias = 0.0;
        for (size_t i = 0; i < kLidarRays; ++i) {
            CHECK_NEAR(measured[i], expected[i], 0.06);
            bias += (measured[i] - expected[i]) / kLidarRays;
        }
        CHECK_NEAR(bias, 0.0, 0.006);
    }
}

TEST(what_is_near_or_far_is_reported_at_the_bounds) {
    for (const float ray : scan(pose_in(1), {-0.01f, -0.09f, 0.1f, 0.03f})) {
        CHECK_EQUAL(ray, kLidarNearest);
    }
    for (const float ray : scan(pose_in(1), {-100.0f, -100.0f, 100.0f, 100.0f})) {
        CHECK_EQUAL(ray, kLidarFarthest);
    }
    for (const float ray : scan(pose_in(1), {-11.99f, -11.99f, 11.99f, 11.99f})) CHECK(ray <= kLidarFarthest);
}

TEST(noise_is_normal) {
    double mean = 0.0, square = 0.0, fourth = 0.0;
    constexpr uint32_t kSteps = 1000;
    for (uint32_t step = 0; step < kSteps; ++step) {
        for (const double value : noise_of(step)) {
            mean += value / 0.01 / (kSteps * kLidarRays);
            square += std::pow(value / 0.01, 2) / (kSteps * kLidarRays);
            fourth += std::pow(value / 0.01, 4) / (kSteps * kLidarRays);
        }
    }
    CHECK_NEAR(mean, 0.0, 0.02);
    CHECK_NEAR(square, 1.0, 0.03);
    CHECK_NEAR(fourth, 3.0, 0.2);
}

TEST(no_draw_serves_two_rays_or_two_steps) {
    int repeated = 0;
    for (uint32_t step = 0; step < 40; ++step) {
        std::vector<double> both = noise_of(step);
        for (const double value : noise_of(step + 1)) both.push_back(value);
        std::sort(both.begin(), both.end());
        for (size_t i = 1; i < both.size(); ++i) repeated += both[i] - both[i - 1] < 5e-7;
    }
    // Some of them are that near each other by chance; a block of draws that serves twice makes 160 more.
    CHECK(repeated < 40);
}

TEST(seeds_cars_and_episodes_have_noise_of_their_own) {
    const std::vector<float> one = scan(pose_in(3));
    const auto differs = [&](auto change) {
        LidarPose pose = pose_in(3);
        change(pose);
        const std::vector<float> other = scan(pose);
        int equal = 0;
        for (size_t i = 0; i < one.size(); ++i) equal += one[i] == other[i];
        return equal < 3;
    };
    CHECK(differs([](LidarPose& pose) { pose.seed += 1; }));
    CHECK(differs([](LidarPose& pose) { pose.stream += 1; }));
    CHECK(differs([](LidarPose& pose) { pose.episode += 1; }));
    CHECK(differs([](LidarPose& pose) { pose.step += 1; }));
    CHECK(scan(pose_in(3)) == one);
}

TEST(one_ray_is_what_the_scan_says_of_it) {
    const Room room{-4.0f, -3.5f, 15.0f, 3.0f};
    const std::vector<ObjectState> objects = some_objects();
    const std::string best = isa_name(current_isa());
    for (const Isa isa : available_isas()) {
        set_isa(isa_name(isa));
        for (const ObjectsAround& around :
             {kNothing, ObjectsAround{objects.data(), 6, 6, 6}, ObjectsAround{objects.data(), 5, 2, 3}}) {
            for (uint32_t step = 0; step < 30; ++step) {
                LidarPose pose = pose_in(step, 0.37f * static_cast<float>(step));
                pose.x = 0.3f * static_cast<float>(step % 7) - 1.0f;
                const std::vector<float> all = scan(pose, room, around);
                for (int32_t ray = 0; ray < kLidarRays; ++ray) {
                    CHECK(
                        test::same_bits(measure_ray(room, pose, around, ray), all[static_cast<size_t>(ray)]));
                }
            }
        }
    }
    set_isa(best);
}

TEST(who_is_gone_is_not_measured) {
    std::vector<ObjectState> objects = some_objects();
    const Room room{-8.0f, -8.0f, 8.0f, 8.0f};
    const LidarPose pose = pose_in(1);
    const std::vector<float> bare = scan(pose, room);
    for (ObjectState& object : objects) {
        object.x = object.y = -1.0f;
        const std::vector<float> seen = scan(pose, room, {&object, 1, 1, 1});
        int nearer = 0;
        for (size_t i = 0; i < seen.size(); ++i) nearer += seen[i] < bare[i] - 0.5f;
        CHECK((nearer > 0) == (object.kind != ObjectKind::gone_racer));
    }
}

}  // namespace racecraft
