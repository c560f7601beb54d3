// The border between JavaScript and the core: handles are addresses, arrays lie in the module's memory, and
// what was refused becomes an exception (refuse.cpp). web/src/tab/core.ts is its other side.
#include <algorithm>
#include <cstdlib>
#include <iterator>
#include <memory>
#include <vector>

#include "dispatch.hpp"
#include "engine.hpp"
#include "fused_kernel.hpp"
#include "learner.hpp"
#include "network_kernel.hpp"
#include "numpy_random.hpp"
#include "ppo.hpp"
#include "refuse.hpp"
#include "senses.hpp"
#include "settings.hpp"

#define RC_EXPORT(name) extern "C" [[clang::export_name(#name)]]

namespace racecraft {
namespace {

// A track in both directions, and the ground that cameras see: lines (count, 2), the track's and then its
// reversed twin's.
class TrackWorld {
  public:
    TrackWorld(const double* lines, size_t count, const float* tables, size_t num_samples,
               const int32_t* waypoints, double samples_per_metre, bool is_closed)
        : lines_(lines, lines + 6 * 2 * count),
          tables_(tables, tables + 4 * num_samples),
          waypoints_(waypoints, waypoints + 2 * (count - 1)),
          count_(count),
          num_samples_(num_samples),
          samples_per_metre_(samples_per_metre),
          is_closed_(is_closed),
          ground_(std::make_shared<GroundMap>(outline(false))) {}

    TrackStore store(bool reversed) const {
        const float* widths = tables_.data() + (reversed ? 2 : 0) * num_samples_;
        const float* curvatures = widths + num_samples_;
        return TrackStore(outline(reversed), {widths, curvatures}, {curvatures, curvatures + num_samples_},
                          samples_per_metre_);
    }
    const std::shared_ptr<const GroundMap>& ground() const { return ground_; }

  private:
    TrackOutline outline(bool reversed) const {
        const double* first = lines_.data() + (reversed ? 6 : 0) * count_;
        return {first,
                first + 2 * count_,
                first + 4 * count_,
                static_cast<int>(count_),
                is_closed_,
                waypoints_.data() + (reversed ? count_ - 1 : 0)};
    }

    std::vector<double> lines_;
    std::vector<float> tables_;
    std::vector<int32_t> waypoints_;
    size_t count_, num_samples_;
    double samples_per_metre_;
    bool is_closed_;
    std::shared_ptr<const GroundMap> ground_;
};

// What a policy's choices mean to a car: rows of a table, or shares between two ends of it, as
// racecraft.agent.action_space has them: (A, 2) steering angle in rad and speed in m/s.
struct ActionTable {
    std::vector<double> rows;
    bool is_discrete;

