// The loss of one sample, term by term, where its formula can be followed by hand.
#include "../src/learner_loss.hpp"

#include <numbers>
#include <vector>

#include "check.hpp"

namespace racecraft {
namespace {

constexpr Objective kObjective{.learning_rate = 1e-3,
                               .clip_coef = 0.2,
                               .ent_coef = 0.0,
                               .vf_coef = 0.5,
                               .is_huber = true,
                               .max_grad_norm = 0.5,
                               .adam_eps = 1e-5};

struct Loss {
    LossTerms terms;
    double slope;  // of the chosen action's logit
};

// Two equal actions, chosen with probability one half, which was half / ratio before.
Loss of_ratio(double ratio, float advantage) {
    const float logits[2] = {0.7f, 0.7f};
    float gradient[2];
    const PolicySample sample{static_cast<float>(std::log(0.5 / ratio)), advantage, 1.0};
    Loss loss;
    categorical_loss(logits, 2, 1, sample, kObjective, loss.terms, gradient);
    loss.slope = gradient[1];
    CHECK_NEAR(gradient[0], -gradient[1], 1e-9);
    return loss;
}

}  // namespace

TEST(a_ratio_is_clipped_on_both_sides) {
    for (const float advantage : {-2.0f, 2.0f}) {
        for (const double ratio : {0.1, 0.5, 0.79, 1.21, 1.5, 4.0}) {
            CHECK_EQUAL(of_ratio(ratio, advantage).terms.clipped, 1.0);
        }
        for (const double ratio : {0.81, 0.9, 1.0, 1.1, 1.19}) {
            CHECK_EQUAL(of_ratio(ratio, advantage).terms.clipped, 0.0);
        }
    }
}

TEST(the_loss_is_the_worse_of_the_free_and_the_clipped_one) {
    const struct {
        double ratio;
        float advantage;
        double loss, slope;  // the slope at the chosen logit is -advantage * ratio / 2, or none
    } cases[] = {
        {1.0, 2.0f, -2.0, -1.0}, {1.1, 2.0f, -2.2, -1.1}, {1.5, 2.0f, -2.4, 0.0}, {0.5, 2.0f, -1.0, -0.5},
        {1.0, -2.0f, 2.0, 1.0},  {1.5, -2.0f, 3.0, 1.5},  {0.5, -2.0f, 1.6, 0.0}, {0.9, -2.0f, 1.8, 0.9},
    };
    for (const auto& [ratio, advantage, expected, slope] : cases) {
        const Loss loss = of_ratio(ratio, advantage);
        CHECK_NEAR(loss.terms.policy, expected, 1e-6);
        CHECK_NEAR(loss.slope, slope, 1e-6);
    }
}

TEST(the_divergence_is_never_negative_and_zero_where_nothing_moved) {
    for (const double ratio : {0.2, 0.9, 1.0, 1.1, 3.0}) {
        CHECK_NEAR(of_ratio(ratio, 1.0f).terms.kl, ratio - 1.0 - std::log(ratio), 1e-6);
    }
}

TEST(entropy_is_that_of_the_distribution) {
    Loss loss = of_ratio(1.0, 1.0f);
    CHECK_NEAR(loss.terms.entropy, std::log(2.0), 1e-12);
    const float logits[3] = {1000.0f, 1000.0f + static_cast<float>(std::log(2.0)), -1000.0f};
    float gradient[3];
    categorical_loss(logits, 3, 0, {0.0f, 0.0f, 1.0}, kObjective, loss.terms, gradient);
    CHECK_NEAR(loss.terms.entropy, std::log(3.0) - 2.0 / 3.0 * std::log(2.0), 1e-4);
    CHECK_EQUAL(gradient[2], 0.0f);

    const float mean[2] = {0.0f, 0.0f}, log_std[2] = {0.5f, -0.25f}, action[2] = {0.1f, 0.2f};
    float at_mean[2], at_std[2] = {};
    gaussian_loss(mean, log_std, 2, action, {0.0f, 0.0f, 1.0}, kObjective, loss.terms, at_mean, at_std);
    CHECK_NEAR(loss.terms.entropy, 0.25 + std::log(2.0 * std::numbers::pi * std::exp(1.0)), 1e-6);
}

TEST(a_deviation_at_its_bounds_is_pulled_no_further) {
    Objective objective = kObjective;
    objective.ent_coef = 0.1;
    for (const float log_std : {-30.0f, 0.0f, 30.0f}) {
        LossTerms terms;
        const float mean = 0.0f, action = 0.0f;
        float at_mean, at_std = 0.0f;
        gaussian_loss(&mean, &log_std, 1, &action, {0.0f, 0.0f, 1.0}, objective, terms, &at_mean, &at_std);
        CHECK_NEAR(at_std, log_std == 0.0f ? -0.1 : 0.0, 1e-8);
        CHECK(std::isfinite(terms.entropy) && std::isfinite(at_mean));
    }
}

TEST(the_critic_errs_by_a_square_and_far_off_by_a_line) {
    const struct {
        float value;
        bool is_huber;
        double loss, slope;
    } cases[] = {{1.5f, true, 0.125, 0.5}, {2.0f, true, 0.5, 1.0},  {4.0f, true, 2.5, 1.0},
                 {-2.0f, true, 2.5, -1.0}, {4.0f, false, 4.5, 3.0}, {1.0f, true, 0.0, 0.0}};
    for (const auto& [value, is_huber, expected, slope] : cases) {
        Objective objective = kObjective;
        objective.is_huber = is_huber;
        LossTerms terms;
        CHECK_NEAR(critic_loss(value, 1.0f, 0.25, objective, terms), 0.25 * 0.5 * slope, 1e-7);
        CHECK_NEAR(terms.value, expected, 1e-7);
    }
}

}  // namespace racecraft
