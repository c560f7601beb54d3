// The car: what physics forbids, what symmetry demands, and every corner of the parameters' allowed range.
#include "racecraft/vehicle.hpp"

#include <algorithm>
#include <iterator>
#include <numbers>
#include <random>
#include <string>

#include "check.hpp"
#include "vehicle_kernel.hpp"

namespace racecraft {
namespace {

constexpr int kSubsteps = 8;
constexpr float kSimDt = kControlDt / kSubsteps;

// The default car of racecraft.sim.vehicle.
VehicleParameters default_car() {
    return {.mass = 7.5f,
            .yaw_inertia = 0.116f,
            .front_axle = 0.117f,
            .rear_axle = 0.0767f,
            .half_track = 0.08f,
            .front_load = 0.387f,
            .front_friction = 0.32f,
            .rear_friction = 0.494f,
            .front_stiffness = 7.92f,
            .rear_stiffness = 12.0f,
            .slip_speed = 0.5f,
            .drive_acceleration = 3.39f,
            .brake_acceleration = 4.05f,
            .speed_time_constant = 0.123f,
            .steering_time_constant = 0.02f,
            .steering_rate = 40.0f,
            .steering_bias = 0.0252f,
            .speed_gain = 1.041f};
}

// The same without what makes it pull to one side or miss its speed.
VehicleParameters true_car() {
    VehicleParameters car = default_car();
    car.steering_bias = 0.0f;
    car.speed_gain = 1.0f;
    return car;
}

VehicleState drive(const VehicleParameters& parameters, VehicleState state, float steering, float speed,
                   int substeps, float sim_dt = kSimDt) {
    const VehicleConstants constants = vehicle_constants(parameters);
    for (int i = 0; i < substeps; ++i) state = vehicle_substep(constants, state, steering, speed, sim_dt);
    return state;
}

// Any state that a car of up to 4 m/s may be in, and worse.
VehicleState random_state(std::mt19937& random) {
    std::uniform_real_distribution<float> u(-1.0f, 1.0f);
    return {.x = 10.0f * u(random),
            .y = 10.0f * u(random),
            .heading = 3.1f * u(random),
            .speed = 2.0f + 2.0f * u(random),
            .lateral_speed = 2.0f * u(random),
            .yaw_rate = 6.0f * u(random),
            .steering = kMaxSteering * u(random)};
}

// Energy of movement over mass, m^2/s^2.
double energy(const VehicleParameters& p, const VehicleState& s) {
    const double gyration = static_cast<double>(p.yaw_inertia) / static_cast<double>(p.mass);
    const double u = s.speed, v = s.lateral_speed, r = s.yaw_rate;
    return 0.5 * (u * u + v * v + gyration * r * r);
}

}  // namespace

TEST(a_standing_car_stays_where_it_is) {
    for (const float steering : {-kMaxSteering, 0.0f, kMaxSteering}) {
        const VehicleState start{.x = 1.25f,
                                 .y = -3.5f,
                                 .heading = 2.0f,
                                 .speed = 0.0f,
                                 .lateral_speed = 0.0f,
                                 .yaw_rate = 0.0f,
                                 .steering = 0.0f};
        const VehicleState end = drive(true_car(), start, steering, 0.0f, 1000);
        CHECK_EQUAL(end.x, start.x);
        CHECK_EQUAL(end.y, start.y);
        CHECK_EQUAL(end.heading, start.heading);
        CHECK_EQUAL(end.speed, 0.0f);
        CHECK_EQUAL(end.yaw_rate, 0.0f);
        CHECK_NEAR(end.steering, steering, 1e-5);
    }
}

TEST(a_coasting_car_never_gains_energy) {
    std::mt19937 random(1);
    for (int car = 0; car < 2000; ++car) {
        VehicleState state = random_state(random);
        const float steering = state.steering;
        for (int i = 0; i < 100; ++i) {
            const double before = energy(default_car(), state);
            state = drive(default_car(), state, steering, 0.0f, 1);
            CHECK(energy(default_car(), state) <= before * (1.0 + 1e-5) + 1e-9);
        }
    }
}

TEST(a_braked_car_comes_to_rest) {
    std::mt19937 random(2);
    for (int car = 0; car < 200; ++car) {
        const VehicleState end = drive(default_car(), random_state(random), 0.1f, 0.0f, 4 * 15 * kSubsteps);
        CHECK(end.speed >= 0.0f && end.speed < 1e-3f);
        CHECK_NEAR(end.lateral_speed, 0.0, 1e-3);
        CHECK_NEAR(end.yaw_rate, 0.0, 1e-3);
    }
}

TEST(on_a_straight_the_car_reaches_its_speed_and_no_more) {
    for (const float target : {0.1f, 1.0f, 2.5f, 4.0f}) {
        VehicleState state{};
        for (int i = 0; i < 8 * 15 * kSubsteps; ++i) {
            state = drive(true_car(), state, 0.0f, target, 1);
            CHECK(state.speed <= target * 1.00001f);
        }
        CHECK_NEAR(state.speed, target, 1e-4);
        CHECK_EQUAL(state.y, 0.0f);
        CHECK_EQUAL(state.heading, 0.0f);
    }
    VehicleParameters fast = true_car();
    fast.speed_gain = 1.1f;
    CHECK_NEAR(drive(fast, VehicleState{}, 0.0f, 2.0f, 8 * 15 * kSubsteps).speed, 2.2, 1e-4);
}

TEST(from_rest_the_drive_limit_is_the_acceleration) {
    const VehicleState state = drive(true_car(), VehicleState{}, 0.0f, 4.0f, 5 * kSubsteps);
    const double limit = 3.39 * 5.0 / 15.0;
    CHECK(static_cast<double>(state.speed) < limit);
    CHECK_NEAR(state.speed, limit, 0.02 * limit);
}

TEST(drive_and_brakes_give_no_more_than_three_times_the_slipperier_axle) {
    for (const bool is_front_slippery : {false, true}) {
        VehicleParameters car = true_car();
        car.front_friction = is_front_slippery ? 0.1f : 0.8f;
        car.rear_friction = is_front_slippery ? 0.8f : 0.1f;
        car.drive_acceleration = car.brake_acceleration = 30.0f;
        const double limit = 3.0 * 9.8 * 0.1;
        // Half a second from rest, and half a second of braking: the force is near its limit all along.
        const VehicleState driven = drive(car, VehicleState{}, 0.0f, 4.0f, 60);
        CHECK_NEAR(driven.speed, 0.5 * limit, 0.05 * limit);
        CHECK(driven.speed < 0.5 * limit);
        VehicleState fast{};
        fast.speed = 4.0f;
        const VehicleState braked = drive(car, fast, 0.0f, 0.0f, 60);
        CHECK_NEAR(4.0f - braked.speed, 0.5 * limit, 0.05 * limit);
        CHECK(4.0f - braked.speed < 0.5 * limit);
    }
}

TEST(drive_and_brakes_have_limits_of_their_own) {
    VehicleParameters car = true_car();
    car.front_friction = car.rear_friction = 1.0f;
    car.drive_acceleration = 2.0f;
    car.brake_acceleration = 5.0f;
    CHECK_NEAR(drive(car, VehicleState{}, 0.0f, 4.0f, 60).speed, 1.0, 0.02);
    VehicleState fast{};
    fast.speed = 4.0f;
    CHECK_NEAR(drive(car, fast, 0.0f, 0.0f, 60).speed, 1.5, 0.1);
}

TEST(a_heading_is_told_within_a_turn) {
    // Round and round to either side, for minutes: a heading that grew would lose bits.
    for (const float steering : {-0.4f, 0.4f}) {
        VehicleState state{};
        double turned = 0.0;
        for (int i = 0; i < 120 * 15 * kSubsteps; ++i) {
            const float before = state.heading;
            state = drive(true_car(), state, steering, 1.5f, 1);
            CHECK(std::abs(state.heading) <= kPi + 1e-6f);
            turned += std::remainder(static_cast<double>(state.heading) - before, 2.0 * std::numbers::pi);
        }
        CHECK(std::abs(turned) > 50.0);
        CHECK_NEAR(std::remainder(turned - static_cast<double>(state.heading), 2.0 * std::numbers::pi), 0.0,
                   1e-2);
    }
}

TEST(a_late_command_acts_from_its_substep_on_and_those_before_it_in_their_order) {
    const auto acting = [](int32_t delay) {
        std::string text;
        for (int32_t substep = 0; substep < 4; ++substep)
            text += static_cast<char>(acting_command(substep, 4, delay, 'n', 'b', 'e'));
        return text;
    };
    CHECK_EQUAL(acting(0), "nnnn");
    CHECK_EQUAL(acting(1), "bnnn");
    CHECK_EQUAL(acting(4), "bbbb");
    CHECK_EQUAL(acting(5), "ebbb");
    CHECK_EQUAL(acting(8), "eeee");
}

TEST(steering_follows_its_command_with_the_time_constant_and_the_rate) {
    VehicleParameters car = true_car();
    car.steering_time_constant = 0.15f;
    for (int step = 1; step <= 10; ++step) {
        const VehicleState state = drive(car, VehicleState{}, 0.5f, 0.0f, step * kSubsteps);
        CHECK_NEAR(state.steering, 0.5 * (1.0 - std::exp(-step / 15.0 / 0.15)), 1e-6);
    }
    car.steering_rate = 1.0f;
    CHECK_NEAR(drive(car, VehicleState{}, 0.5f, 0.0f, 3 * kSubsteps).steering, 3.0 / 15.0, 1e-6);
    car.steering_bias = 0.1f;
    CHECK_NEAR(drive(car, VehicleState{}, 0.2f, 0.0f, 600).steering, 0.3, 1e-5);
}

TEST(tyres_never_give_more_than_friction) {
    std::mt19937 random(3);
    std::uniform_real_distribution<float> u(0.0f, 1.0f);
    const VehicleParameters car = default_car();
    const VehicleConstants constants = vehicle_constants(car);
    double most = 0.0;
    for (int i = 0; i < 200000; ++i) {
        const VehicleState state = random_state(random);
        const VehicleRates rates =
            vehicle_rates(constants, state, kMaxSteering * (2.0f * u(random) - 1.0f), 4.0f * u(random));
        const double along =
            static_cast<double>(rates.speed) - static_cast<double>(state.yaw_rate * state.lateral_speed);
        const double across =
            static_cast<double>(rates.lateral_speed) + static_cast<double>(state.yaw_rate * state.speed);
        most = std::max(most, std::hypot(along, across));
    }
    // A box, not a circle: each axle may give both at once.
    const double g = static_cast<double>(kGravity);
    const double front = static_cast<double>(car.front_load * car.front_friction) * g;
    const double rear = static_cast<double>((1.0f - car.front_load) * car.rear_friction) * g;
    const double limit = std::hypot(front + rear, static_cast<double>(car.brake_acceleration));
    CHECK(most <= limit * 1.00001);
    CHECK(most > 0.9 * limit);
}

TEST(a_mirrored_car_is_the_mirror_image_to_the_bit) {
    std::mt19937 random(4);
    std::uniform_real_distribution<float> u(-1.0f, 1.0f);
    VehicleParameters car = default_car();
    VehicleParameters twin = car;
    car.steering_bias = 0.05f;
    twin.steering_bias = -0.05f;
    for (int trial = 0; trial < 200; ++trial) {
        VehicleState state = random_state(random);
        state.heading *= 3.0f;
        VehicleState image{state.x,         -state.y,       -state.heading, state.speed, -state.lateral_speed,
                           -state.yaw_rate, -state.steering};
        for (int step = 0; step < 60; ++step) {
            const float steering = kMaxSteering * u(random);
            const float speed = 2.0f + 2.0f * u(random);
            state = drive(car, state, steering, speed, kSubsteps);
            image = drive(twin, image, -steering, speed, kSubsteps);
            CHECK_EQUAL(image.x, state.x);
            CHECK_EQUAL(image.y, -state.y);
            CHECK_EQUAL(image.heading, -state.heading);
            CHECK_EQUAL(image.speed, state.speed);
            CHECK_EQUAL(image.lateral_speed, -state.lateral_speed);
            CHECK_EQUAL(image.yaw_rate, -state.yaw_rate);
            CHECK_EQUAL(image.steering, -state.steering);
        }
    }
}

TEST(halving_the_substeps_converges_at_fourth_order) {
    // A smooth manoeuvre, no limit touched; few steps, so that single precision does not hide the order.
    VehicleParameters car = true_car();
    car.speed_time_constant = 1.0f;
    car.steering_time_constant = 0.4f;
    car.drive_acceleration = car.brake_acceleration;  // no kink where driving turns into braking
    car.front_stiffness = 1.0f;
    car.rear_stiffness = 1.5f;
    car.slip_speed = 1.0f;
    const VehicleState start{.x = 0.0f,
                             .y = 0.0f,
                             .heading = 0.0f,
                             .speed = 2.0f,
                             .lateral_speed = 0.0f,
                             .yaw_rate = 0.0f,
                             .steering = 0.0f};
    const auto at_end = [&](int steps) {
        return drive(car, start, 0.3f, 2.2f, steps, 1.0f / static_cast<float>(steps));
    };
    const auto error = [](const VehicleState& a, const VehicleState& b) {
        return std::hypot(a.x - b.x, a.y - b.y, a.heading - b.heading) + std::abs(a.yaw_rate - b.yaw_rate);
    };
    const VehicleState exact = at_end(64);
    const double coarse = static_cast<double>(error(at_end(10), exact));
    const double fine = static_cast<double>(error(at_end(20), exact));
    const double order = std::log2(coarse / fine);
    std::printf("       errors %.3g and %.3g, order %.2f\n", coarse, fine, order);
    CHECK(order > 3.5 && order < 4.5);
}

TEST(the_default_substeps_are_fine_enough) {
    std::mt19937 random(5);
    std::uniform_real_distribution<float> u(-1.0f, 1.0f);
    for (int trial = 0; trial < 100; ++trial) {
        VehicleState coarse{};
        coarse.speed = 2.0f;
        VehicleState fine = coarse;
        for (int step = 0; step < 15; ++step) {
            const float steering = 0.35f * u(random);
            coarse = drive(default_car(), coarse, steering, 2.0f, kSubsteps);
            fine = drive(default_car(), fine, steering, 2.0f, 8 * kSubsteps, kSimDt / 8.0f);
        }
        CHECK_NEAR(coarse.x, fine.x, 2e-3);
        CHECK_NEAR(coarse.y, fine.y, 2e-3);
        CHECK_NEAR(coarse.heading, fine.heading, 2e-3);
    }
}

TEST(mass_matters_only_beside_the_inertia) {
    VehicleParameters heavy = default_car();
    heavy.mass *= 16.0f;
    heavy.yaw_inertia *= 16.0f;
    const VehicleState a = drive(default_car(), VehicleState{}, 0.3f, 3.0f, 200);
    const VehicleState b = drive(heavy, VehicleState{}, 0.3f, 3.0f, 200);
    CHECK(test::same_bits(a, b));
}

// LIMITS, MIN_INERTIA_RATIO and LEAST_REACH of racecraft.sim.vehicle; tests/sim/test_vehicle.py holds them
// equal.
struct Range {
    const char* name;
    float low, high;
};
constexpr Range kLimits[] = {
    {"mass", 0.1f, 1000.0f},
    {"yaw_inertia", 0.0001f, 10000.0f},
    {"front_axle", 0.02f, 2.0f},
    {"rear_axle", 0.02f, 2.0f},
    {"half_track", 0.0f, 1.0f},
    {"front_load", 0.1f, 0.9f},
    {"front_friction", 0.05f, 3.0f},
    {"rear_friction", 0.05f, 3.0f},
    {"front_stiffness", 0.5f, 20.0f},
    {"rear_stiffness", 0.5f, 20.0f},
    {"slip_speed", 0.3f, 5.0f},
    {"drive_acceleration", 0.1f, 30.0f},
    {"brake_acceleration", 0.1f, 30.0f},
    {"speed_time_constant", 0.025f, 10.0f},
    {"steering_time_constant", 0.015f, 10.0f},
    {"steering_rate", 0.1f, 100.0f},
    {"steering_bias", -0.3f, 0.3f},
    {"speed_gain", 0.1f, 1.5f},
};
constexpr float kMinInertiaRatio = 0.25f;
constexpr float kLeastReach = 0.1f;
static_assert(std::size(kLimits) == kNumVehicleParameters);

// Cars at corners of the allowed range, number `corner` being a bit per parameter, drive at full lock, 4 m/s,
// with the lock reversed and the brakes on now and then. Returns the highest speed of any.
double drive_corners(const std::vector<uint32_t>& corners, int steps, int substeps) {
    const size_t n = corners.size();
    std::vector<float> fields(7 * n, 0.0f), parameters(kNumVehicleParameters * n);
    std::vector<float> steering(n, kMaxSteering), speed(n, kMaxSpeedCommand), is_moving(n, 1.0f);
    for (size_t car = 0; car < n; ++car) {
        for (size_t k = 0; k < kNumVehicleParameters; ++k) {
            parameters[k * n + car] = (corners[car] >> k) & 1u ? kLimits[k].high : kLimits[k].low;
        }
        const auto value = [&](size_t k) -> float& { return parameters[k * n + car]; };
        const float axle = max_of(value(kVehicle_front_axle), value(kVehicle_rear_axle));
        const float reach =
            axle * axle + value(kVehicle_half_track) * value(kVehicle_half_track) + kLeastReach * kLeastReach;
        value(kVehicle_yaw_inertia) =
            max_of(value(kVehicle_yaw_inertia), kMinInertiaRatio * value(kVehicle_mass) * reach);
        fields[3 * n + car] = kMaxSpeedCommand;
    }
    float* f = fields.data();
    const VehicleArrays arrays{
        f,         f + n,           f + 2 * n,    f + 3 * n,        f + 4 * n,         f + 5 * n,
        f + 6 * n, steering.data(), speed.data(), is_moving.data(), parameters.data(), n};
    double fastest = 0.0;
    for (int step = 0; step < steps; ++step) {
        if (step % 40 == 25) {
            for (float& command : steering) command = -command;
        }
        if (step % 150 == 90) speed.assign(n, step % 300 == 90 ? 0.0f : kMaxSpeedCommand);
        for (size_t begin = 0; begin < n; begin += kLanes) {
            const int count = static_cast<int>(std::min(n - begin, size_t{kLanes}));
            RC_DISPATCH(advance_vehicles, arrays, begin, count, 0, substeps, substeps);
        }
        for (size_t car = 0; car < n; ++car) {
            const double total =
                std::hypot(static_cast<double>(f[3 * n + car]), static_cast<double>(f[4 * n + car]));
            // A NaN must not get lost in max().
            fastest = total <= fastest ? fastest : total;
        }
    }
    for (const float value : fields) CHECK(std::isfinite(value));
    return fastest;
}

TEST(every_corner_of_the_parameters_stays_finite) {
    // Of two parameters one end will do: mass acts only through the inertia, and a lower gain is a lower
    // speed.
    constexpr uint32_t kFixed = 1u << kVehicle_mass | 1u << kVehicle_speed_gain;
    std::vector<uint32_t> all;
    for (uint32_t corner = 0; corner < 1u << kNumVehicleParameters; corner += test::kStride) {
        if ((corner & kFixed) == 1u << kVehicle_speed_gain) all.push_back(corner);
    }
    for (const int substeps : {4, kSubsteps}) {
        const double fastest = drive_corners(all, 45, substeps);
        std::printf("       fastest of all corners with %d substeps: %.1f m/s\n", substeps, fastest);
        CHECK(fastest < 20.0);
    }
}

TEST(some_corners_stay_finite_for_2000_steps) {
    std::mt19937 random(6);
    std::vector<uint32_t> some(256 / test::kStride);
    for (uint32_t& corner : some) corner = random() & ((1u << kNumVehicleParameters) - 1u);
    CHECK(drive_corners(some, 2000, kSubsteps) < 20.0);
}

TEST(a_car_randomised_by_a_fifth_stays_near_its_speed) {
    std::mt19937 random(7);
    std::uniform_real_distribution<float> u(-1.0f, 1.0f);
    for (int trial = 0; trial < 300; ++trial) {
        VehicleParameters car = default_car();
        float values[kNumVehicleParameters];
        std::memcpy(values, &car, sizeof(car));
        for (float& value : values) value *= 1.0f + 0.2f * u(random);
        std::memcpy(&car, values, sizeof(car));
        VehicleState state{};
        float steering = 0.0f;
        float speed = kMaxSpeedCommand;
        for (int step = 0; step < 150; ++step) {
            if (u(random) > 0.6f) steering = u(random) > 0.0f ? kMaxSteering : -kMaxSteering;
            if (u(random) > 0.8f) speed = u(random) > -0.5f ? kMaxSpeedCommand : 0.0f;
            state = drive(car, state, steering, speed, kSubsteps);
            CHECK(std::hypot(state.speed, state.lateral_speed) < 1.3f * 1.2f * kMaxSpeedCommand);
        }
    }
}

}  // namespace racecraft
