// Where the cars of a race start: a staggered grid in two lanes, and no car on top of anything.
//
//        inner lane   . . [car 3] . . . . . [car 1] . . . |        >  driving direction
//        outer lane   [car 2] . . . . . [car 0] . . . . . |           0.75 m from one to the next
//                                                       start
//
// A car that would start on an obstacle, or just behind or before it, moves back along the track.
#pragma once

#include "racecraft/collision.hpp"

namespace racecraft {

constexpr double kGridStagger = 0.75;      // m from one place of the grid to the next, as in the original
constexpr double kSearchStep = 0.25;       // m between the places that a car without room tries
constexpr double kRacerClearance = 0.3;    // m free before and behind a car at its start, to other cars
constexpr double kSideClearance = 0.05;    // m beside which an object is in another lane
constexpr int32_t kMostSearchSteps = 800;  // 200 m

struct GridPlace {
    double arc_length;  // m
    float lane;
};

// Place number `slot` of the grid of a start; 0 is in front. On an open track the last one stands at the
// beginning of the road.
RC_HD GridPlace grid_place(const TrackGeometry& track, double start, int32_t slot, int32_t num_cars) {
    const float lane = (slot & 1) != 0 ? 1.0f : -1.0f;
    if (track.is_closed != 0) {
        const double stagger = min_of(kGridStagger, track.length / num_cars);
        return {wrap_arc_length(track, start - slot * stagger), lane};
    }
    const double stagger = min_of(kGridStagger, 0.5 * track.length / num_cars);
    return {(num_cars - 1 - slot) * stagger, lane};
}

// The slots of the cars of a race: their numbers, or drawn for every race.
RC_HD void draw_grid(bool is_shuffled, uint64_t seed, uint32_t stream, uint32_t race, int32_t num_cars,
                     int32_t* car_at) {
    for (int32_t slot = 0; slot < num_cars; ++slot) car_at[slot] = slot;
    for (int32_t slot = num_cars - 1; is_shuffled && slot > 0; --slot) {
        const RandomBlock random = philox(seed, stream, race, static_cast<uint32_t>(slot), Purpose::grid);
        const uint64_t word = random.words[0];
        const int32_t other = static_cast<int32_t>((word * static_cast<uint64_t>(slot + 1)) >> 32);
        const int32_t car = car_at[slot];
        car_at[slot] = car_at[other];
        car_at[other] = car;
    }
}

// Whether a car can start at a place. `room` scales the clearance along the track: 1 m to obstacles and bots.
RC_HD bool is_free(const TrackGeometry& track, const ObjectsAround& around, GridPlace place, double room) {
    const LanePose pose = lane_pose(track, place.arc_length, place.lane, place.lane);
    const Projection at = project(track, static_cast<double>(pose.x), static_cast<double>(pose.y));
    float sine, cosine;
    sincos_of(pose.heading, sine, cosine);
    const Footprint car = car_footprint(pose.x, pose.y, sine, cosine);
    for (int32_t i = 0; i < around.count; ++i) {
        const ObjectState& object = object_at(around, i);
        if (!is_there(object)) continue;
        const Footprint body = object_footprint(object);
        if (do_touch(car, body)) return false;
        const double clearance =
            place_in_world(around, i) < around.first_racer ? kStartClearance : kRacerClearance;
        const double along = room * clearance + static_cast<double>(car.half_length + body.half_length);
        const double across = kSideClearance + static_cast<double>(car.half_width + body.half_width);
        if (abs_of(distance_ahead(track, object.distance, at.arc_length)) < along &&
            abs_of(object.offset - at.offset) < across) {
            return false;
        }
    }
    return true;
}

// The first free place from one of the grid on: beside it, then back along the track, with less and less room
// to the others; the same place where the track is full.
RC_HD GridPlace free_place(const TrackGeometry& track, const ObjectsAround& around, GridPlace wanted) {
    const double length = track.is_closed != 0 ? track.length : wanted.arc_length;
    const int32_t back = static_cast<int32_t>(min_of(length / kSearchStep, double{kMostSearchSteps}));
    const double rest = track.is_closed != 0 ? 0.0 : 0.5 * track.length - wanted.arc_length;
    const int32_t ahead = static_cast<int32_t>(clamp(rest / kSearchStep, 0.0, double{kMostSearchSteps}));
    constexpr double rooms[3] = {1.0, 0.3, 0.0};
    for (const double room : rooms) {
        for (int32_t k = 0; k <= back + ahead; ++k) {
            const double s = wanted.arc_length + kSearchStep * (k <= back ? -k : k - back);
            const GridPlace place{wrap_arc_length(track, s), wanted.lane};
            if (is_free(track, around, place, room)) return place;
            const GridPlace beside{place.arc_length, -wanted.lane};
            if (is_free(track, around, beside, room)) return beside;
        }
    }
    return wanted;
}

}  // namespace racecraft
