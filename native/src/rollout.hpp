// One rollout of T steps by N cars, and the advantages computed from it.
//
// One step of one car is: see the observation of a pose, act, receive the reward and whether the episode
// ended there. It ends in two ways that must not be confused. *Terminated*: nothing comes after, the return
// stops. *Truncated*: the car could have driven on and only the clock ran out, so the critic's value of the
// pose it reached stands in for the rest.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace racecraft {

// Columns of a rollout, each (T, N) or (T, N, width), row after row.
struct Rollout {
    size_t num_steps = 0;                 // T, rows filled so far
    size_t num_envs = 0;                  // N
    std::vector<uint8_t> observations;    // encoded, bytes  (T, N, observation_size)
    std::vector<float> states;            // privileged  (T, N, state_size)
    std::vector<int64_t> action_indices;  // discrete  (T, N)
    std::vector<float> actions;           // continuous, before they are clipped  (T, N, num_actions)
    std::vector<float> log_probs;
    std::vector<float> rewards;
    std::vector<uint8_t> terminated, truncated;  // not both
    std::vector<uint8_t> is_valid;               // 0 where a car only waited for the others
    std::vector<float> values;                   // of the observation that a step acted on
    std::vector<float> next_values;              // of what a step led to, where its return goes on from there
    std::vector<float> advantages, returns;

    size_t num_samples() const { return num_steps * num_envs; }
};

// What generalised advantages are computed from, T steps by N cars, and where they go.
struct AdvantageColumns {
    size_t num_steps, num_envs;
    const float* rewards;
    const float* values;
    const float* next_values;  // read in the last row and where truncated
    const uint8_t *terminated, *truncated;
    float *advantages, *returns;
};

// Generalised advantages, https://arxiv.org/abs/1506.02438, with the two ends of an episode apart, and
// returns (advantage + value). `carried` is scratch (N,).
void generalized_advantages(const AdvantageColumns& columns, double gamma, double gae_lambda, float* carried);

}  // namespace racecraft
