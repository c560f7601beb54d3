#include "engine.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <stdexcept>

#include "exposure_kernel.hpp"
#include "lidar_kernel.hpp"
#include "object_painter_kernel.hpp"
#include "vehicle_kernel.hpp"

namespace racecraft {

Engine::Engine(const EngineConfig& config, std::vector<TrackStore> tracks,
               std::vector<std::shared_ptr<const GroundMap>> grounds, const VehicleParameters& vehicle,
               const CameraSpec* camera, const GreyPalette& palette, const Randomization* randomization,
               const RgbPalette& colours)
    : config_(config),
      tracks_(std::move(tracks)),
      grounds_(std::move(grounds)),
      objects_(config.objects, config.num_envs, config.cars_per_race, camera),
      pool_(config.num_threads),
      colours_(colours),
      vehicle_(vehicle) {
    const size_t n = config_.num_envs;
    vehicles_.resize(kNumVehicleFields * n);
    parameters_.resize(kNumVehicleParameters * n);
    steering_command_.resize(n);
    speed_command_.resize(n);
    is_moving_.resize(n);
    state_.resize(state_width() * n);
    rows_.resize(row_width() * n);
    if (config_.has_lidar) lidar_.resize(kLidarRays * n);
    episodes_.resize(n);
    track_choice_.resize(n);
    seeds_.assign(n, config_.seed);
    streams_.resize(n);
    palettes_.assign(n, palette);
    if (config_.cars_per_race > 1) races_.assign(n / config_.cars_per_race, -1);
    flags_ = std::make_unique<bool[]>(2 * n);

    float values[kNumVehicleParameters];
    std::memcpy(values, &vehicle, sizeof(values));
    for (size_t env = 0; env < n; ++env) {
        for (int k = 0; k < kNumVehicleParameters; ++k) parameters_[k * n + env] = values[k];
        track_choice_[env] = static_cast<int32_t>(env / config_.cars_per_race % num_tracks());
        streams_[env] = static_cast<uint32_t>(env);
        episodes_[env].episode = -1;
    }
    if (camera != nullptr) {
        CameraSpec spec = *camera;
        spec.left = camera->left + 0.5f * config_.baseline;
        camera_ = std::make_unique<CameraModel>(spec);
        spec.left = camera->left - 0.5f * config_.baseline;
        if (config_.baseline != 0.0f) right_camera_ = std::make_unique<CameraModel>(spec);
        frames_.resize(num_lenses() * n * static_cast<size_t>(spec.width) * static_cast<size_t>(spec.height));
    }
    if (randomization != nullptr) {
        randomization_ = std::make_unique<Randomization>(*randomization);
        conditions_.resize(n);
        if (randomization->has_latency()) {
            delay_.resize(n);
            earlier_.resize(4 * n);
        }
        const bool has_cameras = camera != nullptr && randomization->has_cameras();
        for (size_t env = 0; has_cameras && env < n; ++env) cameras_.emplace_back(*camera);
        for (size_t env = 0; has_cameras && right_camera_ != nullptr && env < n; ++env) {
            right_cameras_.emplace_back(*camera);
        }
    }
    reset(nullptr);
}

void Engine::store_vehicle(size_t env, const VehicleState& state) {
    float values[kNumVehicleFields];
    std::memcpy(values, &state, sizeof(state));
    for (size_t k = 0; k < kNumVehicleFields; ++k) vehicles_[k * num_envs() + env] = values[k];
}

void Engine::publish(size_t env) {
    if (!objects_.has_racers()) return;
    const ObjectKind kind = is_over(env)                      ? ObjectKind::gone_racer
                            : episodes_[env].frozen_steps > 0 ? ObjectKind::frozen_racer
                                                              : ObjectKind::racer;
    objects_.publish(env, track_of(env), vehicle(env), kind);
}

void Engine::show_others(size_t env) {
    if (!objects_.has_racers()) return;
    publish(env);
    const size_t first = env / config_.cars_per_race * config_.cars_per_race;
    for (size_t other = first; other < first + config_.cars_per_race; ++other) {
        if (other != env && !is_over(other)) look(other);
    }
}

void Engine::move_bots(size_t first) {
    Footprint cars[kMaxCarsPerRace];
    int32_t num_cars = 0;
    for (size_t env = first; env < first + config_.cars_per_race; ++env) {
        const bool is_gone = objects_.has_racers() && is_over(env);
        if (is_gone || episodes_[env].frozen_steps > 0) continue;
        const VehicleState car = vehicle(env);
        float sine, cosine;
        sincos_of(car.heading, sine, cosine);
        cars[num_cars++] = car_footprint(car.x, car.y, sine, cosine);
    }
    objects_.advance(first / config_.cars_per_race, track_of(first), draws_of_race(first), cars, num_cars);
}

void Engine::look(size_t env) {
    const VehicleState state = vehicle(env);
    float* seen = &state_[env * state_width()];
    observe(track_of(env), state, episodes_[env], seen);
    objects_.observe(env, track_of(env), episodes_[env], seen + kNumStateColumns);
    if (config_.has_lidar) {
        const Episode& episode = episodes_[env];
        const LidarPose pose{state.x,
                             state.y,
                             episode.sine,
                             episode.cosine,
                             seeds_[env],
                             streams_[env],
                             static_cast<uint32_t>(episode.episode),
                             static_cast<uint32_t>(episode.steps)};
        RC_DISPATCH(scan_lidar, track_of(env).room, pose, objects_.around(env), &lidar_[env * kLidarRays]);
    }
    if (camera_ == nullptr) return;
    const size_t pixels = frames_.size() / (num_envs() * num_lenses());
    uint8_t* frame = &frames_[env * num_lenses() * pixels];
    render(cameras_.empty() ? *camera_ : cameras_[env], env, state, frame);
    if (right_camera_ != nullptr) {
        render(right_cameras_.empty() ? *right_camera_ : right_cameras_[env], env, state, frame + pixels);
    }
}

void Engine::render(const CameraModel& camera, size_t env, const VehicleState& state, uint8_t* frame) {
    const GroundMap& ground = *grounds_[static_cast<size_t>(episodes_[env].track) % num_tracks()];
    render_grey(camera, ground, palettes_[env], state.x, state.y, state.heading, frame);
    if (objects_.count() > 0) {
        const LensPose lens = place_lens(camera.view(), ground.view(), state.x, state.y, state.heading);
        RC_DISPATCH(draw_objects, camera.spec(), lens, objects_.around(env), frame);
    }
    if (randomization_ != nullptr) {
        const Conditions& light = conditions_[env];
        RC_DISPATCH(expose, frame, camera.spec().width, camera.spec().height, light.gradient_across,
                    light.gradient_down, light.blur);
    }
}

// Cars to a portion of work: whole races.
size_t Engine::chunk_size(size_t most) const {
    const size_t parts = 4 * static_cast<size_t>(pool_.num_threads());
    const size_t cars = std::clamp((num_envs() + parts - 1) / parts, size_t{1}, most);
    return (cars + config_.cars_per_race - 1) / config_.cars_per_race * config_.cars_per_race;
}

void Engine::reset(const bool* mask, const uint64_t* seeds) {
    const std::lock_guard lock(mutex_);
    const size_t chunk = chunk_size(kLanes);
    pool_.for_each((num_envs() + chunk - 1) / chunk, [&](size_t part) {
        const size_t end = std::min((part + 1) * chunk, num_envs());
        for (size_t env = part * chunk; env < end && seeds != nullptr; ++env) {
            if (mask != nullptr && !mask[env]) continue;
            seeds_[env] = seeds[env];
            streams_[env] = static_cast<uint32_t>(env % config_.cars_per_race);
            episodes_[env].episode = -1;
            if (!races_.empty()) races_[env / config_.cars_per_race] = -1;
        }
        for (size_t env = part * chunk; env < end; env += config_.cars_per_race) begin_race(env, mask);
    });
}

void Engine::step_chunk(size_t begin, size_t end, const float* actions) {
    const size_t n = num_envs();
    bool any_moving = false;
    for (size_t env = begin; env < end; ++env) {
        is_moving_[env] = 0.0f;
        if (terminated()[env] || truncated()[env]) continue;
        const float steering = clamp(actions[2 * env], -kMaxSteering, kMaxSteering);
        const float speed = actions[2 * env + 1];
        steering_command_[env] = steering;
        speed_command_[env] = speed == 0.0f ? 0.0f : clamp(speed, kMinSpeedCommand, kMaxSpeedCommand);
        double* row = &rows_[env * row_width()];
        const VehicleState car = vehicle(env);
        const int32_t crashed = objects_.find_crash(env, track_of(env), episodes_[env], car);
        const Verdict verdict = judge(track_of(env), config_.limits, car, steering, speed_command_[env],
                                      is_reversed(env), crashed >= 0, episodes_[env], row);
        const bool has_crashed = row[kRow_is_crashed] != 0.0;
        objects_.write_row(env, episodes_[env], car, has_crashed ? crashed : -1, row + kNumRowColumns);
        terminated()[env] = verdict.terminated;
        truncated()[env] = verdict.truncated;
        is_moving_[env] = verdict.moves ? 1.0f : 0.0f;
        any_moving |= verdict.moves;
    }
    if (!any_moving && !objects_.has_bots() && !objects_.has_racers()) return;

    float* fields = vehicles_.data();
    const VehicleArrays arrays{fields,
                               fields + n,
                               fields + 2 * n,
                               fields + 3 * n,
                               fields + 4 * n,
                               fields + 5 * n,
                               fields + 6 * n,
                               steering_command_.data(),
                               speed_command_.data(),
                               is_moving_.data(),
                               parameters_.data(),
                               n,
                               delay_.empty() ? nullptr : delay_.data(),
                               earlier_.empty() ? nullptr : earlier_.data()};
    for (size_t env = begin; env < end; env += kLanes) {
        const int count = static_cast<int>(std::min(end - env, size_t{kLanes}));
        RC_DISPATCH(advance_vehicles, arrays, env, count, config_.substeps);
    }
    for (size_t env = begin; env < end; ++env) {
        if (is_moving_[env] != 0.0f && !earlier_.empty()) {
            earlier_[2 * n + env] = earlier_[env];
            earlier_[3 * n + env] = earlier_[n + env];
            earlier_[env] = steering_command_[env];
            earlier_[n + env] = speed_command_[env];
        }
        publish(env);
    }
    // Others drive on around a car that stands as a penalty, so its view changes, too.
    const bool is_lively = objects_.has_bots() || objects_.has_racers();
    for (size_t first = begin; first < end; first += config_.cars_per_race) {
        bool is_any = false;
        for (size_t env = first; env < first + config_.cars_per_race; ++env) {
            is_any |= is_moving_[env] != 0.0f || !is_over(env);
        }
        if (is_any && objects_.has_bots()) move_bots(first);
        for (size_t env = first; env < first + config_.cars_per_race; ++env) {
            if (is_moving_[env] != 0.0f || (is_lively && !is_over(env))) look(env);
        }
    }
}

void Engine::step(const float* actions) {
    const std::lock_guard lock(mutex_);
    // With a camera a car costs microseconds, without one nanoseconds: hand out work in matching portions.
    const size_t chunk = chunk_size(camera_ != nullptr ? kLanes : 64 * kLanes);
    pool_.for_each((num_envs() + chunk - 1) / chunk, [&](size_t part) {
        step_chunk(part * chunk, std::min((part + 1) * chunk, num_envs()), actions);
    });
}

void Engine::set_pose(size_t env, float x, float y, float heading, float speed) {
    const std::lock_guard lock(mutex_);
    VehicleState state{};
    state.x = x;
    state.y = y;
    state.heading = wrap_angle(heading);
    state.speed = speed;
    store_vehicle(env, state);
    forget_commands(env);
    Episode& episode = episodes_[env];
    episode.falling_steps = 0;
    episode.still_steps = 0;
    terminated()[env] = false;
    truncated()[env] = false;
    look(env);
    episode.last_x = episode.reference_x;
    episode.last_y = episode.reference_y;
    show_others(env);
}

void Engine::forget_commands(size_t env) {
    for (size_t k = 0; k < 4 && !earlier_.empty(); ++k) earlier_[k * num_envs() + env] = 0.0f;
}

void Engine::freeze(size_t env, int steps) {
    const std::lock_guard lock(mutex_);
    episodes_[env].frozen_steps = steps;
    show_others(env);
}

template <typename Visitor>
void Engine::visit_saved(Visitor&& visit) {
    visit(vehicles_.data(), vehicles_.size() * sizeof(float));
    visit(parameters_.data(), parameters_.size() * sizeof(float));
    visit(state_.data(), state_.size() * sizeof(float));
    visit(rows_.data(), rows_.size() * sizeof(double));
    visit(episodes_.data(), episodes_.size() * sizeof(Episode));
    visit(track_choice_.data(), track_choice_.size() * sizeof(int32_t));
    visit(races_.data(), races_.size() * sizeof(int32_t));
    visit(seeds_.data(), seeds_.size() * sizeof(uint64_t));
    visit(streams_.data(), streams_.size() * sizeof(uint32_t));
    visit(palettes_.data(), palettes_.size() * sizeof(GreyPalette));
    visit(objects_.states().data(), objects_.states().size() * sizeof(ObjectState));
    visit(earlier_.data(), earlier_.size() * sizeof(float));
    visit(flags_.get(), 2 * num_envs() * sizeof(bool));
}

size_t Engine::num_bytes() const {
    size_t bytes = frames_.size() + lidar_.size() * sizeof(float) + is_moving_.size() * sizeof(float) +
                   steering_command_.size() * sizeof(float) + speed_command_.size() * sizeof(float);
    const_cast<Engine*>(this)->visit_saved([&](const void*, size_t size) { bytes += size; });
    bytes += conditions_.size() * sizeof(Conditions) + delay_.size() * sizeof(int32_t);
    for (const CameraModel& camera : cameras_) bytes += camera.num_bytes();
    for (const CameraModel& camera : right_cameras_) bytes += camera.num_bytes();
    return bytes;
}

std::vector<uint8_t> Engine::save() const {
    const std::lock_guard lock(mutex_);
    return snapshot();
}

std::vector<uint8_t> Engine::snapshot() const {
    std::vector<uint8_t> copy;
    const_cast<Engine*>(this)->visit_saved([&](const void* data, size_t size) {
        const uint8_t* begin = static_cast<const uint8_t*>(data);
        copy.insert(copy.end(), begin, begin + size);
    });
    return copy;
}

void Engine::load(const uint8_t* bytes, size_t size) {
    const std::lock_guard lock(mutex_);
    size_t expected = 0;
    visit_saved([&](const void*, size_t part) { expected += part; });
    if (size != expected) {
        throw std::invalid_argument("Saved simulation state has " + std::to_string(size) +
                                    " bytes, this simulation needs " + std::to_string(expected) +
                                    ": it must have the same number of cars and version.");
    }
    const std::vector<uint8_t> before = snapshot();
    restore(bytes);
    if (const char* fault = find_fault()) {
        restore(before.data());
        throw std::invalid_argument(std::string("Saved simulation state ") + fault);
    }
    for (size_t env = 0; env < num_envs(); ++env) {
        if (randomization_ != nullptr) draw_episode(env);
        look(env);
    }
}

void Engine::restore(const uint8_t* bytes) {
    visit_saved([&](void* data, size_t part) {
        if (part > 0) std::memcpy(data, bytes, part);  // without objects there is no address to copy to
        bytes += part;
    });
}

// The bytes may come from a file: nothing in them may lead outside this engine's memory, beyond an integer or
// into a NaN.
const char* Engine::find_fault() const {
    const auto is_number = [](auto value) { return std::abs(value) < 1e6f; };
    const auto is_count = [](int32_t value) { return value >= 0 && value < 1'000'000'000; };
    for (size_t env = 0; env < num_envs(); ++env) {
        const Episode& episode = episodes_[env];
        const bool has_tracks = episode.track >= 0 && static_cast<size_t>(episode.track) < tracks_.size() &&
                                track_choice_[env] >= 0 &&
                                static_cast<size_t>(track_choice_[env]) < num_tracks() &&
                                episode.track == episodes_[env - env % config_.cars_per_race].track;
        if (!has_tracks) return "names a track that this simulation lacks.";
        const int status = static_cast<int>(episode.status);
        if (status < 0 || status > static_cast<int>(Status::park))
            return "holds a status that does not exist.";
        const int32_t counts[] = {episode.episode, episode.steps, episode.laps, episode.falling_steps,
                                  episode.still_steps};
        if (!std::all_of(std::begin(counts), std::end(counts), is_count) || episode.frozen_steps < 0)
            return "holds a count that cannot be.";
        const double places[] = {episode.progress, episode.start, episode.last_x, episode.last_y};
        if (!std::all_of(std::begin(places), std::end(places), is_number))
            return "holds an episode that is nowhere.";
    }
    if (!std::all_of(races_.begin(), races_.end(), is_count)) return "holds a count that cannot be.";
    if (!std::all_of(rows_.begin(), rows_.end(), [](double value) { return std::isfinite(value); }))
        return "holds a row that cannot be.";
    if (!std::all_of(vehicles_.begin(), vehicles_.end(), is_number)) return "holds a car that is nowhere.";
    if (!std::all_of(earlier_.begin(), earlier_.end(), is_number)) return "holds a command that cannot be.";
    if (!std::all_of(parameters_.begin(), parameters_.end(), is_number)) return "holds a car that cannot be.";
    if (const char* fault = objects_.find_fault()) return fault;
    const uint8_t* flags = reinterpret_cast<const uint8_t*>(flags_.get());
    if (!std::all_of(flags, flags + 2 * num_envs(), [](uint8_t flag) { return flag <= 1; })) {
        return "is damaged.";
    }
    return nullptr;
}

}  // namespace racecraft
