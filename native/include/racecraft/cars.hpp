// Where the numbers of a car lie in a batch, and what it shows to the others of its race.
#pragma once

#include "racecraft/batch.hpp"
#include "racecraft/collision.hpp"

namespace racecraft {

// Consecutive cars make a race: they share a track and a world of objects. A car that races alone is a race.
RC_HD int32_t cars_per_race(const Batch& batch) {
#if defined(__CUDACC__)
    static_cast<void>(batch);
    return 1;  // DevicePlan refuses more, and the compiler may know it
#else
    return batch.cars_per_race;
#endif
}

RC_HD bool has_racers(const Batch& batch) {
    return cars_per_race(batch) > 1;
}

RC_HD bool has_bots(const Batch& batch) {
    return batch.rule.bots.count > 0;
}

RC_HD bool is_over(const Batch& batch, int32_t env) {
    return batch.terminated[env] != 0 || batch.truncated[env] != 0;
}

RC_HD const TrackGeometry& track_of(const Batch& batch, int32_t env) {
    return batch.tracks[batch.episodes[env].track];
}

RC_HD bool is_reversed(const Batch& batch, int32_t env) {
    return batch.episodes[env].track >= batch.num_tracks;
}

RC_HD double* row_of(const Batch& batch, int32_t env) {
    return batch.rows + static_cast<size_t>(env) * static_cast<size_t>(batch.row_width);
}

RC_HD float* state_of(const Batch& batch, int32_t env) {
    return batch.state + static_cast<size_t>(env) * static_cast<size_t>(batch.state_width);
}

RC_HD VehicleState load_vehicle(const Batch& batch, int32_t env) {
    const size_t n = static_cast<size_t>(batch.num_envs);
    const float* field = batch.vehicles + env;
    return {field[0], field[n], field[2 * n], field[3 * n], field[4 * n], field[5 * n], field[6 * n]};
}

RC_HD void store_vehicle(const Batch& batch, int32_t env, const VehicleState& state) {
    const size_t n = static_cast<size_t>(batch.num_envs);
    float* field = batch.vehicles + env;
    field[0] = state.x;
    field[n] = state.y;
    field[2 * n] = state.heading;
    field[3 * n] = state.speed;
    field[4 * n] = state.lateral_speed;
    field[5 * n] = state.yaw_rate;
    field[6 * n] = state.steering;
}

// --- where a car's picture is taken from

struct Sight {
    float x, y, heading;
};

// Keeps where a car is for the picture that it takes there; nothing where pictures are as new as the car.
RC_HD void take_sight(const Batch& batch, int32_t env) {
    if (batch.picture_age == 0) return;
    const size_t n = static_cast<size_t>(batch.num_envs);
    for (size_t field = 0; field < 3; ++field)  // the first of a VehicleState
        batch.seen_from[field * n + static_cast<size_t>(env)] =
            batch.vehicles[field * n + static_cast<size_t>(env)];
}

RC_HD Sight sight_of(const Batch& batch, int32_t env) {
    const size_t n = static_cast<size_t>(batch.num_envs);
    const float* field = (batch.picture_age > 0 ? batch.seen_from : batch.vehicles) + env;
    return {field[0], field[n], field[2 * n]};
}

RC_HD void store_parameters(const Batch& batch, int32_t env, const VehicleParameters& car) {
    const size_t n = static_cast<size_t>(batch.num_envs);
    float* parameter = batch.parameters + env;
#define RC_STORE(name) parameter[kVehicle_##name * n] = car.name;
    RC_VEHICLE_PARAMETERS(RC_STORE)
#undef RC_STORE
}

// What a car's own draws are a function of.
RC_HD Draws draws_of(const Batch& batch, int32_t env) {
    return {batch.seeds[env], batch.streams[env], static_cast<uint32_t>(batch.episodes[env].episode)};
}

// And those of the race that begins with car `first`.
RC_HD Draws draws_of_race(const Batch& batch, int32_t first) {
    Draws draws = draws_of(batch, first);
    if (has_racers(batch)) draws.episode = static_cast<uint32_t>(batch.races[first / cars_per_race(batch)]);
    return draws;
}

// --- objects: a world is [obstacles | bots | the cars of its race, where there are several]

RC_HD int32_t first_racer(const Batch& batch) {
    return batch.num_objects - (cars_per_race(batch) - 1);
}

RC_HD ObjectState* world_of(const Batch& batch, int32_t race) {
    const int32_t width = first_racer(batch) + (has_racers(batch) ? cars_per_race(batch) : 0);
    return batch.objects + static_cast<size_t>(race) * static_cast<size_t>(width);
}

// The world around a car: the same without itself.
RC_HD ObjectsAround around(const Batch& batch, int32_t env) {
    const int32_t race = env / cars_per_race(batch);
    const int32_t racers = first_racer(batch);
    return {world_of(batch, race), batch.num_objects, racers, racers + env - race * cars_per_race(batch)};
}

// Shows a car to the others of its race as what it is now; nothing where it races alone.
RC_HD void publish_as(const Batch& batch, int32_t env, const TrackGeometry& track, const VehicleState& car,
                      ObjectKind kind) {
    if (!has_racers(batch)) return;
    const int32_t race = env / cars_per_race(batch);
    ObjectState& object = world_of(batch, race)[around(batch, env).own];
    object = ObjectState{};
    object.kind = kind;
    if (!is_there(object)) {  // parked far outside, as the original does it
        object.x = track.room.min_x - kParkDistance;
        object.y = track.room.min_y - kParkDistance;
        object.cosine = 1.0f;
        object.offset = static_cast<double>(kParkDistance);
        return;
    }
    const Projection at = project(track, static_cast<double>(car.x), static_cast<double>(car.y));
    object.x = car.x;
    object.y = car.y;
    object.heading = car.heading;
    sincos_of(car.heading, object.sine, object.cosine);
    object.speed = car.speed;
    object.offset = at.offset;
    object.distance = object.arc_length = at.arc_length;
}

RC_HD void publish(const Batch& batch, int32_t env) {
    if (!has_racers(batch)) return;
    const ObjectKind kind = is_over(batch, env)                    ? ObjectKind::gone_racer
                            : batch.episodes[env].frozen_steps > 0 ? ObjectKind::frozen_racer
                                                                   : ObjectKind::racer;
    publish_as(batch, env, track_of(batch, env), load_vehicle(batch, env), kind);
}

RC_HD void write_objects_of(const Batch& batch, int32_t env, const VehicleState& car, int32_t crashed) {
    if (batch.num_objects == 0) return;
    const Episode& episode = batch.episodes[env];
    const ObjectsAround seen = around(batch, env);
    const float lens_x = car.x + batch.lens_forward * episode.cosine - batch.lens_left * episode.sine;
    const float lens_y = car.y + batch.lens_forward * episode.sine + batch.lens_left * episode.cosine;
    bool in_camera = false;
    for (int32_t i = 0; i < seen.count && !in_camera; ++i) {
        const ObjectState& object = object_at(seen, i);
        in_camera = is_there(object) && is_object_in_view(object, lens_x, lens_y, episode.sine,
                                                          episode.cosine, batch.half_tangent);
    }
    const Neighbours closest = closest_objects(seen, episode.projection.arc_length);
    write_objects(seen, closest, in_camera, crashed, row_of(batch, env) + kNumRowColumns);
}

// Where a car's scan is made from. The scan of the prepare step is made before that step is counted.
RC_HD LidarPose lidar_pose_of(const Batch& batch, int32_t env) {
    const Episode& episode = batch.episodes[env];
    const VehicleState car = load_vehicle(batch, env);
    return {car.x,
            car.y,
            episode.sine,
            episode.cosine,
            batch.seeds[env],
            batch.streams[env],
            static_cast<uint32_t>(episode.episode),
            static_cast<uint32_t>(episode.steps == 1 ? 0 : episode.steps)};
}

}  // namespace racecraft
