#include "object_field.hpp"

#include <cmath>
#include <stdexcept>
#include <string>

namespace racecraft {
namespace {

void check(bool is_fine, const char* text) {
    if (!is_fine) throw std::invalid_argument(text);
}

void check_group(const ObjectGroup& group) {
    check(group.count >= 0 && group.count <= kMaxObjects, "A track takes 0 to 32 objects.");
    check(group.min_distance >= 0.0 && group.min_distance <= 1e6, "Objects need a distance of 0 m or more.");
    if (group.placement != Placement::fixed) return;
    for (int32_t i = 0; i < group.count; ++i) {
        check(group.fractions[i] >= 0.0 && group.fractions[i] <= 1.0 && std::abs(group.lanes[i]) == 1.0f,
              "An object stands at 0 to 1 of a lap, in lane 1 or -1.");
    }
}

}  // namespace

ObjectField::ObjectField(const ObjectRule& rule, size_t num_envs, size_t cars_per_race,
                         const CameraSpec* camera)
    : rule_(rule),
      cars_per_race_(cars_per_race),
      first_racer_(num_objects(rule)),
      num_racers_(cars_per_race > 1 ? static_cast<int32_t>(cars_per_race) : 0),
      count_(first_racer_ + static_cast<int32_t>(cars_per_race) - 1) {
    check(cars_per_race >= 1 && cars_per_race <= kMaxCarsPerRace && num_envs % cars_per_race == 0,
          "A race has 1 to 8 cars, and a batch whole races.");
    check_group(rule.obstacles);
    check_group(rule.bots);
    check(first_racer_ <= kMaxObjects, "A track takes 0 to 32 objects.");
    const BotRule& bot = rule.bot;
    check(bot.speed >= 0.0f && bot.speed <= 10.0f, "A bot car drives 0 to 10 m/s.");
    check(bot.shortest_stay > 0.0f && bot.longest_stay >= bot.shortest_stay && bot.longest_stay <= 1e6f,
          "A bot car stays in its lane for more than 0 s.");
    check(bot.change_distance >= 0.1f && bot.change_distance <= 100.0f,
          "A bot car changes its lane over 0.1 to 100 m.");
    const CameraSpec spec = camera != nullptr ? *camera : CameraSpec{};
    lens_forward_ = spec.forward;
    lens_left_ = spec.left;
    float sine, cosine;
    sincos_of(0.5f * spec.hfov, sine, cosine);
    half_tangent_ = sine / cosine;
    objects_.resize(num_envs / cars_per_race * width());
}

void ObjectField::place(size_t race, const TrackGeometry& track, const Draws& draws) {
    if (first_racer_ == 0) return;
    ObjectState* objects = world(race);
    place_group(track, rule_.obstacles, rule_.bot, draws.seed, draws.stream, draws.episode, 0, objects);
    place_group(track, rule_.bots, rule_.bot, draws.seed, draws.stream, draws.episode, rule_.obstacles.count,
                objects);
}

void ObjectField::advance(size_t race, const TrackGeometry& track, const Draws& draws, const Footprint* cars,
                          int32_t num_cars) {
    if (!has_bots()) return;
    ObjectState* objects = world(race);
    for (int32_t i = rule_.obstacles.count; i < first_racer_; ++i) {
        ObjectState next = objects[i];
        advance_bot(track, rule_.bot, draws.seed, draws.stream, draws.episode, i, kControlDt, next);
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

void ObjectField::publish(size_t env, const TrackGeometry& track, const VehicleState& car, ObjectKind kind) {
    if (num_racers_ == 0) return;
    ObjectState& object = world(env / cars_per_race_)[around(env).own];
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

int32_t ObjectField::find_crash(size_t env, const TrackGeometry& track, const Episode& episode,
                                const VehicleState& car) const {
    if (count_ == 0) return -1;
    return racecraft::find_crash(track, car_footprint(car.x, car.y, episode.sine, episode.cosine),
                                 around(env));
}

void ObjectField::write_row(size_t env, const Episode& episode, const VehicleState& car, int32_t crashed,
                            double* out) const {
    if (count_ == 0) return;
    const ObjectsAround seen = around(env);
    const float lens_x = car.x + lens_forward_ * episode.cosine - lens_left_ * episode.sine;
    const float lens_y = car.y + lens_forward_ * episode.sine + lens_left_ * episode.cosine;
    bool in_camera = false;
    for (int32_t i = 0; i < count_ && !in_camera; ++i) {
        const ObjectState& object = object_at(seen, i);
        in_camera = is_there(object) &&
                    is_object_in_view(object, lens_x, lens_y, episode.sine, episode.cosine, half_tangent_);
    }
    write_objects(seen, closest_objects(seen, episode.projection.arc_length), in_camera, crashed, out);
}

void ObjectField::observe(size_t env, const TrackGeometry& track, const Episode& episode, float* out) const {
    if (count_ == 0) return;
    observe_objects(track, around(env), episode.projection.arc_length, out);
}

const char* ObjectField::find_fault() const {
    for (const ObjectState& object : objects_) {
        const int32_t kind = static_cast<int32_t>(object.kind);
        const float numbers[] = {object.x,     object.y,    object.heading,   object.sine,      object.cosine,
                                 object.speed, object.lane, object.lane_from, object.travelled, object.stay};
        bool is_fine = kind >= 0 && kind < kNumObjectKinds && std::abs(object.arc_length) < 1e6 &&
                       std::abs(object.offset) < 1e6 && object.distance >= 0.0 && object.distance < 1e6;
        for (const float number : numbers) is_fine = is_fine && std::abs(number) < 1e6f;
        if (!is_fine) return "holds an object that cannot be.";
    }
    return nullptr;
}

}  // namespace racecraft
