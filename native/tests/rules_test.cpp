// The rules of an episode, pose by pose, each at its exact threshold.
#include "racecraft/rules.hpp"

#include <algorithm>
#include <functional>
#include <utility>

#include "check.hpp"
#include "tracks.hpp"

namespace racecraft {
namespace {

using test::Outline;

constexpr RuleLimits kOneLap{.laps = 1, .max_steps = 100000, .time_limit = 0.0};

// One car whose poses a test sets itself; the engine's part in an episode, without its physics.
class Judge {
  public:
    explicit Judge(const Outline& road, RuleLimits limits = kOneLap)
        : store_(test::store_of(road)), limits_(limits) {}

    const TrackGeometry& track() const { return store_.geometry(); }
    Episode& episode() { return episode_; }
    double row(int column) const { return row_[column]; }
    Status status() const { return static_cast<Status>(static_cast<int>(row_[kRow_status])); }
    const float* state() const { return state_; }

    // A pose whose reference point lies at arc_length on the centre line, offset metres to its left.
    VehicleState pose_at(double arc_length, double offset = 0.0) const {
        const TrackGeometry& t = track();
        if (t.is_closed) arc_length -= t.length * std::floor(arc_length / t.length);
        int i = 0;
        while (i + 1 < t.num_segments && t.segments[i + 1].arc_length <= arc_length) ++i;
        const Segment& s = t.segments[i];
        const double ux = s.dx / s.length, uy = s.dy / s.length, along = arc_length - s.arc_length;
        const double ahead = static_cast<double>(kReferenceAhead);
        VehicleState state{};
        state.x = static_cast<float>(s.x + (along - ahead) * ux - offset * uy);
        state.y = static_cast<float>(s.y + (along - ahead) * uy + offset * ux);
        state.heading = static_cast<float>(std::atan2(uy, ux));
        return state;
    }

    void begin(const VehicleState& state) {
        episode_ = Episode{};
        observe(track(), state, episode_, state_);
        episode_.steps = 1;
        episode_.status = Status::prepare;
        episode_.start = episode_.projection.arc_length / track().length;
        episode_.last_x = episode_.reference_x;
        episode_.last_y = episode_.reference_y;
    }

    Verdict judge_at(const VehicleState& state) {
        observe(track(), state, episode_, state_);
        return judge(track(), limits_, state, 0.1f, 1.5f, false, false, episode_, row_);
    }

