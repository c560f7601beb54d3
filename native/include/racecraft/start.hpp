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
    bool spread;           // spaces the cars of a batch evenly along the lap
    float lateral_jitter;  // m, uniform in plus or minus
    float heading_jitter;  // rad, uniform in plus or minus
};

// What the random numbers of an episode are a function of.
struct Draws {
    uint64_t seed;
    uint32_t stream;
    uint32_t episode;
};

// Pose of car number `env` of a batch at the start of its episode; `start` becomes its fraction of the lap.
RC_HD VehicleState start_pose(const StartRule& rule, const TrackGeometry& track, size_t env, size_t num_envs,
                              const Draws& draws, const ObjectState* objects, int32_t count, double& start) {
    double fraction = rule.offset;
    if (rule.spread) fraction += static_cast<double>(env) / static_cast<double>(num_envs);
    if (rule.mode == StartMode::advance) fraction += rule.advance * static_cast<int32_t>(draws.episode);
    if (rule.mode == StartMode::random) {
        const RandomBlock place = philox(draws.seed, draws.stream, draws.episode, 0, Purpose::start_position);
        fraction = static_cast<double>(uniform_of(place.words[0]));
    }
    fraction = track.is_closed ? fraction - floor_of(fraction) : 0.0;
    start = fraction;

    const double arc_length = fraction * track.length;
    const Segment* last = track.segments + track.num_segments - 1;
    const Segment* segment = track.segments;
    while (segment < last && segment[1].arc_length <= arc_length) ++segment;
    const double along = arc_length - segment->arc_length;
    const double ux = segment->dx * segment->inverse_length;
    const double uy = segment->dy * segment->inverse_length;

    const RandomBlock random = philox(draws.seed, draws.stream, draws.episode, 0, Purpose::start_pose);
    const double lateral = static_cast<double>(rule.lateral_jitter * symmetric_of(random.words[0]));
    const float lane = start_lane(track, objects, count, arc_length);
    const LanePoint middle = lane == 0.0f ? LanePoint{segment->x + along * ux, segment->y + along * uy}
                                          : lane_point(track, arc_length, lane);
    VehicleState state{};
    state.x = static_cast<float>(middle.x - lateral * uy);
    state.y = static_cast<float>(middle.y + lateral * ux);
    state.heading = wrap_angle(atan2_of(static_cast<float>(uy), static_cast<float>(ux)) +
                               rule.heading_jitter * symmetric_of(random.words[1]));
    return state;
}

}  // namespace racecraft
