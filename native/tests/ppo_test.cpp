// The loop as an interface in C drives it, without Python: cars on a table, and a learner that can be
// followed by hand.
#include "../src/ppo.hpp"

#include <algorithm>
#include <limits>
#include <vector>

#include "check.hpp"

namespace racecraft {
namespace {

constexpr size_t kCars = 3, kSight = 4, kStates = 2;

// Likes all of three actions alike, values a pose as its first state, and keeps what it is to learn from.
class Notes final : public ActorCritic {
  public:
    ActorCriticShape shape() const override { return {kSight, 1, kStates, 3, true}; }
    void encode(const uint8_t* sight, size_t count, uint8_t* out) override {
        for (size_t i = 0; i < count; ++i) out[i] = sight[i * kSight];
    }
    void policy(const uint8_t*, const float*, size_t count, float* out) override {
        std::fill_n(out, 3 * count, logit);
    }
    void values(const uint8_t*, const float* states, size_t count, float* out) override {
        for (size_t i = 0; i < count; ++i) out[i] = states[i * kStates];
    }
    UpdateStats update(const Minibatch& minibatch, const Objective&) override {
        for (size_t i = 0; i < minibatch.size; ++i) taken.push_back(minibatch.rows[i]);
        return {loss, 0.0, 0.0, 0.0, 0.0, 0.0};
    }

    std::vector<int64_t> taken;
    double loss = 0.0;
    float logit = 0.0f;
};

PpoConfig config_of(size_t episodes) {
    return {.num_envs = kCars,
            .num_steps = 4,
            .episodes_per_iteration = episodes,
            .max_steps_per_iteration = 100,
            .rate_steps = 0,
            .gamma = 0.5,
            .gae_lambda = 1.0,
            .minibatch_size = 5,
            .update_epochs = 2,
            .normalize_returns = false,
            .is_greedy = false,
            .epsilon_start = 0.0,
            .epsilon_end = 0.0,
            .epsilon_steps = 0,
            .objective = {1e-3, 0.2, 0.0, 0.5, false, 0.5, 1e-5}};
}

// Cars that are paid 1 a step; the episode of car i ends after 2 + i steps, that of the last one is cut.
struct Cars {
    int age[kCars] = {};
    bool terminated[kCars] = {}, truncated[kCars] = {};
    uint8_t sight[kCars * kSight] = {};
    float states[kCars * (kStates + 1)] = {};  // one column more than the network reads

