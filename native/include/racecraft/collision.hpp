// Who runs into whom: rectangles on the ground, tested by the car's corners, as the original does.
#pragma once

#include "racecraft/objects.hpp"

namespace racecraft {

// A rectangle on the ground: its middle, where it points, and half its length and width.
struct Footprint {
    float x, y;          // m
    float sine, cosine;  // of the heading
    float half_length;   // m, along the heading
    float half_width;    // m, across
};

RC_HD Footprint car_footprint(float x, float y, float sine, float cosine) {
    return {x, y, sine, cosine, 0.5f * kCarLength, 0.5f * kCarWidth};
}

RC_HD Footprint object_footprint(const ObjectState& object) {
    return {object.x,
            object.y,
            object.sine,
            object.cosine,
            collision_half_length(object.kind),
            collision_half_width(object.kind)};
}

RC_HD bool covers_point(const Footprint& footprint, float x, float y) {
    const float dx = x - footprint.x;
    const float dy = y - footprint.y;
    return abs_of(dx * footprint.cosine + dy * footprint.sine) <= footprint.half_length &&
           abs_of(dy * footprint.cosine - dx * footprint.sine) <= footprint.half_width;
}

// Whether a corner of `car` lies in `other`.
RC_HD bool has_corner_in(const Footprint& car, const Footprint& other) {
    const float dx = other.x - car.x;
    const float dy = other.y - car.y;
    const float reach = car.half_length + car.half_width + other.half_length + other.half_width;
    if (dx * dx + dy * dy > reach * reach) return false;
    for (int32_t corner = 0; corner < 4; ++corner) {
        const float along = (corner & 1) != 0 ? car.half_length : -car.half_length;
        const float across = (corner & 2) != 0 ? car.half_width : -car.half_width;
        if (covers_point(other, car.x + along * car.cosine - across * car.sine,
                         car.y + along * car.sine + across * car.cosine)) {
            return true;
        }
    }
    return false;
}

// Whether the two touch at all, for what may not drive into the other.
RC_HD bool do_touch(const Footprint& a, const Footprint& b) {
    return has_corner_in(a, b) || has_corner_in(b, a);
}

// Whether a place along the track is ahead of the middle of a car.
RC_HD bool is_ahead(const TrackGeometry& track, double distance, const Footprint& car) {
    const Projection at = project(track, static_cast<double>(car.x), static_cast<double>(car.y));
    return distance_ahead(track, distance, at.arc_length) > 0.0;
}

// The object that the car has run into, or -1. Between cars only the one behind is at fault: where the
// other's middle is not ahead along the track, the car is innocent.
RC_HD int32_t find_crash(const TrackGeometry& track, const Footprint& car, const ObjectsAround& around) {
    for (int32_t i = 0; i < around.count; ++i) {
        const ObjectState& object = object_at(around, i);
        if (!is_solid(object) || !has_corner_in(car, object_footprint(object))) continue;
        const bool is_static = object.kind == ObjectKind::box || object.kind == ObjectKind::parked_car;
        if (is_static || is_ahead(track, object.distance, car)) return i;
    }
    return -1;
}

}  // namespace racecraft
