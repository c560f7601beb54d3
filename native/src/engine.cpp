#include "engine.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <utility>

#include "exposure_kernel.hpp"
#include "lens_kernel.hpp"
#include "lidar_kernel.hpp"
#include "object_painter_kernel.hpp"
#include "object_rule.hpp"
#include "racecraft/folds.hpp"
#include "refuse.hpp"
#include "vehicle_kernel.hpp"

namespace racecraft {

// A part of the cars at a time by the kernels of the instruction set in force, frames at once.
struct Engine::DriveHere {
    Engine& engine;

    void move(int32_t begin, int32_t end, const Commands& commands, int32_t first, int32_t last) {
        const size_t n = engine.num_envs();
        float* fields = engine.vehicles_.data();
        const VehicleArrays arrays{fields,
                                   fields + n,
                                   fields + 2 * n,
                                   fields + 3 * n,
                                   fields + 4 * n,
                                   fields + 5 * n,
                                   fields + 6 * n,
                                   commands.steering,
                                   commands.speed,
                                   commands.is_moving,
                                   engine.parameters_.data(),
                                   n,
                                   engine.delay_.empty() ? nullptr : engine.delay_.data(),
                                   engine.earlier_.empty() ? nullptr : engine.earlier_.data()};
        for (int32_t env = begin; env < end; env += kLanes) {
            const int count = std::min(end - env, kLanes);
            RC_DISPATCH(advance_vehicles, arrays, static_cast<size_t>(env), count, first, last,
                        engine.batch_.substeps);
        }
    }

    void aim(int32_t env) {
        const size_t car = static_cast<size_t>(env);
        const Conditions& conditions = engine.conditions_[car];
        if (!engine.cameras_.empty()) {
            engine.cameras_[car].rebuild(camera_under(conditions, engine.camera_->spec()));
        }
        if (!engine.right_cameras_.empty()) {
            engine.right_cameras_[car].rebuild(camera_under(conditions, engine.right_camera_->spec()));
        }
    }

