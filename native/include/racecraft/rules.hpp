// The rules of an episode: progress, wheels on track, crashed, off track, reversed, immobilised, lap
// complete, time up.
//
// A step is judged at the pose *before* its action acts, as AWS logs it; so a row holds the pose at time t
// and the command of time t. Thresholds are the original's (simapp: markov/reset, markov/agent_ctrl).
#pragma once

#include "racecraft/track.hpp"
#include "racecraft/vehicle.hpp"

namespace racecraft {

constexpr float kReferenceAhead =
    0.14f;  // m, from the car origin to the point that x, y and progress speak of
constexpr float kRearAxleX = -0.08166f;  // m, wheel centres in the car's frame
constexpr float kFrontAxleX = 0.08231f;
constexpr float kRearHalfTrack = 0.08105f;
constexpr float kFrontHalfTrack = 0.0796f;
constexpr int32_t kReversedSteps = 15;           // consecutive steps of falling progress that end an episode
constexpr int32_t kImmobilizedSteps = 15;        // consecutive steps without movement that end an episode
constexpr double kImmobilizedDistance = 0.0003;  // m, what counts as no movement in a step

enum class Status : int32_t {
    prepare = 0,
    in_progress = 1,
    lap_complete = 2,
    crashed = 3,
    off_track = 4,
    immobilized = 5,
    reversed = 6,
    time_up = 7,
    pause = 8,
    park = 9,
};

// The judged row of a step, the only thing that rewards, logs and race rules read. All double; booleans are 0
// or 1.
#define RC_ROW_COLUMNS(X)                                                                            \
    X(episode)             /* of this car, from 0 */                                                 \
    X(steps)               /* of this episode; 1 is the prepare step */                              \
    X(x)                   /* m, 0.14 m ahead of the car origin */                                   \
    X(y)                   /* m */                                                                   \
    X(heading)             /* rad */                                                                 \
    X(steering_angle)      /* rad, commanded */                                                      \
    X(speed)               /* m/s, commanded */                                                      \
    X(progress)            /* fraction of a lap since the start of the lap */                        \
    X(offset)              /* m, signed distance from the centre line, left positive */              \
    X(projection_distance) /* m, along the centre line */                                            \
    X(track_width)         /* m, beside the place on the centre line */                              \
    X(track_length)        /* m */                                                                   \
    X(closest_prev)        /* waypoint index */                                                      \
    X(closest_next)        /* waypoint index */                                                      \
    X(all_wheels_on_track)                                                                           \
    X(is_offtrack)                                                                                   \
    X(is_crashed)                                                                                    \
    X(is_reversed)           /* the car races against the route's own direction */                   \
    X(status)                /* Status */                                                            \
    X(time)                  /* s since the episode began */                                         \
    X(track_index)           /* into the simulation's tracks; reversed twins follow the originals */ \
    X(actual_speed)          /* m/s */                                                               \
    X(actual_steering_angle) /* rad */                                                               \
    X(lap)                   /* laps completed in this episode */

enum RowColumn : int {
#define RC_INDEX(name) kRow_##name,
    RC_ROW_COLUMNS(RC_INDEX)
#undef RC_INDEX
        kNumRowColumns
};

// What a critic may know beyond the camera: the state at the current pose, scaled to about unit size.
#define RC_STATE_COLUMNS(X)                                             \
    X(speed)             /* over 4 m/s */                               \
    X(lateral_speed)     /* m/s */                                      \
    X(yaw_rate)          /* over 4 rad/s */                             \
    X(steering)          /* over 30 degrees */                          \
    X(offset)            /* over half the track width, left positive */ \
    X(sin_heading_error) /* against the centre line */                  \
    X(cos_heading_error)                                                \
    X(half_width)  /* m */                                              \
    X(curvature_0) /* 1/m, of the centre line here, left positive */    \
    X(curvature_1) /* and further ahead, see kCurvatureAhead */         \
    X(curvature_2)                                                      \
    X(curvature_3)                                                      \
    X(curvature_4)                                                      \
    X(curvature_5)                                                      \
    X(curvature_6)                                                      \
    X(curvature_7)

enum StateColumn : int {
#define RC_INDEX(name) kState_##name,
    RC_STATE_COLUMNS(RC_INDEX)
#undef RC_INDEX
        kNumStateColumns
};

constexpr int kNumCurvatures = kNumStateColumns - kState_curvature_0;
constexpr float kCurvatureAhead[kNumCurvatures] = {0.0f, 0.25f, 0.5f, 0.75f,
                                                   1.0f, 1.5f,  2.0f, kTableReach};  // m

// What the rules remember of a car between steps.
struct Episode {
    int32_t episode;        // of this car, from 0
    int32_t steps;          // 1 is the prepare step
    int32_t laps;           // completed in this episode
    int32_t track;          // geometry in force: index, or index + number of tracks for the reversed twin
    int32_t falling_steps;  // consecutive steps with falling progress
    int32_t still_steps;    // consecutive steps without movement
    int32_t frozen_steps;   // steps the car still stands as a penalty
    Status status;
    double progress;                  // fraction of the current lap, may exceed [0, 1) by a step
    double start;                     // arc length where the lap began, over track length
    double last_x, last_y;            // m, reference point at the previous judged step
    double reference_x, reference_y;  // m, reference point at the current pose
    float sine, cosine;               // of the heading at the current pose
    Projection projection;            // of the reference point at the current pose
};

static_assert(sizeof(Episode) == 8 * sizeof(int32_t) + 6 * sizeof(double) + 2 * sizeof(float) + 24);

struct RuleLimits {
    int32_t laps;       // laps to an episode
    int32_t max_steps;  // truncates an episode
    double time_limit;  // s; 0 for none
};

struct Verdict {
    bool terminated;
    bool truncated;
    bool moves;  // the action acts: neither terminated nor frozen
};

// How many of the four wheel centres are on the road.
RC_HD int32_t wheels_on_road(const TrackGeometry& track, const VehicleState& state, const Episode& episode) {
    int32_t wheels = 0;
    for (int i = 0; i < 4; ++i) {
        const float forward = i < 2 ? kRearAxleX : kFrontAxleX;
        const float half = i < 2 ? kRearHalfTrack : kFrontHalfTrack;
        const float left = (i & 1) != 0 ? half : -half;
        wheels +=
            is_on_road(track, static_cast<double>(state.x + (forward * episode.cosine - left * episode.sine)),
                       static_cast<double>(state.y + (forward * episode.sine + left * episode.cosine)));
    }
    return wheels;
}

// Difference of two lap fractions on the shorter way round.
RC_HD double lap_difference(const TrackGeometry& track, double to, double from) {
    const double difference = to - from;
    return track.is_closed ? difference - floor_of(difference + 0.5) : difference;
}

RC_HD void write_row(const TrackGeometry& track, const Episode& episode, const VehicleState& state,
                     float steering_command, float speed_command, int32_t wheels, bool is_reversed,
                     double* row) {
    const Projection& projection = episode.projection;
    row[kRow_episode] = episode.episode;
    row[kRow_steps] = episode.steps;
    row[kRow_x] = episode.reference_x;
    row[kRow_y] = episode.reference_y;
    row[kRow_heading] = static_cast<double>(state.heading);
    row[kRow_steering_angle] = static_cast<double>(steering_command);
    row[kRow_speed] = static_cast<double>(speed_command);
    row[kRow_progress] = episode.progress;
    row[kRow_offset] = projection.offset;
    row[kRow_projection_distance] = projection.arc_length;
    row[kRow_track_width] = width_at(track, projection);
    row[kRow_track_length] = track.length;
    const int32_t waypoint = track.segments[projection.segment].waypoint;
    row[kRow_closest_prev] = waypoint;
    row[kRow_closest_next] = waypoint + 1;
    row[kRow_all_wheels_on_track] = wheels == 4;
    row[kRow_is_offtrack] = wheels == 0;
    row[kRow_is_crashed] = episode.status == Status::crashed;
    row[kRow_is_reversed] = is_reversed;
    row[kRow_status] = static_cast<int32_t>(episode.status);
    row[kRow_time] = episode.steps * (1.0 / 15.0);
    row[kRow_track_index] = episode.track;
    row[kRow_actual_speed] = static_cast<double>(state.speed);
    row[kRow_actual_steering_angle] = static_cast<double>(state.steering);
    row[kRow_lap] = episode.laps;
}

// Judges the current pose with the action that is about to act and writes the step's row.
RC_HD Verdict judge(const TrackGeometry& track, const RuleLimits& limits, const VehicleState& state,
                    float steering_command, float speed_command, bool is_reversed, bool has_crashed,
                    Episode& episode, double* row) {
    const int32_t wheels = wheels_on_road(track, state, episode);
    episode.steps += 1;

    // Half a step of slack: the clock is a multiple of 1/15 s and the limit need not be.
    const double time = episode.steps * (1.0 / 15.0);
    const bool time_up = limits.time_limit > 0.0 && time >= limits.time_limit - 0.5 / 15.0;
    const bool is_frozen = episode.frozen_steps > 0;
    bool lap_complete = false;
    Verdict verdict{false, false, false};
    if (is_frozen) {
        episode.frozen_steps -= 1;
        episode.status = Status::pause;
    } else {
        // Divided, not multiplied by an inverse: at the end of an open road the quotient is 1 exactly.
        const double here =
            lap_difference(track, episode.projection.arc_length / track.length, episode.start);
        const double before = episode.progress;
        episode.progress = before + lap_difference(track, here, before);
        episode.falling_steps = episode.progress < before ? episode.falling_steps + 1 : 0;
        const double dx = episode.reference_x - episode.last_x;
        const double dy = episode.reference_y - episode.last_y;
        const bool is_still = dx * dx + dy * dy <= kImmobilizedDistance * kImmobilizedDistance;
        episode.still_steps = is_still ? episode.still_steps + 1 : 0;

        // The original's order: time up, then lap complete, then crashed, then whatever else went wrong.
        lap_complete = episode.progress >= 1.0 && !time_up;
        episode.laps += lap_complete ? 1 : 0;
        episode.status = Status::in_progress;
        if (episode.falling_steps >= kReversedSteps) episode.status = Status::reversed;
        if (episode.still_steps >= kImmobilizedSteps) episode.status = Status::immobilized;
        if (wheels == 0) episode.status = Status::off_track;
        if (has_crashed) episode.status = Status::crashed;
        if (lap_complete) episode.status = Status::lap_complete;
        verdict.terminated =
            lap_complete ? episode.laps >= limits.laps : episode.status != Status::in_progress && !time_up;
    }
    if (time_up) episode.status = Status::time_up;
    write_row(track, episode, state, steering_command, speed_command, wheels, is_reversed, row);
    if (lap_complete && !verdict.terminated) episode.progress -= 1.0;  // the next lap flies on
    verdict.truncated = !verdict.terminated && (time_up || episode.steps >= limits.max_steps);
    verdict.moves = !verdict.terminated && !is_frozen;
    episode.last_x = episode.reference_x;
    episode.last_y = episode.reference_y;
    return verdict;
}

// Looks where the car is, for the rules of the next step, and describes its state for a critic.
RC_HD void observe(const TrackGeometry& track, const VehicleState& state, Episode& episode, float* out) {
    sincos_of(state.heading, episode.sine, episode.cosine);
    episode.reference_x =
        static_cast<double>(state.x) + static_cast<double>(kReferenceAhead * episode.cosine);
    episode.reference_y = static_cast<double>(state.y) + static_cast<double>(kReferenceAhead * episode.sine);
    episode.projection = project(track, episode.reference_x, episode.reference_y);
    const Segment& segment = track.segments[episode.projection.segment];
    const float dx = static_cast<float>(segment.dx * segment.inverse_length);
    const float dy = static_cast<float>(segment.dy * segment.inverse_length);
    const float position = table_position(track, episode.projection.arc_length);
    const float half_width = 0.5f * table_at(track.width_table, position);
    out[kState_speed] = state.speed * (1.0f / kMaxSpeedCommand);
    out[kState_lateral_speed] = state.lateral_speed;
    out[kState_yaw_rate] = state.yaw_rate * 0.25f;
    out[kState_steering] = state.steering * (1.0f / kMaxSteering);
    out[kState_offset] = static_cast<float>(episode.projection.offset) / half_width;
    out[kState_sin_heading_error] = dx * episode.sine - dy * episode.cosine;
    out[kState_cos_heading_error] = dx * episode.cosine + dy * episode.sine;
    out[kState_half_width] = half_width;
    for (int i = 0; i < kNumCurvatures; ++i) {
        out[kState_curvature_0 + i] =
            table_at(track.curvature_table, position + kCurvatureAhead[i] * track.samples_per_metre);
    }
}

}  // namespace racecraft
