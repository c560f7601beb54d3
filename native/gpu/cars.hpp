// One car's part of a step, as the engine's (native/src/engine.cpp) composes it from the same functions.
#pragma once

#include "racecraft/batch.hpp"
#include "racecraft/collision.hpp"

namespace racecraft {

RC_HD const TrackGeometry& track_of(const Batch& batch, int32_t env) {
    return batch.tracks[batch.episodes[env].track];
}

RC_HD bool is_reversed(const Batch& batch, int32_t env) {
    return batch.episodes[env].track >= batch.num_tracks;
}

RC_HD ObjectState* objects_of(const Batch& batch, int32_t env) {
    return batch.objects + static_cast<size_t>(env) * static_cast<size_t>(batch.num_objects);
}

// What the car has around it; on a GPU every car races alone.
RC_HD ObjectsAround around(const Batch& batch, int32_t env) {
    return {objects_of(batch, env), batch.num_objects, batch.num_objects, batch.num_objects};
}

RC_HD double* row_of(const Batch& batch, int32_t env) {
    return batch.rows + static_cast<size_t>(env) * static_cast<size_t>(batch.row_width);
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

RC_HD void write_objects_of(const Batch& batch, int32_t env, const VehicleState& car, int32_t crashed) {
    if (batch.num_objects == 0) return;
    const Episode& episode = batch.episodes[env];
    const ObjectsAround seen = around(batch, env);
    const float lens_x = car.x + batch.lens_forward * episode.cosine - batch.lens_left * episode.sine;
    const float lens_y = car.y + batch.lens_forward * episode.sine + batch.lens_left * episode.cosine;
    bool in_camera = false;
    for (int32_t i = 0; i < seen.count && !in_camera; ++i) {
        in_camera = is_object_in_view(object_at(seen, i), lens_x, lens_y, episode.sine, episode.cosine,
                                      batch.half_tangent);
    }
    const Neighbours closest = closest_objects(seen, episode.projection.arc_length);
    write_objects(seen, closest, in_camera, crashed, row_of(batch, env) + kNumRowColumns);
}

// What a critic sees, and where the car is for the rules of the next step. Frame and LIDAR follow in kernels
// of their own.
RC_HD void look(const Batch& batch, int32_t env, const VehicleState& car) {
    float* seen = batch.state + static_cast<size_t>(env) * static_cast<size_t>(batch.state_width);
    Episode& episode = batch.episodes[env];
    const TrackGeometry& track = track_of(batch, env);
    observe(track, car, episode, seen);
    if (batch.num_objects > 0) {
        observe_objects(track, around(batch, env), episode.projection.arc_length, seen + kNumStateColumns);
    }
    batch.is_changed[env] = 1;
}

// Conditions, camera and latency of an episode, all of them functions of its draws.
RC_HD void draw_conditions_of(const Batch& batch, int32_t env, const Draws& draws) {
    const Conditions drawn = draw_conditions(batch.randomization, draws.seed, draws.stream, draws.episode);
    batch.conditions[env] = drawn;
    if (batch.has_cameras) {
        const CameraSpec spec = camera_under(drawn, batch.lenses[0].spec);
        uint8_t* block =
            batch.camera_tables + static_cast<size_t>(env) * static_cast<size_t>(batch.camera_bytes);
        batch.cameras[env] = fill_camera(spec, tables_in(block, spec.height));
    }
    if (batch.has_latency) {
        batch.delay[env] = static_cast<int32_t>(drawn.latency * static_cast<float>(batch.substeps) + 0.5f);
    }
}

RC_HD void draw_episode(const Batch& batch, int32_t env, const Draws& draws) {
    draw_conditions_of(batch, env, draws);
    const Conditions& drawn = batch.conditions[env];
    const size_t n = static_cast<size_t>(batch.num_envs);
    const VehicleParameters car = vehicle_under(drawn, batch.vehicle);
    float* parameter = batch.parameters + env;
#define RC_STORE(name) parameter[kVehicle_##name * n] = car.name;
    RC_VEHICLE_PARAMETERS(RC_STORE)
#undef RC_STORE
    batch.palettes[env] =
        palette_under(drawn, batch.randomization, batch.colours, draws.seed, draws.stream, draws.episode);
    for (size_t k = 0; k < 4 && batch.has_latency; ++k)
        batch.earlier[k * n + static_cast<size_t>(env)] = 0.0f;
}

RC_HD void begin_episode(const Batch& batch, int32_t env) {
    Episode& episode = batch.episodes[env];
    const int32_t number = episode.episode + 1;
    const Draws draws{batch.seeds[env], batch.streams[env], static_cast<uint32_t>(number)};
    episode = Episode{};
    episode.episode = number;
    if (batch.draws_tracks) {
        const uint64_t word = philox(draws.seed, draws.stream, draws.episode, 0, Purpose::track).words[0];
        batch.track_choice[env] =
            static_cast<int32_t>((word * static_cast<uint64_t>(batch.num_tracks)) >> 32);
    }
    if (batch.is_randomized) draw_episode(batch, env, draws);
    const bool reversed = batch.direction == Direction::reverse ||
                          (batch.direction == Direction::alternate && (number & 1) != 0);
    episode.track = batch.track_choice[env] + (reversed ? batch.num_tracks : 0);
    const TrackGeometry& track = track_of(batch, env);
    ObjectState* objects = objects_of(batch, env);
    if (batch.num_objects > 0) {
        place_group(track, batch.rule.obstacles, batch.rule.bot, draws.seed, draws.stream, draws.episode, 0,
                    objects);
        place_group(track, batch.rule.bots, batch.rule.bot, draws.seed, draws.stream, draws.episode,
                    batch.rule.obstacles.count, objects);
    }
    const VehicleState car =
        start_pose(batch.start, track, static_cast<size_t>(env), static_cast<size_t>(batch.num_envs), draws,
                   around(batch, env), episode.start);
    store_vehicle(batch, env, car);
    look(batch, env, car);

    episode.steps = 1;
    episode.status = Status::prepare;
    episode.progress = lap_difference(track, episode.projection.arc_length / track.length, episode.start);
    episode.last_x = episode.reference_x;
    episode.last_y = episode.reference_y;
    write_row(track, episode, car, 0.0f, 0.0f, wheels_on_road(track, car, episode), is_reversed(batch, env),
              row_of(batch, env));
    write_objects_of(batch, env, car, -1);
    batch.terminated[env] = 0;
    batch.truncated[env] = 0;
}

// One control step of physics.
RC_HD VehicleState advance_vehicle(const Batch& batch, int32_t env, VehicleState car, float steering,
                                   float speed) {
    const size_t n = static_cast<size_t>(batch.num_envs);
    const float* parameter = batch.parameters + env;
    const float sim_dt = kControlDt / static_cast<float>(batch.substeps);
#define RC_LOAD(name) parameter[kVehicle_##name * n],
    const VehicleConstants constants = vehicle_constants({RC_VEHICLE_PARAMETERS(RC_LOAD)});
#undef RC_LOAD
    int32_t delay = 0;
    float earlier[4] = {};
    if (batch.has_latency) {
        delay = batch.delay[env];
        for (size_t k = 0; k < 4; ++k) earlier[k] = batch.earlier[k * n + static_cast<size_t>(env)];
    }
    for (int32_t substep = 0; substep < batch.substeps; ++substep) {
        const bool acts = substep >= delay;
        const bool acts_before = substep >= delay - batch.substeps;
        const float steering_now = acts ? steering : (acts_before ? earlier[0] : earlier[2]);
        const float speed_now = acts ? speed : (acts_before ? earlier[1] : earlier[3]);
        car = vehicle_substep(constants, car, steering_now, speed_now, sim_dt);
    }
    if (batch.has_latency) {
        float* kept = batch.earlier + env;
        kept[2 * n] = earlier[0];
        kept[3 * n] = earlier[1];
        kept[0] = steering;
        kept[n] = speed;
    }
    return car;
}

// One control step of the bots; a bot waits where it would run into the back of a car that can be hit.
RC_HD void advance_bots(const Batch& batch, int32_t env, const VehicleState& car) {
    const TrackGeometry& track = track_of(batch, env);
    const Episode& episode = batch.episodes[env];
    ObjectState* objects = objects_of(batch, env);
    float sine, cosine;
    sincos_of(car.heading, sine, cosine);
    const Footprint body = car_footprint(car.x, car.y, sine, cosine);
    const bool is_solid = episode.frozen_steps == 0;
    for (int32_t i = batch.rule.obstacles.count; i < batch.num_objects; ++i) {
        ObjectState next = objects[i];
        advance_bot(track, batch.rule.bot, batch.seeds[env], batch.streams[env],
                    static_cast<uint32_t>(episode.episode), i, kControlDt, next);
        if (is_solid && do_touch(body, object_footprint(next)) && !is_ahead(track, next.distance, body)) {
            objects[i].speed = 0.0f;
        } else {
            objects[i] = next;
        }
    }
}

// Judge, move, look. A car whose episode is over stands.
RC_HD void step_car(const Batch& batch, int32_t env, float steering_angle, float speed) {
    if (batch.terminated[env] || batch.truncated[env]) return;
    const TrackGeometry& track = track_of(batch, env);
    Episode& episode = batch.episodes[env];
    VehicleState car = load_vehicle(batch, env);
    const float steering = clamp(steering_angle, -kMaxSteering, kMaxSteering);
    const float wanted = speed == 0.0f ? 0.0f : clamp(speed, kMinSpeedCommand, kMaxSpeedCommand);
    int32_t crashed = -1;
    if (batch.num_objects > 0) {
        crashed =
            find_crash(track, car_footprint(car.x, car.y, episode.sine, episode.cosine), around(batch, env));
    }
    double* row = row_of(batch, env);
    const Verdict verdict = judge(track, batch.limits, car, steering, wanted, is_reversed(batch, env),
                                  crashed >= 0, episode, row);
    write_objects_of(batch, env, car, row[kRow_is_crashed] != 0.0 ? crashed : -1);
    batch.terminated[env] = verdict.terminated;
    batch.truncated[env] = verdict.truncated;
    if (verdict.moves) {
        car = advance_vehicle(batch, env, car, steering, wanted);
        store_vehicle(batch, env, car);
    }
    const bool has_bots = batch.rule.bots.count > 0;
    const bool lives = has_bots && !verdict.terminated && !verdict.truncated;
    if (!verdict.moves && !lives) return;
    if (has_bots) advance_bots(batch, env, car);
    look(batch, env, car);
}

RC_HD void restore_car(const Batch& batch, int32_t env) {
    const Draws draws{batch.seeds[env], batch.streams[env],
                      static_cast<uint32_t>(batch.episodes[env].episode)};
    if (batch.is_randomized) draw_conditions_of(batch, env, draws);
    look(batch, env, load_vehicle(batch, env));
}

}  // namespace racecraft
