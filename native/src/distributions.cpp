#include "distributions.hpp"

#include "network_math.hpp"
#include "racecraft/math.hpp"

namespace racecraft {
namespace {

double top_of(const float* logits, size_t num_actions) {
    double top = static_cast<double>(logits[0]);
    for (size_t i = 1; i < num_actions; ++i) top = max_of(top, static_cast<double>(logits[i]));
    return top;
}

double weight_of(float logit, double top) {
    return exp_of(static_cast<double>(logit) - top);
}

double log_std_of(const float* outputs, size_t num_actions, size_t i) {
    return static_cast<double>(clamp(outputs[num_actions + i], kLogStdMin, kLogStdMax));
}

}  // namespace

void sample_categorical(const float* logits, const double* uniforms, size_t rows, size_t num_actions,
                        int64_t* actions) {
    for (size_t row = 0; row < rows; ++row, logits += num_actions) {
        const double top = top_of(logits, num_actions);
        double sum = 0.0;
        for (size_t i = 0; i < num_actions; ++i) sum += weight_of(logits[i], top);
        const double target = uniforms[row] * sum;
        size_t action = 0;
        double reached = 0.0;
        for (; action + 1 < num_actions;
             ++action) {  // the last one is open-ended: rounding cannot run past it
            reached += weight_of(logits[action], top);
            if (target < reached) break;
        }
        actions[row] = static_cast<int64_t>(action);
    }
}

void categorical_log_probs(const float* logits, const int64_t* actions, size_t rows, size_t num_actions,
                           float* log_probs) {
    for (size_t row = 0; row < rows; ++row, logits += num_actions) {
        const double top = top_of(logits, num_actions);
        double sum = 0.0;
        for (size_t i = 0; i < num_actions; ++i) sum += weight_of(logits[i], top);
        const double chosen = static_cast<double>(logits[actions[row]]) - top;
        log_probs[row] = static_cast<float>(chosen - log_of(sum));
    }
}

void sample_gaussian(const float* outputs, const double* normals, size_t rows, size_t num_actions,
                     float* actions) {
    for (size_t row = 0; row < rows; ++row, outputs += 2 * num_actions) {
        for (size_t i = 0; i < num_actions; ++i) {
            const double spread = exp_of(log_std_of(outputs, num_actions, i));
            *actions++ = static_cast<float>(static_cast<double>(outputs[i]) + spread * *normals++);
        }
    }
}

void gaussian_log_probs(const float* outputs, const float* actions, size_t rows, size_t num_actions,
                        float* log_probs) {
    for (size_t row = 0; row < rows; ++row, outputs += 2 * num_actions) {
        double sum = 0.0;
        for (size_t i = 0; i < num_actions; ++i) {
            const double log_std = log_std_of(outputs, num_actions, i);
            const double error = static_cast<double>(*actions++) - static_cast<double>(outputs[i]);
            const double z = error * exp_of(-log_std);
            sum += -0.5 * z * z - log_std - kHalfLogTwoPi;
        }
        log_probs[row] = static_cast<float>(sum);
    }
}

void standard_normals(const double* uniforms, size_t pairs, double* normals) {
    for (size_t i = 0; i < 2 * pairs; i += 2) {
        const double radius = sqrt_of(-2.0 * log_of(1.0 - uniforms[i]));  // of (0, 1]
        double sine = 0.0, cosine = 0.0;
        sincos_of_turn(uniforms[i + 1], sine, cosine);
        normals[i] = radius * cosine;
        normals[i + 1] = radius * sine;
    }
}

Moments moments_of(const float* values, size_t count) {
    double sum = 0.0, squares = 0.0;
    for (size_t i = 0; i < count; ++i) sum += static_cast<double>(values[i]);
    const double mean = sum / static_cast<double>(count);
    for (size_t i = 0; i < count; ++i) {
        const double error = static_cast<double>(values[i]) - mean;
        squares += error * error;
    }
    return {mean, sqrt_of(squares / static_cast<double>(count))};
}

}  // namespace racecraft
