// The clipped PPO loss of one sample and its gradient, in double; https://arxiv.org/abs/1707.06347.
//
//     loss = max(-A r, -A clip(r, 1 - c, 1 + c)) + vf_coef * value loss - ent_coef * entropy,  r = p(action)
//     / p_old(action)
#pragma once

#include <cstddef>
#include <cstdint>

namespace racecraft {

// The clipped PPO loss and the step taken on it, as racecraft.learn.Objective.
struct Objective {
    double learning_rate, clip_coef, ent_coef, vf_coef;
    bool is_huber;  // else half the squared error
    double max_grad_norm;
    double adam_eps;
    bool is_eps_hat = false;  // added before the second moment is corrected
};

struct LossTerms {
    double policy = 0.0, value = 0.0, entropy = 0.0, kl = 0.0, clipped = 0.0;
};

struct PolicySample {
    float old_log_prob;
    float advantage;
    double weight;  // 1 / minibatch size; multiplies the gradient
};

// Adds nothing: fills policy, entropy, kl and clipped of `terms`, and the gradient at each logit
// (num_actions,).
void categorical_loss(const float* logits, size_t num_actions, int64_t action, const PolicySample& sample,
                      const Objective& objective, LossTerms& terms, float* gradient);

// The same for a Gaussian; adds the gradient at log_std (num_actions,) to `log_std_gradient`.
void gaussian_loss(const float* mean, const float* log_std, size_t num_actions, const float* action,
                   const PolicySample& sample, const Objective& objective, LossTerms& terms, float* gradient,
                   float* log_std_gradient);

// Fills terms.value; returns the gradient at the value.
float critic_loss(float value, float target, double weight, const Objective& objective, LossTerms& terms);

}  // namespace racecraft