    void command(size_t row, float* out) const {
        for (size_t i = 0; i < 2; ++i) out[i] = static_cast<float>(rows[2 * row + i]);
    }
    void command(const float* action, float* out) const {
        for (size_t i = 0; i < 2; ++i) {
            const double share = (std::clamp(static_cast<double>(action[i]), -1.0, 1.0) + 1.0) * 0.5;
            out[i] = static_cast<float>(rows[i] * (1.0 - share) + rows[2 + i] * share);
        }
    }
};

// PPO's loop, the cars that it drives, what they see and what its actions mean to them.
struct Training {
    Engine& cars;
    Senses senses;
    ActionTable table;
    std::vector<float> commands;  // (N, 2)
    Ppo ppo;
};

}  // namespace

// ---- memory, names, and what this machine can do

RC_EXPORT(allocate) void* allocate(size_t bytes) {
    return std::malloc(bytes);
}
RC_EXPORT(release) void release(void* memory) {
    std::free(memory);
}
// 0 settings of cars, 1 of PPO, 2 of a network, 3 a vehicle's parameters, 4 columns of a row, 5 of a state, 6
// settings of objects; words that end in a blank.
RC_EXPORT(names_of) const char* names_of(size_t list) {
    require(list < std::size(kSettingNames), "There is no such list of names.");
    return kSettingNames[list];
}
RC_EXPORT(is_fused) bool is_fused() {
    return RC_ISA::is_multiply_add_fused();
}

// numpy.random.default_rng(seeds).random(count).
RC_EXPORT(uniforms) void uniforms(const uint64_t* seeds, size_t num_seeds, double* out, size_t count) {
    NumpyRandom random({seeds, num_seeds});
    for (; count > 0; --count) *out++ = random.random();
}

// ---- a track

// lines (6, count, 2) in m; tables (4, num_samples): widths and curvatures, then the twin's; waypoints
// (2, count - 1).
RC_EXPORT(make_track)
TrackWorld* make_track(const double* lines, size_t count, const float* tables, size_t num_samples,
                       const int32_t* waypoints, double samples_per_metre, bool is_closed) {
    require(count >= 2 && count <= 65535, "A track needs 2 to 65535 waypoints.");
    require(num_samples >= 2, "Width and curvature tables need at least 2 samples.");
    return new TrackWorld(lines, count, tables, num_samples, waypoints, samples_per_metre, is_closed);
}
RC_EXPORT(free_track) void free_track(TrackWorld* track) {
    delete track;
}

// ---- cars

// Objects as RC_OBJECT_SETTINGS says, or null; ranges of what differs from episode to episode, as
// racecraft.sim.Randomization has them, or null.
RC_EXPORT(make_cars)
Engine* make_cars(const TrackWorld* track, const CarSettings* settings, const VehicleParameters* vehicle,
                  const double* objects, const Randomization* ranges) {
    require(settings->num_envs >= 1.0 && settings->num_envs <= 4096.0, "There must be 1 to 4096 cars.");
    const RgbPalette* const palettes[] = {&kPalette2018, &kPalette2020, &kPalette2026};
    require(settings->palette >= 0.0 && settings->palette < std::size(palettes), "There is no such palette.");
    std::vector<TrackStore> stores;
    for (const bool reversed : {false, true}) stores.push_back(track->store(reversed));
    const CameraSpec camera = camera_of(*settings);
    const bool has_camera = settings->has_camera != 0.0;
    std::vector<std::shared_ptr<const GroundMap>> grounds;
    if (has_camera) grounds.push_back(track->ground());
    EngineConfig config = config_of(*settings);
    if (objects != nullptr) config.objects = objects_of(objects);
    return new Engine(config, std::move(stores), std::move(grounds), *vehicle, has_camera ? &camera : nullptr,
                      ranges, *palettes[count_of(settings->palette)]);
}
RC_EXPORT(free_cars) void free_cars(Engine* cars) {
    delete cars;
}
RC_EXPORT(step_cars) void step_cars(Engine* cars, const float* actions) {
    cars->step(actions);
}
// All of them without a mask; with seeds (N,), for whole races, they begin anew as Engine::reset() says.
RC_EXPORT(reset_cars) void reset_cars(Engine* cars, const bool* mask, const uint64_t* seeds) {
    cars->reset(mask, seeds);
}
RC_EXPORT(set_pose) void set_pose(Engine* cars, size_t car, float x, float y, float heading, float speed) {
    require(car < cars->num_envs(), "There is no such car.");
    cars->set_pose(car, x, y, heading, speed);
}
RC_EXPORT(freeze_car) void freeze_car(Engine* cars, size_t car, int steps) {
    require(car < cars->num_envs(), "There is no such car.");
    cars->freeze(car, steps);
}
// Everything that the next step depends on, as Engine::save() has it and the installed program reads it: into
// out where it has room for all of it; how many bytes that are.
RC_EXPORT(save_cars) size_t save_cars(const Engine* cars, uint8_t* out, size_t room) {
    const std::vector<uint8_t> bytes = cars->save();
    if (bytes.size() <= room) std::copy(bytes.begin(), bytes.end(), out);
    return bytes.size();
}
RC_EXPORT(num_envs) size_t num_envs(const Engine* cars) {
    return cars->num_envs();
}
RC_EXPORT(num_pixels) size_t num_pixels(const Engine* cars) {
    return Senses::pixels_of(*cars);
}
RC_EXPORT(row_width) size_t row_width(const Engine* cars) {
    return cars->row_width();
}
RC_EXPORT(state_width) size_t state_width(const Engine* cars) {
    return cars->state_width();
}
RC_EXPORT(rows_of) double* rows_of(Engine* cars) {
    return cars->rows();
}
RC_EXPORT(state_of) float* state_of(Engine* cars) {
    return cars->state();
}
RC_EXPORT(frames_of) uint8_t* frames_of(Engine* cars) {
    return cars->frames();
}
RC_EXPORT(vehicles_of) float* vehicles_of(Engine* cars) {
    return cars->vehicles();
}
RC_EXPORT(terminated_of) bool* terminated_of(Engine* cars) {
    return cars->terminated();
}
RC_EXPORT(truncated_of) bool* truncated_of(Engine* cars) {
    return cars->truncated();
}

// ---- a network

RC_EXPORT(make_learner) Learner* make_learner(const double* settings) {
    return new Learner(network_of(settings), 0);
}
RC_EXPORT(free_learner) void free_learner(Learner* learner) {
    delete learner;
}
RC_EXPORT(num_parameters) size_t num_parameters(const Learner* learner) {
    return learner->network().num_public;
}
// Weights (0), Adam's first (1) and second (2) moments, as they are published  (num_parameters(),).
RC_EXPORT(read_part) void read_part(Learner* learner, int part, float* out) {
    learner->read(static_cast<Learner::Part>(part), out);
}
RC_EXPORT(write_part) void write_part(Learner* learner, int part, const float* values) {
    learner->write(static_cast<Learner::Part>(part), values);
}
RC_EXPORT(num_updates) double num_updates(const Learner* learner) {
    return static_cast<double>(learner->num_updates());
}
RC_EXPORT(set_num_updates) void set_num_updates(Learner* learner, double count) {
    learner->set_num_updates(static_cast<int64_t>(count));
}
// As racecraft.learn.networks.initial_weights: layers (count, 3) of rows, columns and gain; matrices, one
// after the other, into `out`.
RC_EXPORT(orthogonal_weights)
void orthogonal_weights(double seed, const double* layers, size_t count, float* out) {
    constexpr uint64_t kPurpose = 0x6E6574;
    const uint64_t seeds[] = {static_cast<uint64_t>(seed), kPurpose};
    NumpyRandom random(seeds);
    for (; count > 0; --count, layers += 3) {
        const size_t rows = count_of(layers[0]), columns = count_of(layers[1]), size = rows * columns;
        const size_t shorter = std::min(rows, columns), longer = std::max(rows, columns);
        std::vector<double> uniforms(size + size % 2), normals(size + size % 2), vectors(size);
        for (double& uniform : uniforms) uniform = random.random();
        standard_normals(uniforms.data(), uniforms.size() / 2, normals.data());
        for (size_t i = 0; i < size; ++i) vectors[i % shorter * longer + i / shorter] = normals[i];
        RC_DISPATCH(orthonormalize, vectors.data(), shorter, longer);
        for (size_t i = 0; i < size; ++i) {
            const size_t row = i / columns, column = i % columns;
            const size_t at = rows < columns ? i : column * longer + row;
            *out++ = static_cast<float>(layers[2] * vectors[at]);
        }
    }
}
// What the policy likes best for each car as it stands, as commands (N, 2). `table` as for make_training().
RC_EXPORT(choose_best)
void choose_best(Learner* learner, Engine* cars, const double* table, float* commands) {
    const ActorCriticShape shape = learner->shape();
    Senses senses(*cars, shape);
    const size_t count = cars->num_envs(), size = shape.policy_size();
    std::vector<uint8_t> observations(count * shape.observation_size);
    std::vector<float> outputs(count * size);
    learner->encode(senses.read(), count, observations.data());
    learner->policy(observations.data(), nullptr, count, outputs.data());
    const ActionTable actions{{table, table + 2 * (shape.is_discrete ? shape.num_actions : 2)},
                              shape.is_discrete};
    for (size_t car = 0; car < count; ++car) {
        const float* of_car = outputs.data() + car * size;
        float* command = commands + 2 * car;
        if (shape.is_discrete) {
            actions.command(static_cast<size_t>(std::max_element(of_car, of_car + size) - of_car), command);
        } else {
            actions.command(of_car, command);
        }
    }
}

// ---- a training: begin_iteration, then drive and pay until it is full, then learn

// table: (num_actions, 2) commands, or for continuous actions (2, 2), the lowest and the highest command. The
// cars are at the start of an episode; cars and learner outlive the training.
RC_EXPORT(make_training)
Training* make_training(Learner* learner, Engine* cars, const PpoSettings* settings, const double* table) {
    const ActorCriticShape shape = learner->shape();
    require(settings->num_envs == static_cast<double>(cars->num_envs()),
            "PPO must be told the number of its cars.");
    require(shape.state_size <= cars->state_width(), "The network was made for another state.");
    require(shape.is_discrete || shape.num_actions == 2, "A car takes two commands.");
    const size_t rows = shape.is_discrete ? shape.num_actions : 2;
    return new Training{*cars,
                        Senses(*cars, shape),
                        {{table, table + 2 * rows}, shape.is_discrete},
                        std::vector<float>(2 * cars->num_envs()),
                        Ppo(config_of(*settings), *learner)};
}
RC_EXPORT(free_training) void free_training(Training* training) {
    delete training;
}
RC_EXPORT(begin_iteration)
void begin_iteration(Training* training, double seed, double iteration, double total_steps) {
    training->ppo.begin(static_cast<uint64_t>(seed), static_cast<uint64_t>(iteration),
                        static_cast<int64_t>(total_steps));
    if (training->ppo.needs_reset()) training->cars.reset(nullptr);
}
// One step of all cars. False: the policy's outputs are not finite, and nothing moved.
RC_EXPORT(drive) bool drive(Training* training) {
    Engine& cars = training->cars;
    Ppo& ppo = training->ppo;
    require(!ppo.is_full(), "The rollout is full.");
    if (!ppo.act(training->senses.read(), cars.state(), cars.state_width())) return false;
    const ActionTable& table = training->table;
    for (size_t car = 0; car < cars.num_envs(); ++car) {
        float* command = training->commands.data() + 2 * car;
        if (table.is_discrete) {
            table.command(static_cast<size_t>(ppo.action_indices()[car]), command);
        } else {
            table.command(ppo.actions() + 2 * car, command);
        }
    }
    cars.step(training->commands.data());
    return true;
}
// Rewards (N,) of that step; cars whose episode is over begin another. True: the rollout is full.
RC_EXPORT(pay) bool pay(Training* training, const double* rewards) {
    Engine& cars = training->cars;
    Ppo& ppo = training->ppo;
    if (ppo.pay(rewards, cars.terminated(), cars.truncated())) {
        ppo.look(training->senses.read(), cars.state(), cars.state_width());
    }
    if (ppo.any_begins()) cars.reset(ppo.begins());
    return ppo.is_full();
}
// False: loss or gradient is not finite, and its step was not taken.
RC_EXPORT(learn) bool learn(Training* training) {
    require(training->ppo.is_full() && training->ppo.rollout().num_steps > 0, "The rollout is not full yet.");
    return training->ppo.learn();
}
RC_EXPORT(total_steps) double total_steps(const Training* training) {
    return static_cast<double>(training->ppo.total_steps());
}
// Episodes that ended since begin_iteration(): sums of rewards and steps into out (up to `most`, 2); how many
// there were.
RC_EXPORT(ended_episodes) size_t ended_episodes(const Training* training, double* out, size_t most) {
    const std::vector<EndedEpisode>& ended = training->ppo.ended();
    for (size_t i = 0; i < std::min(most, ended.size()); ++i) {
        out[2 * i] = ended[i].total;
        out[2 * i + 1] = static_cast<double>(ended[i].length);
    }
    return ended.size();
}
// The episodes under way: sums of their rewards, and their steps  (N,).
RC_EXPORT(episode_totals) double* episode_totals(Training* training) {
    return training->ppo.totals();
}
RC_EXPORT(episode_lengths) int64_t* episode_lengths(Training* training) {
    return training->ppo.lengths();
}
// Mean and spread of the returns, to be read and written  (2,).
RC_EXPORT(return_scale) double* return_scale(Training* training) {
    return training->ppo.return_scale();
}

}  // namespace racecraft
