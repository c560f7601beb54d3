// How races begin: who starts where, under which conditions, and the prepare step.
#include <cstring>

#include "engine.hpp"

namespace racecraft {

Draws Engine::draws_of_race(size_t env) const {
    const size_t race = env / config_.cars_per_race;
    const size_t first = race * config_.cars_per_race;
    const int32_t number = races_.empty() ? episodes_[env].episode : races_[race];
    return {seeds_[first], streams_[first], static_cast<uint32_t>(number)};
}

// A new race starts together; who comes back into one that goes on draws a start of its own.
VehicleState Engine::start_pose(size_t env, int32_t slot, bool is_new_race) {
    const size_t num_cars = config_.cars_per_race;
    const TrackGeometry& track = track_of(env);
    const ObjectsAround around = objects_.around(env);
    Episode& episode = episodes_[env];
    const Draws draws{seeds_[env], streams_[env], static_cast<uint32_t>(episode.episode)};
    if (num_cars == 1) {
        return racecraft::start_pose(config_.start, track, env, num_envs(), draws, around, episode.start);
    }
    episode.start = start_fraction(config_.start, track, env / num_cars, num_envs() / num_cars,
                                   is_new_race ? draws_of_race(env) : draws);
    const double arc_length = episode.start * track.length;
    const GridPlace place =
        free_place(track, around, grid_place(track, arc_length, slot, static_cast<int32_t>(num_cars)));
    if (track.is_closed) episode.start = place.arc_length / track.length;
    return pose_at(config_.start, track, place.arc_length, place.lane, draws);
}

void Engine::draw_episode(size_t env) {
    const uint32_t number = static_cast<uint32_t>(episodes_[env].episode);
    conditions_[env] = draw_conditions(*randomization_, seeds_[env], streams_[env], number);
    if (!cameras_.empty()) cameras_[env].rebuild(camera_under(conditions_[env], camera_->spec()));
    if (!right_cameras_.empty()) {
        right_cameras_[env].rebuild(camera_under(conditions_[env], right_camera_->spec()));
    }
    if (!delay_.empty()) {
        delay_[env] =
            static_cast<int32_t>(conditions_[env].latency * static_cast<float>(config_.substeps) + 0.5f);
    }
}

void Engine::begin_race(size_t first, const bool* mask) {
    const size_t num_cars = config_.cars_per_race;
    const size_t end = first + num_cars;
    const auto begins = [&](size_t env) { return mask == nullptr || mask[env]; };
    bool is_new_race = true, is_any = false;
    for (size_t env = first; env < end; ++env) {
        is_new_race &= begins(env);
        is_any |= begins(env);
    }
    if (!is_any) return;

    int32_t track = episodes_[first].track;
    if (is_new_race) {
        if (!races_.empty()) races_[first / num_cars] += 1;
        const int32_t number = races_.empty() ? episodes_[first].episode + 1 : races_[first / num_cars];
        if (config_.draws_tracks) {
            const uint64_t word =
                philox(seeds_[first], streams_[first], static_cast<uint32_t>(number), 0, Purpose::track)
                    .words[0];
            track_choice_[first] = static_cast<int32_t>((word * num_tracks()) >> 32);
        }
        const bool reversed = config_.direction == Direction::reverse ||
                              (config_.direction == Direction::alternate && (number & 1) != 0);
        track = track_choice_[first] + (reversed ? static_cast<int32_t>(num_tracks()) : 0);
        const Draws draws{seeds_[first], streams_[first], static_cast<uint32_t>(number)};
        objects_.place(first / num_cars, tracks_[track].geometry(), draws);
    }
    for (size_t env = first; env < end; ++env) {
        if (!begins(env)) continue;
        terminated()[env] = truncated()[env] = false;
        track_choice_[env] = track_choice_[first];
        objects_.publish(env, tracks_[track].geometry(), VehicleState{}, ObjectKind::gone_racer);
    }

    // From the front of the grid to its back, each finds a place beside those before it.
    int32_t car_at[kMaxCarsPerRace];
    const Draws draws = draws_of_race(first);
    draw_grid(config_.start.shuffle, draws.seed, draws.stream, draws.episode, static_cast<int32_t>(num_cars),
              car_at);
    for (size_t slot = 0; slot < num_cars; ++slot) {
        const size_t env = first + static_cast<size_t>(car_at[slot]);
        if (begins(env)) begin_episode(env, static_cast<int32_t>(slot), is_new_race, track);
    }
    for (size_t env = first; env < end; ++env) {
        if (begins(env)) {
            look(env);
            write_prepare_row(env);
        } else if (!is_over(env)) {
            look(env);
        }
    }
}

void Engine::begin_episode(size_t env, int32_t slot, bool is_new_race, int32_t track) {
    Episode& episode = episodes_[env];
    const int32_t number = episode.episode + 1;
    episode = Episode{};
    episode.episode = number;
    episode.track = track;
    if (randomization_ != nullptr) {
        draw_episode(env);
        const VehicleParameters car = vehicle_under(conditions_[env], vehicle_);
        float values[kNumVehicleParameters];
        std::memcpy(values, &car, sizeof(values));
        for (size_t k = 0; k < kNumVehicleParameters; ++k) parameters_[k * num_envs() + env] = values[k];
        palettes_[env] = palette_under(conditions_[env], *randomization_, colours_, seeds_[env],
                                       streams_[env], static_cast<uint32_t>(number));
        forget_commands(env);
    }
    store_vehicle(env, start_pose(env, slot, is_new_race));
    publish(env);
}

// The prepare step: the car stands at its start and the row carries no command.
void Engine::write_prepare_row(size_t env) {
    Episode& episode = episodes_[env];
    const TrackGeometry& track = track_of(env);
    const VehicleState state = vehicle(env);
    episode.steps = 1;
    episode.status = Status::prepare;
    episode.progress = lap_difference(track, episode.projection.arc_length / track.length, episode.start);
    episode.last_x = episode.reference_x;
    episode.last_y = episode.reference_y;
    write_row(track, episode, state, 0.0f, 0.0f, wheels_on_road(track, state, episode), is_reversed(env),
              &rows_[env * row_width()]);
    objects_.write_row(env, episode, state, -1, &rows_[env * row_width() + kNumRowColumns]);
}

}  // namespace racecraft
