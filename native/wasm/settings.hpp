// What crosses from JavaScript as rows of numbers, and what the core makes of it.
//
// Settings cross in the order of their names, which names_of() tells, so that the two sides cannot disagree
// about it. Booleans are 0 or 1, choices their place in the lists of racecraft.sim.simulation.
#pragma once

#include <cstring>
#include <iterator>

#include "engine.hpp"
#include "network.hpp"
#include "ppo.hpp"
#include "refuse.hpp"

namespace racecraft {

// As racecraft.sim.Simulation, Start and CameraSpec; `palette` is 0 for 2018, 1 for 2020, 2 for 2026. The
// seed's upper half crosses by itself: a double holds 53 bits.
#define RC_CAR_SETTINGS(X) \
    X(num_envs)            \
    X(cars_per_race)       \
    X(seed)                \
    X(seed_high)           \
    X(substeps)            \
    X(laps)                \
    X(max_steps)           \
    X(time_limit)          \
    X(start_mode)          \
    X(start_offset)        \
    X(start_advance)       \
    X(start_spread)        \
    X(lateral_jitter)      \
    X(heading_jitter)      \
    X(direction)           \
    X(picture_age)         \
    X(palette)             \
    X(has_camera)          \
    X(has_lidar)           \
    X(width)               \
    X(height)              \
    X(hfov)                \
    X(forward)             \
    X(left)                \
    X(above)               \
    X(pitch)               \
    X(baseline)

// As racecraft.sim.Obstacles and Bots, each kind by its place in OBJECT_KINDS; then, of obstacles and of bots
// that have fixed places, as many pairs of a fraction of a lap and a lane as there are.
#define RC_OBJECT_SETTINGS(X) \
    X(obstacle_kind)          \
    X(obstacle_count)         \
    X(obstacle_placement)     \
    X(obstacle_distance)      \
    X(bot_count)              \
    X(bot_placement)          \
    X(bot_distance)           \
    X(bot_speed)              \
    X(changes_lane)           \
    X(shortest_stay)          \
    X(longest_stay)           \
    X(change_distance)

// As racecraft.learn.PPOConfig.
#define RC_PPO_SETTINGS(X)     \
    X(num_envs)                \
    X(num_steps)               \
    X(episodes_per_iteration)  \
    X(max_steps_per_iteration) \
    X(rate_steps)              \
    X(gamma)                   \
    X(gae_lambda)              \
    X(minibatch_size)          \
    X(update_epochs)           \
    X(normalize_returns)       \
    X(is_greedy)               \
    X(epsilon_start)           \
    X(epsilon_end)             \
    X(epsilon_steps)           \
    X(learning_rate)           \
    X(clip_coef)               \
    X(ent_coef)                \
    X(vf_coef)                 \
    X(is_huber)                \
    X(max_grad_norm)           \
    X(adam_eps)                \
    X(is_eps_hat)

// As _native.Learner's; then, each behind its length, convs (filters, kernel, stride), dense, critic_units,
// lidar_units.
#define RC_NETWORK_SETTINGS(X) \
    X(height)                  \
    X(width)                   \
    X(top)                     \
    X(pool)                    \
    X(block)                   \
    X(num_actions)             \
    X(is_discrete)             \
    X(state_size)              \
    X(lidar_size)

#define RC_FIELD(name) double name;
#define RC_NAME(name) #name " "
struct CarSettings {
    RC_CAR_SETTINGS(RC_FIELD)
};
struct ObjectSettings {
    RC_OBJECT_SETTINGS(RC_FIELD)
};
struct PpoSettings {
    RC_PPO_SETTINGS(RC_FIELD)
};
struct NetworkSettings {
    RC_NETWORK_SETTINGS(RC_FIELD)
};
inline const char* const kSettingNames[] = {RC_CAR_SETTINGS(RC_NAME),     RC_PPO_SETTINGS(RC_NAME),
                                            RC_NETWORK_SETTINGS(RC_NAME), RC_VEHICLE_PARAMETERS(RC_NAME),
                                            RC_ROW_COLUMNS(RC_NAME),      RC_STATE_COLUMNS(RC_NAME),
                                            RC_OBJECT_SETTINGS(RC_NAME)};
#undef RC_FIELD
#undef RC_NAME

inline void require(bool is_met, const char* message) {
    if (!is_met) refuse(message);
}

inline size_t count_of(double value) {
    return static_cast<size_t>(value);
}

inline ObjectGroup group_of(ObjectKind kind, double count, double placement, double distance,
                            const double*& places) {
    ObjectGroup group;
    group.kind = kind;
    require(count >= 0.0 && count <= kMaxObjects, "A track takes 0 to 32 objects.");
    group.count = static_cast<int32_t>(count);
    group.placement = static_cast<Placement>(static_cast<int>(placement));
    group.min_distance = distance;
    if (group.placement != Placement::fixed) return group;
    for (int32_t i = 0; i < group.count; ++i) {
        group.fractions[i] = *places++;
        group.lanes[i] = static_cast<float>(*places++);
    }
    return group;
}

inline ObjectRule objects_of(const double* settings) {
    ObjectSettings s;
    std::memcpy(&s, settings, sizeof(s));
    const double* places = settings + sizeof(s) / sizeof(double);
    ObjectRule rule;
    const auto kind = static_cast<ObjectKind>(static_cast<int>(s.obstacle_kind));
    rule.obstacles = group_of(kind, s.obstacle_count, s.obstacle_placement, s.obstacle_distance, places);
    const ObjectKind bot = s.bot_count > 0.0 ? ObjectKind::bot_car : ObjectKind::box;
    rule.bots = group_of(bot, s.bot_count, s.bot_placement, s.bot_distance, places);
    rule.bot = {static_cast<float>(s.bot_speed), s.changes_lane != 0.0, static_cast<float>(s.shortest_stay),
                static_cast<float>(s.longest_stay), static_cast<float>(s.change_distance)};
    return rule;
}

inline EngineConfig config_of(const CarSettings& s) {
    EngineConfig config{};
    config.num_envs = count_of(s.num_envs);
    config.cars_per_race = count_of(s.cars_per_race);
    config.seed = static_cast<uint64_t>(s.seed_high) << 32 | static_cast<uint64_t>(s.seed);
    config.baseline = static_cast<float>(s.baseline);
    config.substeps = static_cast<int>(s.substeps);
    config.num_threads = 0;
    config.has_lidar = s.has_lidar != 0.0;
    config.limits = {static_cast<int>(s.laps), static_cast<int>(s.max_steps), s.time_limit};
    config.start = {static_cast<StartMode>(static_cast<int>(s.start_mode)),
                    s.start_offset,
                    s.start_advance,
                    s.start_spread != 0.0,
                    static_cast<float>(s.lateral_jitter),
                    static_cast<float>(s.heading_jitter)};
    config.direction = static_cast<Direction>(static_cast<int>(s.direction));
    config.picture_age = static_cast<int>(s.picture_age);
    return config;
}

inline CameraSpec camera_of(const CarSettings& s) {
    return {static_cast<int32_t>(s.width), static_cast<int32_t>(s.height), static_cast<float>(s.hfov),
            static_cast<float>(s.pitch),   static_cast<float>(s.forward),  static_cast<float>(s.left),
            static_cast<float>(s.above)};
}

inline PpoConfig config_of(const PpoSettings& s) {
    PpoConfig config{};
    config.num_envs = count_of(s.num_envs);
    config.num_steps = count_of(s.num_steps);
    config.episodes_per_iteration = count_of(s.episodes_per_iteration);
    config.max_steps_per_iteration = count_of(s.max_steps_per_iteration);
    config.rate_steps = count_of(s.rate_steps);
    config.gamma = s.gamma;
    config.gae_lambda = s.gae_lambda;
    config.minibatch_size = count_of(s.minibatch_size);
    config.update_epochs = count_of(s.update_epochs);
    config.normalize_returns = s.normalize_returns != 0.0;
    config.is_greedy = s.is_greedy != 0.0;
    config.epsilon_start = s.epsilon_start;
    config.epsilon_end = s.epsilon_end;
    config.epsilon_steps = count_of(s.epsilon_steps);
    config.objective = {s.learning_rate, s.clip_coef,     s.ent_coef, s.vf_coef,
                        s.is_huber != 0, s.max_grad_norm, s.adam_eps, s.is_eps_hat != 0};
    return config;
}

inline NetworkSpec network_of(const double* settings) {
    NetworkSettings s;
    std::memcpy(&s, settings, sizeof(s));
    const double* next = settings + sizeof(s) / sizeof(double);
    const auto number = [&next] { return static_cast<int>(*next++); };
    NetworkSpec spec{};
    spec.height = static_cast<int>(s.height);
    spec.width = static_cast<int>(s.width);
    spec.top = static_cast<int>(s.top);
    spec.pool = static_cast<int>(s.pool);
    spec.block = static_cast<int>(s.block);
    spec.num_actions = static_cast<int>(s.num_actions);
    spec.is_discrete = s.is_discrete != 0.0;
    spec.state_size = static_cast<int>(s.state_size);
    spec.lenses = 1;
    spec.lidar_size = static_cast<int>(s.lidar_size);
    for (int count = number(); count > 0; --count) {
        const int filters = number(), kernel = number(), stride = number();
        spec.convs.push_back({filters, kernel, stride});
    }
    for (int count = number(); count > 0; --count) spec.dense.push_back(number());
    for (int count = number(); count > 0; --count) spec.critic_units.push_back(number());
    for (int count = number(); count > 0; --count) spec.lidar_units.push_back(number());
    return spec;
}

}  // namespace racecraft
