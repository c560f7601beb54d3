#include "object_rule.hpp"

#include <cmath>

#include "refuse.hpp"

namespace racecraft {
namespace {

void check(bool is_fine, const char* text) {
    if (!is_fine) refuse(text);
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

void check_objects(const ObjectRule& rule, size_t num_envs, size_t cars_per_race) {
    check(cars_per_race >= 1 && cars_per_race <= kMaxCarsPerRace && num_envs % cars_per_race == 0,
          "A race has 1 to 8 cars, and a batch whole races.");
    check_group(rule.obstacles);
    check_group(rule.bots);
    check(num_objects(rule) <= kMaxObjects, "A track takes 0 to 32 objects.");
    const BotRule& bot = rule.bot;
    check(bot.speed >= 0.0f && bot.speed <= 10.0f, "A bot car drives 0 to 10 m/s.");
    check(bot.shortest_stay > 0.0f && bot.longest_stay >= bot.shortest_stay && bot.longest_stay <= 1e6f,
          "A bot car stays in its lane for more than 0 s.");
    check(bot.change_distance >= 0.1f && bot.change_distance <= 100.0f,
          "A bot car changes its lane over 0.1 to 100 m.");
}

const char* find_fault(const std::vector<ObjectState>& objects) {
    for (const ObjectState& object : objects) {
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
