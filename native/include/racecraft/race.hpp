// How races begin and go on: the one composition of a step, for the engine (native/src/engine.cpp) and for
// the kernels of a GPU (native/gpu/cars.cu).
//
//   begin   track, objects, conditions, start  ->  look  ->  prepare row
//   step    judge  ->  move  ->  bots  ->  look
//
// Each is done for all cars of a race before the next, so the order of the cars means nothing. What the two
// do differently is in a Device:
//
//   move(begin, end, commands, first, last)   physics of the cars that move, substeps [first, last)
//   aim(env)                                  new conditions: the car's cameras follow
//   see(env)                                  a new view: LIDAR and frames follow
#pragma once

#include "racecraft/cars.hpp"
#include "racecraft/grid.hpp"

namespace racecraft {

// --- commands

// Commands of cars from `first` on, as they act.
struct Commands {
    float* steering;   // rad
    float* speed;      // m/s
    float* is_moving;  // 1 where the car moves, 0 where it stands as it is
    int32_t first;
};

// Shifts the commands that a car with a latency remembers.
RC_HD void remember_command(const Batch& batch, int32_t env, float steering, float speed) {
    if (!batch.has_latency) return;
    const size_t n = static_cast<size_t>(batch.num_envs);
    float* earlier = batch.earlier + env;
    earlier[2 * n] = earlier[0];
    earlier[3 * n] = earlier[n];
    earlier[0] = steering;
    earlier[n] = speed;
}

RC_HD void forget_commands(const Batch& batch, int32_t env) {
    const size_t n = static_cast<size_t>(batch.num_envs);
    for (size_t k = 0; k < 4 && batch.has_latency; ++k)
        batch.earlier[k * n + static_cast<size_t>(env)] = 0.0f;
}

// --- the parts of a step

// Judges a car where it is, before its command acts; a car whose episode is over stands.
RC_HD bool judge_car(const Batch& batch, int32_t env, float steering_angle, float speed,
                     const Commands& commands) {
    const int32_t i = env - commands.first;
    commands.is_moving[i] = 0.0f;
    if (is_over(batch, env)) return false;
    const float steering = clamp(steering_angle, -kMaxSteeringCommand, kMaxSteeringCommand);
    const float wanted = speed == 0.0f ? 0.0f : clamp(speed, kMinSpeedCommand, kMostSpeedCommand);
    commands.steering[i] = clamp(steering, -kMaxSteering, kMaxSteering);
    commands.speed[i] = clamp(wanted, 0.0f, kMaxSpeedCommand);
    const TrackGeometry& track = track_of(batch, env);
    const VehicleState car = load_vehicle(batch, env);
    Episode& episode = batch.episodes[env];
    int32_t crashed = -1;
    if (batch.num_objects > 0) {
        const Footprint body = car_footprint(car.x, car.y, episode.sine, episode.cosine);
        crashed = find_crash(track, body, around(batch, env));
    }
    double* row = row_of(batch, env);
    const Verdict verdict = judge(track, batch.limits, car, steering, wanted, is_reversed(batch, env),
                                  crashed >= 0, episode, row);
    write_objects_of(batch, env, car, row[kRow_is_crashed] != 0.0 ? crashed : -1);
    batch.terminated[env] = verdict.terminated;
    batch.truncated[env] = verdict.truncated;
    commands.is_moving[i] = verdict.moves ? 1.0f : 0.0f;
    return verdict.moves;
}

// One control step of a race's bots. A bot waits where it would run into the back of a car that can be hit.
RC_HD void advance_bots(const Batch& batch, int32_t first) {
    Footprint cars[kMaxCarsPerRace];
    int32_t num_cars = 0;
    for (int32_t env = first; env < first + cars_per_race(batch); ++env) {
        const bool is_gone = has_racers(batch) && is_over(batch, env);
        if (is_gone || batch.episodes[env].frozen_steps > 0) continue;
        const VehicleState car = load_vehicle(batch, env);
        float sine, cosine;
        sincos_of(car.heading, sine, cosine);
        cars[num_cars++] = car_footprint(car.x, car.y, sine, cosine);
    }
    const TrackGeometry& track = track_of(batch, first);
    ObjectState* objects = world_of(batch, first / cars_per_race(batch));
    for (int32_t i = batch.rule.obstacles.count; i < first_racer(batch); ++i) {
        const Draws draws = draws_of_race(batch, first);  // here, where registers are free on a GPU
        ObjectState next = objects[i];
        advance_bot(track, batch.rule.bot, draws.seed, draws.stream, draws.episode, i, kControlDt, next);
        const Footprint body = object_footprint(next);
        bool has_to_wait = false;
        for (int32_t car = 0; car < num_cars; ++car) {
            has_to_wait |= do_touch(cars[car], body) && !is_ahead(track, next.distance, cars[car]);
        }
        if (has_to_wait) {
            objects[i].speed = 0.0f;
        } else {
            objects[i] = next;
        }
    }
}

// Where the car is for the rules of its next step, what a critic knows, and what its sensors see.
template <typename Device>
RC_HD void look(const Batch& batch, int32_t env, Device& device) {
    const TrackGeometry& track = track_of(batch, env);
    Episode& episode = batch.episodes[env];
    float* seen = state_of(batch, env);
    observe(track, load_vehicle(batch, env), episode, seen);
    if (batch.num_objects > 0) {
        observe_objects(track, around(batch, env), episode.projection.arc_length, seen + kNumStateColumns);
    }
    device.see(env);
}

// One control step of the cars [begin, end), which are whole races; actions: steering angle in rad and speed
// in m/s, interleaved (N, 2).
template <typename Device>
RC_HD void step_races(const Batch& batch, int32_t begin, int32_t end, const float* actions,
                      const Commands& commands, Device& device) {
    bool any_moving = false;
    for (int32_t env = begin; env < end; ++env) {
        any_moving |= judge_car(batch, env, actions[2 * env], actions[2 * env + 1], commands);
    }
    // Others drive on around a car that stands as a penalty, so its view changes, too; and where pictures
    // are older than the car, one that has just stopped sees the last of its way a step later.
    const bool is_lively = has_bots(batch) || has_racers(batch) || batch.picture_age > 0;
    if (!any_moving && !is_lively) return;

    const int32_t taken = batch.substeps - batch.picture_age;
    if (taken > 0) device.move(begin, end, commands, 0, taken);
    for (int32_t env = begin; env < end; ++env) {
        if (commands.is_moving[env - commands.first] != 0.0f || !is_over(batch, env)) take_sight(batch, env);
    }
    if (taken < batch.substeps) device.move(begin, end, commands, taken, batch.substeps);
    for (int32_t env = begin; env < end; ++env) {
        const int32_t i = env - commands.first;
        if (commands.is_moving[i] != 0.0f) {
            remember_command(batch, env, commands.steering[i], commands.speed[i]);
        }
        publish(batch, env);
    }
    for (int32_t first = begin; first < end; first += cars_per_race(batch)) {
        const int32_t last = first + cars_per_race(batch);
        bool is_any = false;
        for (int32_t env = first; env < last; ++env) {
            is_any |= commands.is_moving[env - commands.first] != 0.0f || !is_over(batch, env);
        }
        if (is_any && has_bots(batch)) advance_bots(batch, first);
        for (int32_t env = first; env < last; ++env) {
            const bool moves = commands.is_moving[env - commands.first] != 0.0f;
            if (moves || (is_lively && !is_over(batch, env))) look(batch, env, device);
        }
    }
}

// --- the parts of a beginning

// What is drawn for an episode and not saved, being a function of its draws.
template <typename Device>
RC_HD void draw_episode(const Batch& batch, int32_t env, Device& device) {
    if (!batch.is_randomized) return;
    const Draws draws = draws_of(batch, env);
    const Conditions drawn = draw_conditions(batch.randomization, draws.seed, draws.stream, draws.episode);
    batch.conditions[env] = drawn;
    if (batch.has_latency) {
        batch.delay[env] = static_cast<int32_t>(drawn.latency * static_cast<float>(batch.substeps) + 0.5f);
    }
    device.aim(env);
}

// A new race starts together; who comes back into one that goes on draws a start of its own.
RC_HD VehicleState start_of(const Batch& batch, int32_t env, int32_t slot, bool is_new_race) {
    const TrackGeometry& track = track_of(batch, env);
    const ObjectsAround others = around(batch, env);
    Episode& episode = batch.episodes[env];
    const Draws draws = draws_of(batch, env);
    const size_t index = static_cast<size_t>(env / cars_per_race(batch));
    const size_t count = static_cast<size_t>(batch.num_envs / cars_per_race(batch));
    if (!has_racers(batch)) return start_pose(batch.start, track, index, count, draws, others, episode.start);
    const int32_t first = env - env % cars_per_race(batch);
    episode.start =
        start_fraction(batch.start, track, index, count, is_new_race ? draws_of_race(batch, first) : draws);
    const double arc_length = episode.start * track.length;
    const GridPlace place =
        free_place(track, others, grid_place(track, arc_length, slot, cars_per_race(batch)));
    if (track.is_closed) episode.start = place.arc_length / track.length;
    return pose_at(batch.start, track, place.arc_length, place.lane, draws);
}

template <typename Device>
RC_HD void begin_episode(const Batch& batch, int32_t env, int32_t slot, bool is_new_race, int32_t track,
                         Device& device) {
    Episode& episode = batch.episodes[env];
    const int32_t number = episode.episode + 1;
    episode = Episode{};
    episode.episode = number;
    episode.track = track;
    draw_episode(batch, env, device);
    if (batch.is_randomized) {
        const Conditions& conditions = batch.conditions[env];
        const Draws draws = draws_of(batch, env);
        store_parameters(batch, env, vehicle_under(conditions, batch.vehicle));
        batch.palettes[env] = palette_under(conditions, batch.randomization, batch.colours, draws.seed,
                                            draws.stream, draws.episode);
    }
    forget_commands(batch, env);
    store_vehicle(batch, env, start_of(batch, env, slot, is_new_race));
    take_sight(batch, env);
    publish(batch, env);
}

// The prepare step: the car stands at its start and the row carries no command.
RC_HD void write_prepare_row(const Batch& batch, int32_t env) {
    Episode& episode = batch.episodes[env];
    const TrackGeometry& track = track_of(batch, env);
    const VehicleState car = load_vehicle(batch, env);
    episode.steps = 1;
    episode.status = Status::prepare;
    episode.progress = lap_difference(track, episode.projection.arc_length / track.length, episode.start);
    episode.last_x = episode.reference_x;
    episode.last_y = episode.reference_y;
    write_row(track, episode, car, 0.0f, 0.0f, wheels_on_road(track, car, episode), is_reversed(batch, env),
              row_of(batch, env));
    write_objects_of(batch, env, car, -1);
}

// The track of a new race, with its objects on it.
RC_HD int32_t lay_out(const Batch& batch, int32_t first) {
    const int32_t race = first / cars_per_race(batch);
    if (has_racers(batch)) batch.races[race] += 1;
    const int32_t number = has_racers(batch) ? batch.races[race] : batch.episodes[first].episode + 1;
    const Draws draws{batch.seeds[first], batch.streams[first], static_cast<uint32_t>(number)};
    if (batch.draws_tracks) {
        const uint64_t word = philox(draws.seed, draws.stream, draws.episode, 0, Purpose::track).words[0];
        batch.track_choice[first] =
            static_cast<int32_t>((word * static_cast<uint64_t>(batch.num_tracks)) >> 32);
    }
    const bool reversed = batch.direction == Direction::reverse ||
                          (batch.direction == Direction::alternate && (number & 1) != 0);
    const int32_t track = batch.track_choice[first] + (reversed ? batch.num_tracks : 0);
    if (first_racer(batch) > 0) {
        const ObjectRule& rule = batch.rule;
        ObjectState* objects = world_of(batch, race);
        place_group(batch.tracks[track], rule.obstacles, rule.bot, draws.seed, draws.stream, draws.episode, 0,
                    objects);
        place_group(batch.tracks[track], rule.bots, rule.bot, draws.seed, draws.stream, draws.episode,
                    rule.obstacles.count, objects);
    }
    return track;
}

// Puts cars of the race that begins with car `first` at the start of their next episode; bit k of `who` is
// car first + k. Where that is all of them, a new race begins; else they come back into the one that goes on.
template <typename Device>
RC_HD void begin_race(const Batch& batch, int32_t first, uint32_t who, Device& device) {
    if (who == 0) return;
    const int32_t num_cars = cars_per_race(batch);
    const bool is_new_race = who == (1u << num_cars) - 1u;
    const auto begins = [&](int32_t env) { return ((who >> (env - first)) & 1u) != 0; };
    const int32_t track = is_new_race ? lay_out(batch, first) : batch.episodes[first].track;
    for (int32_t env = first; env < first + num_cars; ++env) {
        if (!begins(env)) continue;
        batch.terminated[env] = batch.truncated[env] = 0;
        batch.track_choice[env] = batch.track_choice[first];
        publish_as(batch, env, batch.tracks[track], VehicleState{}, ObjectKind::gone_racer);
    }
    // From the front of the grid to its back, each finds a place beside those before it.
    int32_t car_at[kMaxCarsPerRace];
    const Draws draws = draws_of_race(batch, first);
    draw_grid(batch.start.shuffle, draws.seed, draws.stream, draws.episode, num_cars, car_at);
    for (int32_t slot = 0; slot < num_cars; ++slot) {
        const int32_t env = first + car_at[slot];
        if (begins(env)) begin_episode(batch, env, slot, is_new_race, track, device);
    }
    for (int32_t env = first; env < first + num_cars; ++env) {
        if (begins(env) || !is_over(batch, env)) look(batch, env, device);
        if (begins(env)) write_prepare_row(batch, env);
    }
}

// From now on a car draws as number env of its race in an engine of that seed, its next episode being the
// first.
RC_HD void reseed(const Batch& batch, int32_t env, uint64_t seed) {
    batch.seeds[env] = seed;
    batch.streams[env] = static_cast<uint32_t>(env % cars_per_race(batch));
    batch.episodes[env].episode = -1;
    if (has_racers(batch)) batch.races[env / cars_per_race(batch)] = -1;
}

// After a batch was loaded: what follows from the arrays that are saved.
template <typename Device>
RC_HD void restore_car(const Batch& batch, int32_t env, Device& device) {
    draw_episode(batch, env, device);
    look(batch, env, device);
}

}  // namespace racecraft