    void see(int32_t env) {
        if (!engine.lidar_.empty()) {
            const Room& room = track_of(engine.batch_, env).room;
            float* rays = &engine.lidar_[static_cast<size_t>(env) * kLidarRays];
            RC_DISPATCH(scan_lidar, room, lidar_pose_of(engine.batch_, env), around(engine.batch_, env),
                        rays);
        }
        if (engine.camera_ != nullptr) engine.draw(env);
    }
};

Engine::Engine(const EngineConfig& config, std::vector<TrackStore> tracks,
               std::vector<std::shared_ptr<const GroundMap>> grounds, const VehicleParameters& vehicle,
               const CameraSpec* camera, const Randomization* randomization, const RgbPalette& colours)
    : seed_(config.seed),
      tracks_(std::move(tracks)),
      grounds_(std::move(grounds)),
      pool_(config.num_threads) {
    check_objects(config.objects, config.num_envs, config.cars_per_race);
    for (const TrackStore& track : tracks_) geometries_.push_back(track.geometry());
    if (camera != nullptr) {
        CameraSpec spec = *camera;
        spec.left = camera->left + 0.5f * config.baseline;
        camera_ = std::make_unique<CameraModel>(spec);
        spec.left = camera->left - 0.5f * config.baseline;
        if (config.baseline != 0.0f) right_camera_ = std::make_unique<CameraModel>(spec);
    }
    set_up_batch(config, vehicle, camera != nullptr ? *camera : CameraSpec{}, randomization, colours);
    allocate();
    reset(nullptr);
}

// The settings; those of sight are of a car with the default camera's eyes where it has none.
void Engine::set_up_batch(const EngineConfig& config, const VehicleParameters& vehicle,
                          const CameraSpec& eyes, const Randomization* randomization,
                          const RgbPalette& colours) {
    Batch& b = batch_;
    b.num_envs = static_cast<int32_t>(config.num_envs);
    b.cars_per_race = static_cast<int32_t>(config.cars_per_race);
    b.num_tracks = static_cast<int32_t>(num_tracks());
    b.num_objects = num_objects(config.objects) + b.cars_per_race - 1;
    b.num_lenses = camera_ == nullptr ? 0 : right_camera_ == nullptr ? 1 : 2;
    b.num_pixels = camera_ == nullptr ? 0 : eyes.width * eyes.height;
    b.row_width = kNumRowColumns + object_row_width(b.num_objects);
    b.state_width = kNumStateColumns + (b.num_objects > 0 ? kNumObjectState : 0);
    b.has_lidar = config.has_lidar;
    b.is_randomized = randomization != nullptr;
    b.has_latency = randomization != nullptr && randomization->has_latency();
    b.has_lens = randomization != nullptr && randomization->has_lens();
    b.has_cameras = randomization != nullptr && randomization->has_cameras() && camera_ != nullptr;
    b.draws_tracks = config.draws_tracks;
    b.substeps = config.substeps;
    b.picture_age = camera_ != nullptr ? config.picture_age : 0;
    b.direction = config.direction;
    b.limits = config.limits;
    b.start = config.start;
    b.rule = config.objects;
    b.lens_forward = eyes.forward;
    b.lens_left = eyes.left;
    float sine, cosine;
    sincos_of(0.5f * eyes.hfov, sine, cosine);
    b.half_tangent = sine / cosine;
    b.vehicle = vehicle;
    if (randomization != nullptr) b.randomization = *randomization;
    b.colours = colours;
    b.tracks = geometries_.data();
}

// The cars, before their first episode.
void Engine::allocate() {
    Batch& b = batch_;
    const size_t n = num_envs();
    const size_t cars = static_cast<size_t>(b.cars_per_race);
    const auto place = [](auto& values, size_t count, const auto& value) {
        values.assign(count, value);
        return values.data();
    };
    b.vehicles = place(vehicles_, n * kNumVehicleFields, 0.0f);
    b.parameters = place(parameters_, n * kNumVehicleParameters, 0.0f);
    b.state = place(state_, n * state_width(), 0.0f);
    b.rows = place(rows_, n * row_width(), 0.0);
    b.lidar = place(lidar_, n * kLidarRays * (b.has_lidar != 0), 0.0f);
    b.frames = place(frames_, n * static_cast<size_t>(b.num_lenses * b.num_pixels), uint8_t{0});
    b.episodes = place(episodes_, n, Episode{});
    const size_t world = static_cast<size_t>(first_racer(b)) + (has_racers(b) ? cars : 0);
    b.objects = place(objects_, n / cars * world, ObjectState{});
    b.track_choice = place(track_choice_, n, 0);
    b.races = place(races_, has_racers(b) ? n / cars : 0, -1);
    b.seeds = place(seeds_, n, seed_);
    b.streams = place(streams_, n, 0u);
    b.palettes = place(palettes_, n, grey_palette(b.colours));
    b.conditions = place(conditions_, b.is_randomized ? n : 0, Conditions{});
    b.delay = place(delay_, b.has_latency ? n : 0, 0);
    b.earlier = place(earlier_, b.has_latency ? 4 * n : 0, 0.0f);
    b.seen_from = place(seen_from_, b.picture_age > 0 ? 3 * n : 0, 0.0f);
    flags_ = std::make_unique<bool[]>(2 * n);
    b.terminated = reinterpret_cast<uint8_t*>(flags_.get());
    b.truncated = b.terminated + n;
    for (std::vector<float>* commands : {&steering_command_, &speed_command_, &is_moving_})
        commands->resize(n);
    for (size_t env = 0; env < n; ++env) {
        store_parameters(b, static_cast<int32_t>(env), b.vehicle);
        episodes_[env].episode = -1;
        track_choice_[env] = static_cast<int32_t>(env / cars % num_tracks());
        streams_[env] = static_cast<uint32_t>(env);
        if (b.has_cameras) cameras_.emplace_back(camera_->spec());
        if (b.has_cameras && right_camera_ != nullptr) right_cameras_.emplace_back(camera_->spec());
    }
}

void Engine::show_others(int32_t env) {
    if (!has_racers(batch_)) return;
    publish(batch_, env);
    const int32_t first = env - env % batch_.cars_per_race;
    for (int32_t other = first; other < first + batch_.cars_per_race; ++other) {
        if (other != env && !is_over(batch_, other)) see_from(other);
    }
}

void Engine::see_from(int32_t env) {
    DriveHere here{*this};
    look(batch_, env, here);
}

void Engine::draw(int32_t env) {
    const size_t car = static_cast<size_t>(env);
    const size_t pixels = static_cast<size_t>(batch_.num_pixels);
    uint8_t* frame = &frames_[car * num_lenses() * pixels];
    photograph(cameras_.empty() ? *camera_ : cameras_[car], env, 0, frame);
    if (right_camera_ != nullptr) {
        photograph(right_cameras_.empty() ? *right_camera_ : right_cameras_[car], env, 1, frame + pixels);
    }
}

void Engine::photograph(const CameraModel& camera, int32_t env, int32_t eye, uint8_t* frame) {
    const size_t car = static_cast<size_t>(env);
    Sight from = sight_of(batch_, env);
    if (!batch_.has_lens) {
        render(camera, env, from, nullptr, frame);
    } else {
        thread_local std::vector<uint8_t> drawn;
        drawn.resize(static_cast<size_t>(batch_.num_pixels) + 2 * kDrawnMargin);
        uint8_t* picture = drawn.data() + kDrawnMargin;
        const Shot shot = take_shot(conditions_[car], camera.spec(), draws_of(batch_, env),
                                    std::max(episodes_[car].steps, 1), eye, from.heading,
                                    load_vehicle(batch_, env).yaw_rate);
        from.heading += shot.yaw;
        render(camera, env, from, &shot, picture);
        RC_DISPATCH(take_picture, camera.spec(), conditions_[car], shot, picture, frame);
    }
    if (!conditions_.empty()) {
        const Conditions& light = conditions_[car];
        RC_DISPATCH(expose, frame, camera.spec().width, camera.spec().height, light.gradient_across,
                    light.gradient_down, light.blur);
    }
}

void Engine::render(const CameraModel& camera, int32_t env, const Sight& from, const Shot* shot,
                    uint8_t* picture) {
    const size_t car = static_cast<size_t>(env);
    const GroundMap& ground = *grounds_[static_cast<size_t>(episodes_[car].track) % num_tracks()];
    const LensPose lens = place_lens(camera.view(), ground.view(), from.x, from.y, from.heading);
    render_grey(camera, ground, palettes_[car], batch_.colours.sheen, from.x, from.y, from.heading, picture);
    if (shot != nullptr) draw_folds(camera.spec(), lens, *shot, conditions_[car].folds, picture);
    if (batch_.num_objects > 0) {
        RC_DISPATCH(draw_objects, camera.spec(), lens, around(batch_, env), picture);
    }
}

// Cars to a portion of work: whole races.
size_t Engine::chunk_size(size_t most) const {
    const size_t cars = static_cast<size_t>(batch_.cars_per_race);
    const size_t parts = 4 * static_cast<size_t>(pool_.num_threads());
    const size_t portion = std::clamp((num_envs() + parts - 1) / parts, size_t{1}, most);
    return (portion + cars - 1) / cars * cars;
}

template <typename Work>
void Engine::for_chunks(size_t most, Work&& work) {
    const size_t chunk = chunk_size(most);
    pool_.for_each((num_envs() + chunk - 1) / chunk, [&](size_t part) {
        DriveHere here{*this};
        work(static_cast<int32_t>(part * chunk),
             static_cast<int32_t>(std::min((part + 1) * chunk, num_envs())), here);
    });
}

void Engine::reset(const bool* mask, const uint64_t* seeds) {
    const Lock lock(mutex_);
    for_chunks(kLanes, [&](int32_t begin, int32_t end, DriveHere& here) {
        for (int32_t first = begin; first < end; first += batch_.cars_per_race) {
            uint32_t who = 0;
            for (int32_t k = 0; k < batch_.cars_per_race; ++k) {
                const int32_t env = first + k;
                if (mask != nullptr && !mask[env]) continue;
                who |= 1u << k;
                if (seeds != nullptr) reseed(batch_, env, seeds[env]);
            }
            begin_race(batch_, first, who, here);
        }
    });
}

void Engine::step(const float* actions) {
    const Lock lock(mutex_);
    const Commands commands{steering_command_.data(), speed_command_.data(), is_moving_.data(), 0};
    // With a camera a car costs microseconds, without one nanoseconds: hand out work in matching portions.
    for_chunks(camera_ != nullptr ? kLanes : 64 * kLanes, [&](int32_t begin, int32_t end, DriveHere& here) {
        step_races(batch_, begin, end, actions, commands, here);
    });
}

void Engine::set_pose(size_t car, float x, float y, float heading, float speed) {
    const Lock lock(mutex_);
    const int32_t env = static_cast<int32_t>(car);
    VehicleState state{};
    state.x = x;
    state.y = y;
    state.heading = wrap_angle(heading);
    state.speed = speed;
    store_vehicle(batch_, env, state);
    take_sight(batch_, env);
    forget_commands(batch_, env);
    Episode& episode = episodes_[car];
    episode.falling_steps = 0;
    episode.still_steps = 0;
    terminated()[car] = false;
    truncated()[car] = false;
    see_from(env);
    episode.last_x = episode.reference_x;
    episode.last_y = episode.reference_y;
    show_others(env);
}

void Engine::freeze(size_t car, int steps) {
    const Lock lock(mutex_);
    episodes_[car].frozen_steps = steps;
    show_others(static_cast<int32_t>(car));
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
    visit(objects_.data(), objects_.size() * sizeof(ObjectState));
    visit(earlier_.data(), earlier_.size() * sizeof(float));
    visit(seen_from_.data(), seen_from_.size() * sizeof(float));
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
    const Lock lock(mutex_);
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
    const Lock lock(mutex_);
    size_t expected = 0;
    visit_saved([&](const void*, size_t part) { expected += part; });
    if (size != expected) {
        refuse("Saved simulation state has " + std::to_string(size) + " bytes, this simulation needs " +
               std::to_string(expected) + ": it must have the same number of cars and version.");
    }
    const std::vector<uint8_t> before = snapshot();
    restore(bytes);
    if (const char* fault = find_fault()) {
        restore(before.data());
        refuse(std::string("Saved simulation state ") + fault);
    }
    DriveHere here{*this};
    for (int32_t env = 0; env < batch_.num_envs; ++env) restore_car(batch_, env, here);
}

void Engine::restore(const uint8_t* bytes) {
    visit_saved([&](void* data, size_t part) {
        if (part > 0) std::memcpy(data, bytes, part);  // what a batch lacks has no address to copy to
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
        const bool has_tracks =
            episode.track >= 0 && static_cast<size_t>(episode.track) < tracks_.size() &&
            track_choice_[env] >= 0 && static_cast<size_t>(track_choice_[env]) < num_tracks() &&
            episode.track == episodes_[env - env % static_cast<size_t>(batch_.cars_per_race)].track;
        if (!has_tracks) return "names a track that this simulation lacks.";
        // The row tells the length of the track that it was driven on, which tells most tracks apart. To a
        // micrometre: another machine may have summed it up otherwise.
        const double length = tracks_[static_cast<size_t>(episode.track)].geometry().length;
        if (!(std::abs(rows_[env * row_width() + kRow_track_length] - length) < 1e-6))
            return "was saved on another track.";
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
    if (!std::all_of(seen_from_.begin(), seen_from_.end(), is_number)) return "holds a picture from nowhere.";
    if (!std::all_of(earlier_.begin(), earlier_.end(), is_number)) return "holds a command that cannot be.";
    if (!std::all_of(parameters_.begin(), parameters_.end(), is_number)) return "holds a car that cannot be.";
    if (const char* fault = racecraft::find_fault(objects_)) return fault;
    const uint8_t* flags = reinterpret_cast<const uint8_t*>(flags_.get());
    if (!std::all_of(flags, flags + 2 * num_envs(), [](uint8_t flag) { return flag <= 1; })) {
        return "is damaged.";
    }
    return nullptr;
}

}  // namespace racecraft
