// Proximal policy optimisation: the one loop, for Python and for a browser's tab alike.
//
//     begin() ─▶ act(sight, states) ─▶ actions ─▶ the cars move, and are paid outside ─▶ pay(rewards, ends)
//     ─┐
//                   ▲  └─ look(sight, states) where pay() found frames that are soon gone ◀─────────────────┤
//                   └──────────── reset the cars of begins() ◀── until is_full() ◀──────────────────────────┘
//     learn() ─▶ values, advantages, gradient steps on shuffled minibatches ─▶ updates()
//
// Whoever calls owns the cars and the reward; the loop owns the rollout, all chance, and the account of
// episodes. racecraft.learn.ppo is its face in Python and names every setting.
//
// For an interface in C, as WebAssembly has: no threads, no exceptions and no Python are needed here; every
// argument is a plain array of the caller's, every result a pointer that stays where it is until the
// next begin(). What can go wrong is told by a bool. With an Engine: act(engine.frames(), engine.state(),
// engine.state_width()), then engine.step() with the actions as commands, then pay() with its flags.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "actor_critic.hpp"
#include "distributions.hpp"
#include "numpy_random.hpp"
#include "rollout.hpp"

namespace racecraft {

// As racecraft.learn.ppo.PPOConfig, where every field is explained.
struct PpoConfig {
    size_t num_envs;
    size_t num_steps;
    size_t episodes_per_iteration;
    size_t max_steps_per_iteration;
    size_t rate_steps;
    double gamma, gae_lambda;
    size_t minibatch_size, update_epochs;
    bool normalize_returns;
    bool is_greedy;  // e-greedy exploration, else the policy is sampled
    double epsilon_start, epsilon_end;
    size_t epsilon_steps;
    Objective objective;
};

// An episode that is over: its car, the undiscounted sum of its rewards, its steps.
struct EndedEpisode {
    size_t car;
    double total;
    int64_t length;
};

class Ppo {
  public:
    // `learner` is changed in place and must outlive the loop; the cars are at the start of an episode.
    Ppo(const PpoConfig& config, ActorCritic& learner);

    // A new iteration, which draws from (seed, iteration). Where it is of whole episodes (`needs_reset`), all
    // cars are to be put at a start before the first act().
    void begin(uint64_t seed, uint64_t iteration, int64_t total_steps);
    bool needs_reset() const { return config_.episodes_per_iteration > 0; }

    // Stores what the cars see and draws what they do: sight (N, sight_size) as the learner encodes it, and
    // states (N, state_width), of which the first state_size columns are read. False: the policy's outputs
    // are not finite.
    bool act(const uint8_t* sight, const float* states, size_t state_width);
    // What they do: indices (N,), or numbers within [-1, 1] (N, num_actions).
    const int64_t* action_indices() const { return chosen_.data(); }
    const float* actions() const { return commands_.data(); }

    // The outcome of what act() chose, each (N,); a car that is both is terminated. True: some cars' returns
    // go on from where they are now, so look() comes next, before any reset.
    bool pay(const double* rewards, const bool* terminated, const bool* truncated);
    void look(const uint8_t* sight, const float* states, size_t state_width);
    // Which cars are to be put at a new start  (N,), and whether there are any.
    const bool* begins() const { return begins_.get(); }
    bool any_begins() const { return any_begins_; }
    bool is_full() const { return is_full_; }

    // Improves the learner on the full rollout. False: loss or gradient of the last of updates() is not
    // finite, and its step was not taken.
    bool learn();

    const std::vector<UpdateStats>& updates() const { return updates_; }  // of the last learn()
    const std::vector<EndedEpisode>& ended() const { return ended_; }     // since begin()
    const Rollout& rollout() const { return rollout_; }
    size_t num_driven() const { return used_.size(); }  // camera steps of the last learn()
    int64_t total_steps() const { return total_steps_; }
    // 1 - Var(returns - values) / Var(returns) of the last learn(); NaN where returns do not vary.
    double explained_variance() const { return explained_variance_; }

    // To save and to bring back: the episodes under way  (N,), and mean and spread of the returns, the
    // critic's unit.
    double* totals() { return totals_.data(); }
    int64_t* lengths() { return lengths_.data(); }
    double* return_scale() { return return_scale_; }

  private:
    // Cars whose returns go on from the end of one row, where they were then.
    struct Cut {
        std::vector<size_t> places;  // in the rollout
        std::vector<uint8_t> observations;
        std::vector<float> states;
    };

    void make_row();
    void draw(size_t first);
    void judge(const uint8_t* observations, const float* states, size_t count, float* values);
    void estimate();
    void follow_returns(const Moments& seen);
    bool improve(double rate);

    const PpoConfig config_;
    ActorCritic& learner_;
    const ActorCriticShape shape_;
    const size_t capacity_;  // rows
    NumpyRandom random_{{}};
    uint64_t iteration_ = 0;
    int64_t total_steps_ = 0;
    int64_t budget_ = 0;  // camera steps that this iteration may still drive
    bool is_full_ = true, any_begins_ = false;
    Rollout rollout_;
    std::vector<int64_t> quota_;      // episodes that each car may still end  (N,)
    std::unique_ptr<bool[]> begins_;  // (N,)
    std::vector<uint8_t> looks_;      // (N,)
    std::vector<Cut> cuts_;
    size_t num_cuts_ = 0;  // the others are kept for their memory
    std::vector<EndedEpisode> ended_;
    std::vector<double> totals_;
    std::vector<int64_t> lengths_;
    double return_scale_[2] = {0.0, 1.0};

    std::vector<float> outputs_, commands_;
    std::vector<double> noise_, normals_;
    std::vector<int64_t> chosen_;
    std::vector<uint8_t> sights_;  // of the cars that look

    std::vector<int64_t> used_, order_;  // samples of the rollout that were driven, and as they were shuffled
    std::vector<float> picked_, carried_;
    std::vector<UpdateStats> updates_;
    double explained_variance_ = 0.0;
};

}  // namespace racecraft