  private:
    TrackStore store_;
    RuleLimits limits_;
    Episode episode_{};
    double row_[kNumRowColumns] = {};
    float state_[kNumStateColumns] = {};
};

}  // namespace

TEST(a_row_says_what_was_judged) {
    Judge car(test::circuit());
    car.begin(car.pose_at(1.0));
    const VehicleState pose = car.pose_at(1.5, 0.1);
    const Verdict verdict = car.judge_at(pose);
    CHECK(!verdict.terminated && !verdict.truncated);
    CHECK_EQUAL(car.row(kRow_steps), 2.0);
    CHECK_NEAR(car.row(kRow_time), 2.0 / 15.0, 1e-15);
    CHECK_NEAR(car.row(kRow_progress), 0.5 / car.track().length, 1e-6);
    CHECK_NEAR(car.row(kRow_projection_distance), 1.5, 1e-5);
    CHECK_NEAR(car.row(kRow_offset), 0.1, 1e-5);
    CHECK_EQUAL(car.row(kRow_track_length), car.track().length);
    CHECK_EQUAL(car.row(kRow_closest_next), car.row(kRow_closest_prev) + 1.0);
    CHECK_EQUAL(car.row(kRow_steering_angle), static_cast<double>(0.1f));
    CHECK_EQUAL(car.row(kRow_speed), 1.5);
    CHECK_EQUAL(car.row(kRow_heading), static_cast<double>(pose.heading));
    CHECK_NEAR(car.row(kRow_x),
               static_cast<double>(pose.x) + 0.14 * std::cos(static_cast<double>(pose.heading)), 1e-6);
    CHECK_NEAR(car.row(kRow_y),
               static_cast<double>(pose.y) + 0.14 * std::sin(static_cast<double>(pose.heading)), 1e-6);
    CHECK_EQUAL(car.row(kRow_all_wheels_on_track), 1.0);
    CHECK(car.status() == Status::in_progress);
}

TEST(a_lap_is_complete_when_progress_reaches_one) {
    Judge car(test::circuit());
    const double length = car.track().length;
    car.begin(car.pose_at(0.3 * length));
    const int steps = 200;
    for (int i = 1; i < steps; ++i) {
        const Verdict verdict = car.judge_at(car.pose_at((0.3 + 0.9999 * i / steps) * length));
        CHECK(!verdict.terminated);
        CHECK_NEAR(car.row(kRow_progress), 0.9999 * i / steps, 1e-6);
    }
    CHECK(!car.judge_at(car.pose_at(1.29999 * length)).terminated);
    CHECK(car.judge_at(car.pose_at(1.30001 * length)).terminated);
    CHECK(car.status() == Status::lap_complete);
    CHECK_EQUAL(car.row(kRow_lap), 1.0);
    CHECK_NEAR(car.row(kRow_progress), 1.00001, 1e-6);
}

TEST(laps_flow_into_each_other_without_a_stop) {
    Judge car(test::circuit(), {.laps = 3, .max_steps = 100000, .time_limit = 0.0});
    const double length = car.track().length;
    car.begin(car.pose_at(0.5 * length));
    Verdict verdict{};
    int steps = 0, completed = 0;
    double last = 0.0;
    for (; !verdict.terminated && steps < 1000; ++steps) {
        verdict = car.judge_at(car.pose_at((0.5 + 0.01 * (steps + 1) + 1e-6) * length));
        completed += car.status() == Status::lap_complete;
        if (car.row(kRow_progress) < last) CHECK(car.row(kRow_progress) < 0.02);
        CHECK(car.row(kRow_progress) >= 0.0);
        last = car.row(kRow_progress);
    }
    CHECK_EQUAL(steps, 300);
    CHECK_EQUAL(completed, 3);
    CHECK_EQUAL(car.row(kRow_lap), 3.0);
}

TEST(an_open_road_is_complete_at_its_very_end_whatever_its_length) {
    // Arc length over length must reach 1 exactly, for every length.
    for (int i = 1; i <= 500; ++i) {
        const double scale = 1.0 + 0.01 * i;
        Judge car(test::road_along(
            [&](double t) { return test::Point{scale * 7.0 * t, 0.3 * std::sin(2.0 * t)}; }, 20, 0.5, false));
        car.begin(car.pose_at(0.2));
        car.episode().start = 0.0;
        CHECK(!car.judge_at(car.pose_at(0.999 * car.track().length)).terminated);
        VehicleState beyond = car.pose_at(car.track().length);
        beyond.x += 0.02f;
        CHECK(car.judge_at(beyond).terminated);
        CHECK(car.status() == Status::lap_complete);
    }
}

TEST(fifteen_falling_steps_are_reversed_and_fourteen_are_not) {
    Judge car(test::circuit());
    car.begin(car.pose_at(5.0));
    double s = 5.0;
    for (int i = 0; i < 14; ++i) CHECK(!car.judge_at(car.pose_at(s -= 0.01)).terminated);
    CHECK(!car.judge_at(car.pose_at(s += 0.005)).terminated);
    for (int i = 0; i < 14; ++i) CHECK(!car.judge_at(car.pose_at(s -= 0.01)).terminated);
    CHECK(car.judge_at(car.pose_at(s -= 0.01)).terminated);
    CHECK(car.status() == Status::reversed);
}

TEST(a_car_that_turns_back_behind_the_line_of_a_flying_lap_falls_from_where_it_was) {
    Judge car(test::circuit(), {.laps = 2, .max_steps = 100000, .time_limit = 0.0});
    const double length = car.track().length;
    car.begin(car.pose_at(0.0));
    for (int i = 1; i <= 100; ++i) car.judge_at(car.pose_at(0.01 * i * length + 0.2));
    CHECK(car.status() == Status::lap_complete);
    CHECK_NEAR(car.episode().progress * length, 0.2, 1e-4);
    double s = 0.2;
    for (int i = 0; i < 14; ++i) CHECK(!car.judge_at(car.pose_at(s -= 0.01)).terminated);
    CHECK(car.judge_at(car.pose_at(s -= 0.01)).terminated);
    CHECK(car.status() == Status::reversed);
}

TEST(backing_over_the_start_line_is_negative_progress_not_a_lap) {
    Judge car(test::circuit());
    car.begin(car.pose_at(0.03));
    for (int i = 1; i <= 10; ++i) CHECK(!car.judge_at(car.pose_at(0.03 - 0.01 * i)).terminated);
    CHECK_NEAR(car.row(kRow_progress), -0.1 / car.track().length, 1e-6);
    CHECK(car.row(kRow_projection_distance) > 0.9 * car.track().length);
    for (int i = 1; i <= 20; ++i) CHECK(!car.judge_at(car.pose_at(-0.07 + 0.01 * i)).terminated);
    CHECK_NEAR(car.row(kRow_progress), 0.1 / car.track().length, 1e-6);
}

TEST(fifteen_still_steps_are_immobilized_and_fourteen_are_not) {
    Judge car(test::circuit());
    car.begin(car.pose_at(2.0));
    const auto creep = [&](double step, int steps) {
        VehicleState pose = car.pose_at(2.0);
        bool terminated = false;
        for (int i = 0; i < steps; ++i) {
            pose.x += static_cast<float>(step * std::cos(static_cast<double>(pose.heading)));
            pose.y += static_cast<float>(step * std::sin(static_cast<double>(pose.heading)));
            terminated = car.judge_at(pose).terminated;
        }
        return terminated;
    };
    CHECK(!creep(0.0, 14));
    CHECK(!creep(0.01, 1));
    CHECK(!creep(0.0, 15));  // the first step back is a movement
    car.begin(car.pose_at(2.0));
    CHECK(creep(0.00029, 15));
    CHECK(car.status() == Status::immobilized);
    car.begin(car.pose_at(2.0));
    CHECK(!creep(0.00031, 30));
    CHECK(car.status() == Status::in_progress);
}

TEST(a_car_is_off_track_only_when_no_wheel_is_on_it) {
    Judge car(test::road_along([](double t) { return test::Point{10.0 * t, 0.0}; }, 50, 0.4, false));
    car.begin(car.pose_at(1.0));
    // Heading along the road, wheels at +-0.08: on with all four up to 0.319, off with the last beyond 0.481.
    const struct {
        double offset;
        bool all, off;
    } cases[] = {{0.0, true, false},      {0.3, true, false},      {0.3185, true, false},
                 {0.3195, false, false},  {0.4, false, false},     {0.4805, false, false},
                 {0.4815, false, true},   {2.0, false, true},      {-0.3185, true, false},
                 {-0.3195, false, false}, {-0.4805, false, false}, {-0.4815, false, true}};
    for (const auto& [offset, all, off] : cases) {
        car.begin(car.pose_at(1.0));
        const Verdict verdict = car.judge_at(car.pose_at(1.1, offset));
        CHECK_EQUAL(car.row(kRow_all_wheels_on_track), all ? 1.0 : 0.0);
        CHECK_EQUAL(car.row(kRow_is_offtrack), off ? 1.0 : 0.0);
        CHECK_EQUAL(verdict.terminated, off);
        CHECK(car.status() == (off ? Status::off_track : Status::in_progress));
    }
}

TEST(wheels_are_where_the_car_carries_them_whichever_way_road_and_car_point) {
    for (const double road : {0.0, 0.7, 1.6, 2.5}) {
        const double ux = std::cos(road), uy = std::sin(road);
        Judge car(test::road_along([&](double t) { return test::Point{10.0 * t * ux, 10.0 * t * uy}; }, 50,
                                   0.4, false));
        for (const double turn : {0.0, 0.5, -0.9, 1.6, 3.0}) {
            double highest = -1e9, lowest = 1e9;  // m to the left of the car, across the road
            for (const auto& [along, half] :
                 {std::pair{kRearAxleX, kRearHalfTrack}, {kFrontAxleX, kFrontHalfTrack}}) {
                for (const double side : {-1.0, 1.0}) {
                    const double across = static_cast<double>(along) * std::sin(turn) +
                                          side * static_cast<double>(half) * std::cos(turn);
                    highest = std::max(highest, across);
                    lowest = std::min(lowest, across);
                }
            }
            const auto wheels_at = [&](double across) {
                VehicleState pose{};
                pose.x = static_cast<float>(5.0 * ux - across * uy);
                pose.y = static_cast<float>(5.0 * uy + across * ux);
                pose.heading = static_cast<float>(road + turn);
                car.begin(pose);
                return wheels_on_road(car.track(), pose, car.episode());
            };
            CHECK_EQUAL(wheels_at(0.399 - highest), 4);
            CHECK(wheels_at(0.401 - highest) < 4);
            CHECK(wheels_at(0.399 - lowest) > 0);
            CHECK_EQUAL(wheels_at(0.401 - lowest), 0);
        }
    }
}

TEST(a_lap_comes_before_off_track_and_off_track_before_standing) {
    Judge car(test::circuit());
    const double length = car.track().length;
    car.begin(car.pose_at(0.0));
    for (int i = 1; i < 100; ++i) car.judge_at(car.pose_at(i * 0.01 * length));
    CHECK(car.judge_at(car.pose_at(1.005 * length, 0.7)).terminated);
    CHECK(car.status() == Status::lap_complete);
    CHECK_EQUAL(car.row(kRow_is_offtrack), 1.0);

    car.begin(car.pose_at(2.0, 0.7));
    for (int i = 0; i < 15; ++i) car.judge_at(car.pose_at(2.0, 0.7));
    CHECK(car.status() == Status::off_track);
}

TEST(time_and_steps_truncate) {
    Judge timed(test::circuit(), {.laps = 1, .max_steps = 100000, .time_limit = 2.0});
    timed.begin(timed.pose_at(1.0));
    Verdict verdict{};
    int steps = 1;
    while (!verdict.truncated && !verdict.terminated)
        verdict = timed.judge_at(timed.pose_at(1.0 + 0.01 * ++steps));
    CHECK(verdict.truncated && !verdict.terminated);
    CHECK(timed.status() == Status::time_up);
    CHECK_EQUAL(steps, 30);
    CHECK_NEAR(timed.row(kRow_time), 2.0, 1e-12);

    Judge counted(test::circuit(), {.laps = 1, .max_steps = 12, .time_limit = 0.0});
    counted.begin(counted.pose_at(1.0));
    verdict = {};
    steps = 1;
    while (!verdict.truncated && !verdict.terminated)
        verdict = counted.judge_at(counted.pose_at(1.0 + 0.01 * ++steps));
    CHECK(verdict.truncated && !verdict.terminated);
    CHECK(counted.status() == Status::in_progress);
    CHECK_EQUAL(steps, 12);
}

TEST(a_frozen_car_pauses_and_its_counters_with_it) {
    Judge car(test::circuit());
    car.begin(car.pose_at(1.0));
    car.judge_at(car.pose_at(1.1));
    car.episode().frozen_steps = 40;
    for (int i = 0; i < 40; ++i) {
        CHECK(!car.judge_at(car.pose_at(1.1)).terminated);
        CHECK(car.status() == Status::pause);
        CHECK_NEAR(car.row(kRow_progress), 0.1 / car.track().length, 1e-6);
    }
    CHECK(!car.judge_at(car.pose_at(1.2)).terminated);
    CHECK(car.status() == Status::in_progress);
    CHECK_EQUAL(car.row(kRow_steps), 43.0);
}

TEST(a_frozen_car_does_not_move_when_its_time_is_up) {
    Judge car(test::circuit(), {.laps = 1, .max_steps = 100000, .time_limit = 1.0});
    car.begin(car.pose_at(1.0));
    CHECK(car.judge_at(car.pose_at(1.1)).moves);
    car.episode().frozen_steps = 100;
    Verdict verdict{};
    while (!verdict.truncated) {
        verdict = car.judge_at(car.pose_at(1.1));
        CHECK(!verdict.moves);
    }
    CHECK(car.status() == Status::time_up);
}

TEST(the_state_for_a_critic_is_what_its_columns_say) {
    Judge car(test::circuit());
    VehicleState pose = car.pose_at(3.0, -0.2);
    const float along = pose.heading;
    pose.heading += 0.3f;
    pose.speed = 2.0f;
    pose.lateral_speed = -0.5f;
    pose.yaw_rate = 1.0f;
    pose.steering = -0.5f * kMaxSteering;
    car.begin(pose);
    const float* state = car.state();
    CHECK_EQUAL(state[kState_speed], 0.5f);
    CHECK_EQUAL(state[kState_lateral_speed], -0.5f);
    CHECK_EQUAL(state[kState_yaw_rate], 0.25f);
    CHECK_NEAR(state[kState_steering], -0.5, 1e-6);
    CHECK_NEAR(state[kState_sin_heading_error], std::sin(static_cast<double>(pose.heading - along)), 1e-2);
    CHECK_NEAR(state[kState_cos_heading_error], std::cos(static_cast<double>(pose.heading - along)), 1e-2);
    CHECK_NEAR(state[kState_half_width], 0.4, 1e-6);
    CHECK_NEAR(state[kState_offset], car.episode().projection.offset / 0.4, 1e-6);
}

TEST(a_critic_is_told_how_the_road_bends_here_and_ahead) {
    const Outline road = test::circuit();
    constexpr float per_metre = 4.0f;
    std::vector<float> curvatures(200);  // of sample i: i / 100
    for (size_t i = 0; i < curvatures.size(); ++i) curvatures[i] = 0.01f * static_cast<float>(i);
    const TrackStore store(road.view(), std::vector<float>(200, 0.8f), curvatures, per_metre);
    Judge car(road);
    Episode episode{};
    float state[kNumStateColumns];
    observe(store.geometry(), car.pose_at(2.0), episode, state);
    for (int i = 0; i < kNumCurvatures; ++i) {
        const double place = 2.0 + static_cast<double>(kCurvatureAhead[i]);
        CHECK_NEAR(state[kState_curvature_0 + i], 0.01 * place * static_cast<double>(per_metre), 1e-5);
    }
}

}  // namespace racecraft
