#include "learner_loss.hpp"

#include "distributions.hpp"
#include "network_math.hpp"
#include "racecraft/math.hpp"

namespace racecraft {
namespace {

constexpr double kEntropyOfUnitGaussian = 1.4189385332046727;

// The policy's part of the loss; returns its derivative by the action's log-probability.
double surrogate_loss(double log_prob, const PolicySample& sample, const Objective& objective,
                      LossTerms& terms) {
    const double log_ratio = log_prob - static_cast<double>(sample.old_log_prob);
    const double ratio = exp_of(log_ratio);
    const double clipped = clamp(ratio, 1.0 - objective.clip_coef, 1.0 + objective.clip_coef);
    const double advantage = static_cast<double>(sample.advantage);
    const double free_loss = -advantage * ratio, clipped_loss = -advantage * clipped;
    terms.policy = free_loss < clipped_loss ? clipped_loss : free_loss;
    terms.kl = (ratio - 1.0) - log_ratio;
    terms.clipped = abs_of(ratio - 1.0) > objective.clip_coef ? 1.0 : 0.0;
    return free_loss < clipped_loss ? 0.0 : free_loss;  // d ratio / d log_prob = ratio
}

}  // namespace

void categorical_loss(const float* logits, size_t num_actions, int64_t action, const PolicySample& sample,
                      const Objective& objective, LossTerms& terms, float* gradient) {
    double top = static_cast<double>(logits[0]);
    for (size_t i = 1; i < num_actions; ++i) top = max_of(top, static_cast<double>(logits[i]));
    double sum = 0.0;
    for (size_t i = 0; i < num_actions; ++i) sum += exp_of(static_cast<double>(logits[i]) - top);
    const double log_sum = top + log_of(sum);
    terms.entropy = 0.0;
    for (size_t i = 0; i < num_actions; ++i) {
        const double log_prob = static_cast<double>(logits[i]) - log_sum;
        terms.entropy -= exp_of(log_prob) * log_prob;
    }
    const double slope =
        surrogate_loss(static_cast<double>(logits[action]) - log_sum, sample, objective, terms);
    for (size_t i = 0; i < num_actions; ++i) {
        const double log_prob = static_cast<double>(logits[i]) - log_sum;
        const double prob = exp_of(log_prob);
        const double by_policy = slope * ((static_cast<int64_t>(i) == action ? 1.0 : 0.0) - prob);
        const double by_entropy = objective.ent_coef * prob * (log_prob + terms.entropy);
        const double slope_here = sample.weight * (by_policy + by_entropy);
        // what an action that never happens would pass on are subnormal numbers, which are slow
        gradient[i] = abs_of(slope_here) < 1e-30 ? 0.0f : static_cast<float>(slope_here);
    }
}

void gaussian_loss(const float* mean, const float* log_std, size_t num_actions, const float* action,
                   const PolicySample& sample, const Objective& objective, LossTerms& terms, float* gradient,
                   float* log_std_gradient) {
    double log_prob = 0.0;
    terms.entropy = 0.0;
    for (size_t i = 0; i < num_actions; ++i) {
        const double log_scale = static_cast<double>(clamp(log_std[i], kLogStdMin, kLogStdMax));
        const double z = (static_cast<double>(action[i]) - static_cast<double>(mean[i])) * exp_of(-log_scale);
        log_prob += -0.5 * z * z - log_scale - kHalfLogTwoPi;
        terms.entropy += log_scale + kEntropyOfUnitGaussian;
    }
    const double slope = surrogate_loss(log_prob, sample, objective, terms);
    for (size_t i = 0; i < num_actions; ++i) {
        const double log_scale = static_cast<double>(clamp(log_std[i], kLogStdMin, kLogStdMax));
        const double precision = exp_of(-log_scale);
        const double z = (static_cast<double>(action[i]) - static_cast<double>(mean[i])) * precision;
        gradient[i] = static_cast<float>(sample.weight * slope * z * precision);
        const bool is_free = log_std[i] >= kLogStdMin && log_std[i] <= kLogStdMax;
        const double by_log_std = is_free ? slope * (z * z - 1.0) - objective.ent_coef : 0.0;
        log_std_gradient[i] += static_cast<float>(sample.weight * by_log_std);
    }
}

float critic_loss(float value, float target, double weight, const Objective& objective, LossTerms& terms) {
    const double error = static_cast<double>(value) - static_cast<double>(target);
    const double size = abs_of(error);
    const bool is_linear = objective.is_huber && size > 1.0;
    terms.value = is_linear ? size - 0.5 : 0.5 * error * error;
    return static_cast<float>(weight * objective.vf_coef * (is_linear ? (error < 0.0 ? -1.0 : 1.0) : error));
}

}  // namespace racecraft
