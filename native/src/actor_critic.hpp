// What the loop of PPO needs of a policy and a critic that improve by gradient steps, wherever they are
// computed.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>

#include "learner_loss.hpp"

namespace racecraft {

// Samples of one gradient step: B rows of arrays that may hold more.
struct Minibatch {
    size_t size;                    // B
    const int64_t* rows;            // (B,), null for the first B
    const uint8_t* observations;    // (M, observation_size): the image, then the LIDAR
    const float* states;            // (M, state_size)
    const int64_t* action_indices;  // (M,), discrete; each within [0, num_actions)
    const float* actions;           // (M, num_actions), continuous
    const float* log_probs;         // (M,)
    const float* advantages;        // (M,)
    const float* returns;           // (M,)
    // (M, num_actions): derivatives of another loss at the policy's outputs, log_std apart, in place of
    // PPO's; then nothing behind `states` is read, and the critic learns nothing. Null: none.
    const float* slopes = nullptr;

    size_t row(size_t sample) const { return rows == nullptr ? sample : static_cast<size_t>(rows[sample]); }
};

// What one gradient step saw, before it was applied.
struct UpdateStats {
    double policy_loss, value_loss, entropy, approx_kl, clip_fraction, grad_norm;

    // Whether loss and gradient are ordinary numbers, that is, whether the step was applied.
    bool is_finite() const {
        return std::isfinite(policy_loss) && std::isfinite(value_loss) && std::isfinite(entropy) &&
               std::isfinite(grad_norm);
    }
};

struct ActorCriticShape {
    size_t sight_size, observation_size;  // bytes of what encode() takes and gives, for one car
    size_t state_size;                    // columns of privileged state
    size_t num_actions;
    bool is_discrete;

    size_t policy_size() const { return is_discrete ? num_actions : 2 * num_actions; }
};

class ActorCritic {
  public:
    virtual ~ActorCritic() = default;
    virtual ActorCriticShape shape() const = 0;

    // What the sensors tell (count, sight_size) -> out (count, observation_size).
    virtual void encode(const uint8_t* sight, size_t count, uint8_t* out) = 0;
    // Logits, or means and log standard deviations  (count, policy_size). `states` are read by a policy that
    // sees them, `observations` by the others.
    virtual void policy(const uint8_t* observations, const float* states, size_t count, float* out) = 0;
    // The critic's estimates  (count,).
    virtual void values(const uint8_t* observations, const float* states, size_t count, float* out) = 0;
    // One gradient step; changes nothing when loss or gradient is not finite.
    virtual UpdateStats update(const Minibatch& minibatch, const Objective& objective) = 0;
};

}  // namespace racecraft
