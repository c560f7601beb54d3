// The engine: the same bits for any batch, thread count and instruction set, and state that may come from
// anywhere.
#include "engine.hpp"

#include <algorithm>
#include <cstddef>
#include <limits>
#include <stdexcept>
#include <thread>
#include <utility>

#include "check.hpp"
#include "dispatch.hpp"
#include "tracks.hpp"

namespace racecraft {
namespace {

using test::Outline;

constexpr size_t kCars = 64;
constexpr int kSteps = 120;

// Sixteen corners made of literal numbers, so that the golden hash depends on nothing but the engine.
Outline polygon() {
    constexpr double corners[17][2] = {{4, 0},       {3.6, 1.4},   {2.8, 2.4},   {1.5, 2.9},  {0, 2.6},
                                       {-1.5, 2.75}, {-2.8, 2.2},  {-3.5, 1.25}, {-3.8, 0},   {-3.4, -1.4},
                                       {-2.6, -2.3}, {-1.4, -2.6}, {0, -2.2},    {1.3, -2.7}, {2.7, -2.5},
                                       {3.7, -1.3},  {4, 0}};
    Outline road{{}, {}, {}, true};
    for (const auto& p : corners) {
        road.center.insert(road.center.end(), {p[0], p[1]});
        road.inner.insert(road.inner.end(), {0.875 * p[0], 0.875 * p[1]});
        road.outer.insert(road.outer.end(), {1.125 * p[0], 1.125 * p[1]});
    }
    return road;
}

// The default car of racecraft.sim.vehicle.
constexpr VehicleParameters kCar{.mass = 7.5f,
                                 .yaw_inertia = 0.109f,
                                 .front_axle = 0.116f,
                                 .rear_axle = 0.078f,
                                 .half_track = 0.08f,
                                 .front_load = 0.396f,
                                 .front_friction = 0.315f,
                                 .rear_friction = 0.29f,
                                 .front_stiffness = 6.92f,
                                 .rear_stiffness = 12.0f,
                                 .slip_speed = 0.5f,
                                 .drive_acceleration = 3.33f,
                                 .brake_acceleration = 3.91f,
                                 .speed_time_constant = 0.1155f,
                                 .steering_time_constant = 0.02f,
                                 .steering_rate = 40.0f,
                                 .steering_bias = 0.0247f,
                                 .speed_gain = 1.049f};

struct Settings {
    size_t num_envs = 1;
    int num_threads = 1;
    bool camera = false;
    StartMode start = StartMode::random;
    int32_t laps = 1;
};

std::unique_ptr<Engine> make_engine(const Settings& settings) {
    Outline road = polygon();
    Outline twin = road;
    const size_t count = road.num_waypoints();
    for (size_t i = 0; i < count; ++i) {
        for (size_t axis = 0; axis < 2; ++axis) {
            twin.center[2 * i + axis] = road.center[2 * (count - 1 - i) + axis];
            twin.inner[2 * i + axis] = road.inner[2 * (count - 1 - i) + axis];
            twin.outer[2 * i + axis] = road.outer[2 * (count - 1 - i) + axis];
        }
    }
    std::vector<TrackStore> tracks;
    tracks.push_back(test::store_of(road));
    tracks.push_back(test::store_of(twin));
    const EngineConfig config{
        .num_envs = settings.num_envs,
        .seed = 12345,
        .substeps = 8,
        .num_threads = settings.num_threads,
        .limits = {.laps = settings.laps, .max_steps = 90, .time_limit = 0.0},
        .start = {.mode = settings.start,
                  .offset = 0.25,
                  .advance = 0.05,
                  .spread = false,
                  .lateral_jitter = 0.1f,
                  .heading_jitter = 0.2f},
        .direction = Direction::alternate,
    };
    CameraSpec camera;
    camera.width = 40;
    camera.height = 30;
    std::vector<std::shared_ptr<const GroundMap>> grounds;
    if (settings.camera)
        grounds.push_back(std::make_shared<const GroundMap>(road.view(), GroundOptions{.texel = 0.04f}));
    return std::make_unique<Engine>(config, std::move(tracks), grounds, kCar,
                                    settings.camera ? &camera : nullptr);
}

// What car number `car` does in its step `step`: mostly gentle, sometimes wild, so that episodes end in many
// ways.
void choose_action(size_t car, int step, float* action) {
    const RandomBlock random =
        philox(99, static_cast<uint32_t>(car), 0, static_cast<uint32_t>(step / 4), static_cast<Purpose>(7));
    action[0] = symmetric_of(random.words[0]) * (car % 3 == 0 ? 1.0f : 0.3f);
    const float speed = std::min(5.0f * uniform_of(random.words[1]) - 0.5f, kMaxSpeedCommand);
    action[1] = car % 5 == 4 ? 0.0f : speed;
}

uint64_t mix(uint64_t hash, const void* data, size_t size) {
    const uint8_t* bytes = static_cast<const uint8_t*>(data);
    for (size_t i = 0; i < size; ++i) hash = (hash ^ bytes[i]) * 1099511628211u;  // FNV-1a
    return hash;
}

// One hash of all that kCars cars did, driven in engines of `batch` cars each.
uint64_t hash_of_drive(size_t batch, int num_threads, bool camera = false) {
    std::vector<uint64_t> hashes(kCars, 14695981039346656037u);
    for (size_t first = 0; first < kCars; first += batch) {
        const size_t n = std::min(batch, kCars - first);
        const auto engine = make_engine({.num_envs = n, .num_threads = num_threads, .camera = camera});
        std::vector<uint64_t> seeds(n);
        for (size_t i = 0; i < n; ++i) seeds[i] = 1000 + first + i;
        engine->reset(nullptr, seeds.data());
        std::vector<float> actions(2 * n);
        const auto done = std::make_unique<bool[]>(n);
        for (int step = 0; step < kSteps; ++step) {
            for (size_t i = 0; i < n; ++i) choose_action(first + i, step, &actions[2 * i]);
            engine->step(actions.data());
            for (size_t i = 0; i < n; ++i) {
                uint64_t& hash = hashes[first + i];
                hash = mix(hash, engine->rows() + i * kNumRowColumns, kNumRowColumns * sizeof(double));
                hash = mix(hash, engine->state() + i * kNumStateColumns, kNumStateColumns * sizeof(float));
                for (size_t k = 0; k < 7; ++k)
                    hash = mix(hash, engine->vehicles() + k * n + i, sizeof(float));
                if (camera && step % 40 == 0) hash = mix(hash, engine->frames() + i * 1200, 1200);
                done[i] = engine->terminated()[i] || engine->truncated()[i];
            }
            engine->reset(done.get());
        }
    }
    return mix(14695981039346656037u, hashes.data(), hashes.size() * sizeof(uint64_t));
}

// A change of the physics, the rules or the starts on purpose is the only reason to change it.
constexpr uint64_t kGolden = 3568514456787877211u;

}  // namespace

TEST(the_golden_hash_holds_for_any_batch_threads_and_instruction_set) {
    const std::string best = isa_name(current_isa());
    for (const Isa isa : available_isas()) {
        set_isa(isa_name(isa));
        CHECK_EQUAL(hash_of_drive(7, 2), kGolden);
        if (!test::kEveryCase) continue;
        CHECK_EQUAL(hash_of_drive(kCars, 1), kGolden);
        CHECK_EQUAL(hash_of_drive(1, 1), kGolden);
    }
    set_isa(best);
    if (!test::kEveryCase) return;
    for (const size_t batch : {size_t{1}, size_t{7}, kCars}) {
        for (const int threads : {1, 2, 7}) CHECK_EQUAL(hash_of_drive(batch, threads), kGolden);
    }
}

TEST(frames_are_the_same_for_any_batch_and_threads) {
    const uint64_t expected = hash_of_drive(kCars, 7, true);
    CHECK_EQUAL(hash_of_drive(7, 2, true), expected);
    if (test::kEveryCase) CHECK_EQUAL(hash_of_drive(1, 1, true), expected);
}

TEST(a_loaded_engine_goes_on_to_the_bit) {
    const auto engine = make_engine({.num_envs = 9, .num_threads = 2, .camera = true});
    const auto other = make_engine({.num_envs = 9, .num_threads = 1, .camera = true});
    std::vector<float> actions(18);
    for (int step = 0; step < 60; ++step) {
        for (size_t i = 0; i < 9; ++i) choose_action(i, step, &actions[2 * i]);
        engine->step(actions.data());
        if (step == 20) {
            const std::vector<uint8_t> saved = engine->save();
            other->load(saved.data(), saved.size());
            CHECK(saved == other->save());
        }
        if (step < 20) continue;
        if (step > 20) other->step(actions.data());
        CHECK(std::memcmp(engine->rows(), other->rows(), 9 * kNumRowColumns * sizeof(double)) == 0);
        CHECK(std::memcmp(engine->state(), other->state(), 9 * kNumStateColumns * sizeof(float)) == 0);
        CHECK(std::memcmp(engine->frames(), other->frames(), 9 * 1200) == 0);
        CHECK(std::memcmp(engine->terminated(), other->terminated(), 18) == 0);
    }
}

TEST(a_damaged_state_is_refused_and_changes_nothing) {
    const auto engine = make_engine({.num_envs = 3, .camera = true});
    const std::vector<float> actions = {0.1f, 1.0f, -0.1f, 2.0f, 0.0f, 3.0f};
    for (int i = 0; i < 5; ++i) engine->step(actions.data());
    const std::vector<uint8_t> good = engine->save();
    CHECK_THROWS(engine->load(good.data(), good.size() - 1), std::invalid_argument);
    CHECK_THROWS(engine->load(good.data(), 0), std::invalid_argument);
    const auto is_finite = [](const auto* values, size_t count) {
        return std::all_of(values, values + count, [](auto value) { return std::isfinite(value); });
    };
    int refused = 0;
    for (size_t at = 0; at + 8 <= good.size(); at += 4) {
        for (const auto& [byte, size] : {std::pair{0xff, 4}, std::pair{0xff, 8}, std::pair{0x7f, 4}}) {
            std::vector<uint8_t> bad = good;
            std::memset(&bad[at], byte, static_cast<size_t>(size));
            try {
                engine->load(bad.data(), bad.size());
                for (const int action : {0, 1, 2}) {
                    if (action == 1) engine->step(actions.data());
                    if (action == 2) engine->reset(nullptr);
                    CHECK(is_finite(engine->rows(), 3 * kNumRowColumns));
                    CHECK(is_finite(engine->state(), 3 * kNumStateColumns));
                }
            } catch (const std::invalid_argument&) {
                ++refused;
                CHECK(engine->save() == good);
            }
            engine->load(good.data(), good.size());
        }
    }
    CHECK(refused > 500);
    CHECK(engine->save() == good);
}

TEST(a_saved_status_that_does_not_exist_is_refused) {
    const auto engine = make_engine({.num_envs = 3});
    const std::vector<uint8_t> good = engine->save();
    const size_t numbers = 3 * (7 + kNumVehicleParameters + kNumStateColumns);
    const size_t episodes = numbers * sizeof(float) + 3 * kNumRowColumns * sizeof(double);
    for (int32_t status = -1; status <= static_cast<int32_t>(Status::park) + 1; ++status) {
        const bool exists = status >= 0 && status <= static_cast<int32_t>(Status::park);
        std::vector<uint8_t> changed = good;
        std::memcpy(&changed[episodes + sizeof(Episode) + offsetof(Episode, status)], &status,
                    sizeof(status));
        std::string refusal;
        try {
            engine->load(changed.data(), changed.size());
        } catch (const std::invalid_argument& error) {
            refusal = error.what();
        }
        CHECK_EQUAL(refusal, exists ? "" : "Saved simulation state holds a status that does not exist.");
    }
}

TEST(a_loaded_engine_draws_the_next_episodes_of_the_saved_one) {
    const auto engine = make_engine({.num_envs = 3});
    const auto other = make_engine({.num_envs = 3});
    const std::vector<uint64_t> seeds = {7, 7, 8};
    engine->reset(nullptr, seeds.data());
    const std::vector<uint8_t> saved = engine->save();
    other->load(saved.data(), saved.size());
    for (int episode = 0; episode < 3; ++episode) {
        engine->reset(nullptr);
        other->reset(nullptr);
        CHECK(std::memcmp(engine->vehicles(), other->vehicles(), 3 * 7 * sizeof(float)) == 0);
        for (size_t k = 0; k < 7; ++k) CHECK_EQUAL(engine->vehicles()[3 * k], engine->vehicles()[3 * k + 1]);
    }
}

TEST(a_state_whose_car_is_nowhere_is_refused_whatever_number_of_it_is_wrong) {
    const auto engine = make_engine({.num_envs = 3});
    const std::vector<float> actions = {0.1f, 1.0f, -0.1f, 2.0f, 0.0f, 3.0f};
    for (int i = 0; i < 5; ++i) engine->step(actions.data());
    const std::vector<uint8_t> good = engine->save();
    constexpr float infinity = std::numeric_limits<float>::infinity();
    const auto refusal = [&](size_t number, float value) -> std::string {
        std::vector<uint8_t> bad = good;
        std::memcpy(&bad[number * sizeof(float)], &value, sizeof(value));
        try {
            engine->load(bad.data(), bad.size());
        } catch (const std::invalid_argument& error) {
            CHECK(engine->save() == good);
            return error.what();
        }
        return "";
    };
    // The poses come first, then the parameters, one number of every car beside the other.
    for (size_t number = 0; number < 3 * (7 + kNumVehicleParameters); ++number) {
        for (const float value : {std::nanf(""), infinity, -infinity, 1e7f, -1e7f}) {
            const std::string expected =
                number < 3 * 7 ? "holds a car that is nowhere." : "holds a car that cannot be.";
            CHECK_EQUAL(refusal(number, value), "Saved simulation state " + expected);
        }
        CHECK_EQUAL(refusal(number, 0.5f), "");
        engine->load(good.data(), good.size());
    }
}

TEST(no_parameter_or_pose_leads_outside_the_memory) {
    // Python may write anything into the views; the engine need not make sense of it, only survive.
    const float values[] = {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(),
                            -1e30f, 0.0f, -1.0f};
    const auto engine = make_engine({.num_envs = 2, .camera = true});
    const std::vector<float> actions = {0.3f, 4.0f, -0.5f, 4.0f};
    for (const float value : values) {
        for (int k = 0; k < kNumVehicleParameters; ++k) {
            engine->reset(nullptr);
            const float before = engine->parameters()[2 * k];
            engine->parameters()[2 * k] = value;
            for (int i = 0; i < 5; ++i) engine->step(actions.data());
            engine->parameters()[2 * k] = before;
        }
        for (int k = 0; k < 7; ++k) {
            engine->reset(nullptr);
            engine->vehicles()[2 * k] = value;
            for (int i = 0; i < 5; ++i) engine->step(actions.data());
        }
    }
    for (const float far : {1e5f, -1e5f}) {
        engine->reset(nullptr);
        engine->set_pose(0, far, far, far, 4.0f);
        for (int i = 0; i < 5; ++i) engine->step(actions.data());
        CHECK(engine->terminated()[0]);
    }
}

TEST(actions_are_clipped) {
    const auto engine = make_engine({.num_envs = 4, .start = StartMode::fixed});
    const std::vector<float> actions = {100.0f, 100.0f, -100.0f, -100.0f, 0.2f, 0.05f, 0.2f, 0.0f};
    engine->step(actions.data());
    const auto row = [&](size_t car, int column) { return engine->rows()[car * kNumRowColumns + column]; };
    CHECK_EQUAL(row(0, kRow_steering_angle), static_cast<double>(kMaxSteeringCommand));
    CHECK_EQUAL(row(0, kRow_speed), static_cast<double>(kMostSpeedCommand));
    CHECK_EQUAL(row(1, kRow_steering_angle), -static_cast<double>(kMaxSteeringCommand));
    CHECK_EQUAL(row(1, kRow_speed), static_cast<double>(kMinSpeedCommand));
    CHECK_EQUAL(row(2, kRow_speed), static_cast<double>(kMinSpeedCommand));
    CHECK_EQUAL(row(3, kRow_speed), 0.0);
}

TEST(callers_from_several_threads_wait_for_each_other) {
    const auto engine = make_engine({.num_envs = 20, .num_threads = 2});
    const std::vector<float> actions(40, 0.5f);
    std::vector<std::thread> callers;
    for (int caller = 0; caller < 3; ++caller) {
        callers.emplace_back([&engine, &actions, caller] {
            for (int i = 0; i < 50; ++i) {
                engine->step(actions.data());
                if (caller == 1) engine->reset(nullptr);
                if (caller == 2) engine->set_pose(3, 4.0f, 0.0f, 1.5f, 1.0f);
                if (caller == 0) engine->freeze(4, 2);
            }
        });
    }
    for (std::thread& caller : callers) caller.join();
    const std::vector<uint8_t> saved = engine->save();
    engine->load(saved.data(), saved.size());
}

TEST(kernels_give_the_same_bits_on_every_instruction_set) {
    // All parameters different in every lane, and every count of lanes.
    const std::string best = isa_name(current_isa());
    std::vector<std::vector<uint8_t>> results;
    for (const Isa isa : available_isas()) {
        set_isa(isa_name(isa));
        std::vector<uint8_t> bits;
        for (size_t n = 1; n <= 35; n += 2) {
            const auto engine = make_engine({.num_envs = n});
            for (size_t i = 0; i < kNumVehicleParameters * n; ++i) {
                engine->parameters()[i] *=
                    1.0f +
                    0.2f * symmetric_of(
                               philox(5, static_cast<uint32_t>(i), 0, 0, static_cast<Purpose>(8)).words[0]);
            }
            std::vector<float> actions(2 * n);
            for (int step = 0; step < 40; ++step) {
                for (size_t i = 0; i < n; ++i) choose_action(i, step, &actions[2 * i]);
                engine->step(actions.data());
            }
            const std::vector<uint8_t> saved = engine->save();
            bits.insert(bits.end(), saved.begin(), saved.end());
        }
        results.push_back(bits);
    }
    for (const std::vector<uint8_t>& bits : results) CHECK(bits == results.front());
    set_isa(best);
}

}  // namespace racecraft
