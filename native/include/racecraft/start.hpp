// Where an episode starts.
#pragma once

#include "racecraft/objects.hpp"

namespace racecraft {

enum class StartMode : int32_t { fixed = 0, advance = 1, random = 2 };
enum class Direction : int32_t { forward = 0, reverse = 1, alternate = 2 };

// Where an episode starts, as a fraction of a lap; an open track always starts at its beginning.
struct StartRule {
    StartMode mode;
    double offset;         // of the first episode
    double advance;        // added with every episode of a car (mode advance)
    bool spread;           // spaces the races of a batch evenly along the lap
    float lateral_jitter;  // m, uniform in plus or minus
    float heading_jitter;  // rad, uniform in plus or minus
    bool shuffle = false;  // draws who starts where in the grid of a race
};

// What the random numbers of an episode are a function of.
struct Draws {
    uint64_t seed;
    uint32_t stream;
    uint32_t episode;
};

// Where number `index` of `count` races starts, as a fraction of the lap.
RC_HD double start_fraction(const StartRule& rule, const TrackGeometry& track, size_t index, size_t count,
                            const Draws& draws) {
    double fraction = rule.offset;
    if (rule.spread) fraction += static_cast<double>(index) / static_cast<double>(count);
    if (rule.mode == StartMode::advance) fraction += rule.advance * static_cast<int32_t>(draws.episode);
    if (rule.mode == StartMode::random) {
        const RandomBlock place = philox(draws.seed, draws.stream, draws.episode, 0, Purpose::start_position);
        fraction = static_cast<double>(uniform_of(place.words[0]));
    }
    return track.is_closed ? fraction - floor_of(fraction) : 0.0;
}

// Pose of a car that starts at a place of the track, in a lane or, with 0, on the centre line.
RC_HD VehicleState pose_at(const StartRule& rule, const TrackGeometry& track, double arc_length, float lane,
                           const Draws& draws) {
    const Segment* last = track.segments + track.num_segments - 1;
    const Segment* segment = track.segments;
    while (segment < last && segment[1].arc_length <= arc_length) ++segment;
    const double along = arc_length - segment->arc_length;
    const double ux = segment->dx * segment->inverse_length;
    const double uy = segment->dy * segment->inverse_length;

    const RandomBlock random = philox(draws.seed, draws.stream, draws.episode, 0, Purpose::start_pose);
    const double lateral = static_cast<double>(rule.lateral_jitter * symmetric_of(random.words[0]));
    const LanePoint middle = lane == 0.0f ? LanePoint{segment->x + along * ux, segment->y + along * uy}
                                          : lane_point(track, arc_length, lane);
    VehicleState state{};
    state.x = static_cast<float>(middle.x - lateral * uy);
    state.y = static_cast<float>(middle.y + lateral * ux);
    state.heading = wrap_angle(atan2_of(static_cast<float>(uy), static_cast<float>(ux)) +
                               rule.heading_jitter * symmetric_of(random.words[1]));
    return state;
}

// Pose of car number `env` of a batch, racing alone, at the start of its episode; `start` becomes its
// fraction of the lap.
RC_HD VehicleState start_pose(const StartRule& rule, const TrackGeometry& track, size_t env, size_t num_envs,
                              const Draws& draws, const ObjectsAround& around, double& start) {
    start = start_fraction(rule, track, env, num_envs, draws);
    const double arc_length = start * track.length;
    return pose_at(rule, track, arc_length, start_lane(track, around, arc_length), draws);
}

}  // namespace racecraft