    void see() {
        for (size_t car = 0; car < kCars; ++car) {
            sight[car * kSight] = static_cast<uint8_t>(10 * car + static_cast<size_t>(age[car]));
            states[car * (kStates + 1)] = static_cast<float>(age[car]);
        }
    }
    void step() {
        for (size_t car = 0; car < kCars; ++car) {
            const bool is_over = ++age[car] == 2 + static_cast<int>(car);
            terminated[car] = is_over && car + 1 < kCars;
            truncated[car] = is_over && car + 1 == kCars;
        }
    }
    void reset(const bool* mask) {
        for (size_t car = 0; car < kCars; ++car) age[car] = mask[car] ? 0 : age[car];
    }
};

void drive(Ppo& loop, Cars& cars, uint64_t iteration) {
    const double rewards[kCars] = {1.0, 1.0, 1.0};
    loop.begin(7, iteration, loop.total_steps());
    if (loop.needs_reset()) cars = {};
    while (!loop.is_full()) {
        cars.see();
        CHECK(loop.act(cars.sight, cars.states, kStates + 1));
        cars.step();
        if (loop.pay(rewards, cars.terminated, cars.truncated)) {
            cars.see();
            loop.look(cars.sight, cars.states, kStates + 1);
        }
        if (loop.any_begins()) cars.reset(loop.begins());
    }
}

}  // namespace

TEST(a_rollout_holds_what_was_seen_and_paid) {
    Notes learner;
    Ppo loop(config_of(0), learner);
    Cars cars;
    drive(loop, cars, 0);
    const Rollout& rollout = loop.rollout();
    CHECK_EQUAL(rollout.num_steps, size_t{4});
    CHECK_EQUAL(loop.total_steps(), int64_t{12});
    CHECK_EQUAL(loop.ended().size(), size_t{4});  // car 0 twice
    CHECK_EQUAL(loop.ended()[1].car, size_t{1});
    CHECK_EQUAL(loop.ended()[1].length, int64_t{3});
    CHECK_EQUAL(loop.ended()[1].total, 3.0);
    CHECK_EQUAL(static_cast<int>(rollout.observations[3 * kCars + 1]), 10);  // car 1 began again
    CHECK(loop.learn());
    // car 2: cut at the end of its row 3 at age 4, so 1 + 0.5 * 4 - 3; car 0: over, so 1 - 1
    CHECK_EQUAL(rollout.next_values[3 * kCars + 2], 4.0f);
    CHECK_EQUAL(rollout.next_values[3 * kCars + 1], 1.0f);  // under way
    CHECK_EQUAL(rollout.returns[3 * kCars + 2], 3.0f);
    CHECK_EQUAL(rollout.returns[3 * kCars + 0], 1.0f);
    CHECK_EQUAL(rollout.returns[2 * kCars + 0], 1.5f);
}

TEST(no_value_of_another_rollout_stays) {
    Notes learner;
    Ppo loop(config_of(0), learner);
    Cars cars;
    for (uint64_t iteration = 0; iteration < 3; ++iteration) {
        drive(loop, cars, iteration);
        CHECK(loop.learn());
        // in the last row car 1 is at age 1, then 2, and then its episode of 3 steps is over
        CHECK_EQUAL(loop.rollout().next_values[3 * kCars + 1],
                    iteration < 2 ? 1.0f + static_cast<float>(iteration) : 0.0f);
    }
}

TEST(minibatches_are_a_shuffle_of_what_was_driven) {
    Notes learner;
    Ppo loop(config_of(0), learner);
    Cars cars;
    drive(loop, cars, 0);
    CHECK(loop.learn());
    CHECK_EQUAL(loop.updates().size(), size_t{4});  // 12 samples: two of 5 in each of two passes
    CHECK_EQUAL(learner.taken.size(), size_t{20});
    for (size_t epoch = 0; epoch < 2; ++epoch) {
        bool seen[12] = {};
        for (size_t i = 0; i < 10; ++i) {
            const size_t row = static_cast<size_t>(learner.taken[10 * epoch + i]);
            CHECK(row < 12 && !seen[row]);
            seen[row] = true;
        }
    }
}

TEST(iterations_of_whole_episodes_take_the_memory_that_they_need) {
    Notes learner;
    Ppo loop(config_of(4), learner);  // two of car 0, one of the others
    Cars cars;
    for (uint64_t iteration = 0; iteration < 3; ++iteration) {
        drive(loop, cars, iteration);
        CHECK_EQUAL(loop.ended().size(), size_t{4});
        CHECK_EQUAL(loop.rollout().num_steps, size_t{4});
        CHECK(loop.learn());
        CHECK_EQUAL(loop.num_driven(), size_t{4 + 3 + 4});
    }
    CHECK_EQUAL(loop.total_steps(), int64_t{33});
    CHECK(loop.rollout().rewards.size() < size_t{10 * kCars});
}

TEST(what_is_not_finite_stops_it) {
    Notes learner;
    Ppo loop(config_of(0), learner);
    Cars cars;
    drive(loop, cars, 0);
    learner.loss = std::numeric_limits<double>::infinity();
    CHECK(!loop.learn());
    CHECK_EQUAL(loop.updates().size(), size_t{1});
    learner.logit = std::numeric_limits<float>::quiet_NaN();
    loop.begin(7, 1, 12);
    CHECK(!loop.act(cars.sight, cars.states, kStates + 1));
}

}  // namespace racecraft
