// What a policy's outputs mean while it drives: actions drawn from them, and log-probabilities.
//
// Pure functions in double with our own exp and log, so that a rollout is the same to the bit on every
// machine. Bounds of a Gaussian's log standard deviation and the layout of its outputs (means, then log
// standard deviations) are those of racecraft.learn.distributions.
#pragma once

#include <cstddef>
#include <cstdint>

namespace racecraft {

constexpr float kLogStdMin = -20.0f, kLogStdMax = 3.0f;
constexpr double kHalfLogTwoPi = 0.9189385332046727;

// Logits (rows, num_actions) and uniforms in [0, 1) (rows,) -> indices (rows,).
void sample_categorical(const float* logits, const double* uniforms, size_t rows, size_t num_actions,
                        int64_t* actions);
// -> log-probability of each action (rows,).
void categorical_log_probs(const float* logits, const int64_t* actions, size_t rows, size_t num_actions,
                           float* log_probs);

// Outputs (rows, 2 * num_actions) and standard normals (rows, num_actions) -> actions (rows, num_actions).
void sample_gaussian(const float* outputs, const double* normals, size_t rows, size_t num_actions,
                     float* actions);
// -> log-density of each action (rows,).
void gaussian_log_probs(const float* outputs, const float* actions, size_t rows, size_t num_actions,
                        float* log_probs);

// Uniforms in [0, 1) (2 * pairs,) -> standard normals (2 * pairs,), by Box and Muller.
void standard_normals(const double* uniforms, size_t pairs, double* normals);

// Mean and spread (the standard deviation, not of a sample) of numbers, summed up from first to last.
struct Moments {
    double mean, spread;
};
Moments moments_of(const float* values, size_t count);

}  // namespace racecraft
