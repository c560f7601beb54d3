// The elementary functions against libm in double precision, with the error bounds that the header states.
#include "racecraft/math.hpp"

#include <algorithm>
#include <cstdint>
#include <limits>
#include <numbers>
#include <random>

#include "check.hpp"

namespace racecraft {
namespace {

// Calls visit with floats of either sign spread over [low, high]: evenly, and evenly in their exponents.
template <typename Visitor>
void for_floats(float low, float high, Visitor&& visit) {
    std::mt19937 random(7);
    std::uniform_real_distribution<double> even(low, high);
    std::uniform_real_distribution<double> exponent(std::log(1e-30), std::log(static_cast<double>(high)));
    for (int i = 0; i < 400000; ++i) {
        visit(static_cast<float>(even(random)));
        const float spread = static_cast<float>(std::exp(exponent(random)));
        visit(spread);
        if (low < 0.0f) visit(-spread);
    }
}

double sincos_error(float angle) {
    float sine, cosine;
    sincos_of(angle, sine, cosine);
    const double exact = angle;
    return std::max(std::abs(static_cast<double>(sine) - std::sin(exact)),
                    std::abs(static_cast<double>(cosine) - std::cos(exact)));
}

}  // namespace

TEST(sincos_stays_within_1e7_of_libm_up_to_1000_rad) {
    double worst = 0.0;
    for_floats(-1000.0f, 1000.0f, [&](float angle) { worst = std::max(worst, sincos_error(angle)); });
    std::printf("       sincos: worst error %.3g\n", worst);
    CHECK(worst < 1e-7);
}

TEST(sincos_is_accurate_around_every_quadrant_border) {
    double worst = 0.0;
    for (int eighth = -1270; eighth <= 1270; ++eighth) {
        float angle = static_cast<float>(eighth) * 0.25f * kPi;
        for (int i = 0; i < 4; ++i) angle = std::nextafter(angle, -1e9f);
        for (int i = 0; i < 8; ++i, angle = std::nextafter(angle, 1e9f))
            worst = std::max(worst, sincos_error(angle));
    }
    CHECK(worst < 1e-7);
}

TEST(sincos_is_odd_and_even_to_the_bit) {
    // A mirrored car must be the mirror image of a car, so no quadrant may be rounded towards one side.
    const auto check = [](float angle) {
        float sine, cosine, mirrored_sine, mirrored_cosine;
        sincos_of(angle, sine, cosine);
        sincos_of(-angle, mirrored_sine, mirrored_cosine);
        CHECK_EQUAL(mirrored_sine, -sine);
        CHECK_EQUAL(mirrored_cosine, cosine);
    };
    for_floats(-1000.0f, 1000.0f, check);
    for (int eighth = 0; eighth <= 64; ++eighth) {
        float angle = static_cast<float>(eighth) * 0.25f * kPi;
        for (int i = 0; i < 16; ++i) angle = std::nextafter(angle, -1e9f);
        for (int i = 0; i < 32; ++i, angle = std::nextafter(angle, 1e9f)) check(angle);
    }
}

TEST(sincos_of_zero_is_exact) {
    float sine, cosine;
    sincos_of(0.0f, sine, cosine);
    CHECK_EQUAL(sine, 0.0f);
    CHECK_EQUAL(cosine, 1.0f);
}

TEST(atan2_stays_within_3e7_of_libm) {
    std::mt19937 random(11);
    std::normal_distribution<float> normal;
    std::uniform_real_distribution<float> exponent(-12.0f, 12.0f);
    double worst = 0.0;
    for (int i = 0; i < 1000000; ++i) {
        const float y = normal(random) * std::exp(exponent(random));
        const float x = normal(random) * std::exp(exponent(random));
        const double error = std::abs(static_cast<double>(atan2_of(y, x)) -
                                      std::atan2(static_cast<double>(y), static_cast<double>(x)));
        worst = std::max(worst, error);
    }
    std::printf("       atan2: worst error %.3g\n", worst);
    CHECK(worst < 3e-7);
}

TEST(atan2_on_the_axes_and_at_the_origin) {
    CHECK_EQUAL(atan2_of(0.0f, 0.0f), 0.0f);
    CHECK_EQUAL(atan2_of(0.0f, 2.0f), 0.0f);
    CHECK_EQUAL(atan2_of(0.0f, -2.0f), kPi);
    CHECK_EQUAL(atan2_of(3.0f, 0.0f), 0.5f * kPi);
    CHECK_EQUAL(atan2_of(-3.0f, 0.0f), -0.5f * kPi);
    CHECK_NEAR(atan2_of(1e-30f, 1e-30f), 0.25 * std::numbers::pi, 3e-7);
    CHECK_NEAR(atan2_of(1e30f, -1e30f), 0.75 * std::numbers::pi, 3e-7);
}

TEST(wrap_angle_keeps_the_direction_and_the_range) {
    double worst = 0.0;
    float highest = 0.0f;
    for_floats(-20000.0f, 20000.0f, [&](float angle) {
        const float wrapped = wrap_angle(angle);
        worst =
            std::max(worst, std::abs(std::remainder(static_cast<double>(angle) - static_cast<double>(wrapped),
                                                    2.0 * std::numbers::pi)));
        if (abs_of(angle) < 100.0f) highest = std::max(highest, abs_of(wrapped));
    });
    std::printf("       wrap_angle: worst error %.3g, largest %.9g\n", worst, static_cast<double>(highest));
    // Whole turns are subtracted without loss, so what is left is the rounding of the second part of 2 pi.
    CHECK(worst < 1e-6);
    CHECK(highest <= 1.00001f * kPi);
}

TEST(wrap_angle_leaves_small_angles_and_mirrors_to_the_bit) {
    for_floats(-1000.0f, 1000.0f, [](float angle) {
        if (abs_of(angle) < 3.14f) CHECK_EQUAL(wrap_angle(angle), angle);
        CHECK_EQUAL(wrap_angle(-angle), -wrap_angle(angle));
    });
}

TEST(floor_equals_libm) {
    for_floats(-2e9f, 2e9f, [](float value) {
        CHECK_EQUAL(floor_of(value), std::floor(value));
        const double precise = static_cast<double>(value) * 1.0000001;
        CHECK_EQUAL(floor_of(precise), std::floor(precise));
    });
    for (const double value : {0.0, -0.5, 0.5, 1.0, -1.0, 2.999999999999, -3.000000000001, 1e15, -1e15}) {
        CHECK_EQUAL(floor_of(value), std::floor(value));
    }
}

TEST(clamp_bounds_everything_and_passes_no_nan) {
    CHECK_EQUAL(clamp(5.0f, -1.0f, 1.0f), 1.0f);
    CHECK_EQUAL(clamp(-5.0f, -1.0f, 1.0f), -1.0f);
    CHECK_EQUAL(clamp(0.25f, -1.0f, 1.0f), 0.25f);
    CHECK(std::isfinite(clamp(std::numeric_limits<float>::quiet_NaN(), -1.0f, 1.0f)));
    CHECK_EQUAL(clamp(std::numeric_limits<float>::infinity(), -1.0f, 1.0f), 1.0f);
}

TEST(logarithm_stays_within_2e7_of_libm) {
    const auto check = [](float value) {
        const double exact = std::log(static_cast<double>(value));
        CHECK_NEAR(static_cast<double>(log_of(value)), exact, 2e-7 * std::max(1.0, std::abs(exact)));
    };
    for_floats(1e-30f, 1e30f, check);
    for (float value = 0.25f; value < 4.0f; value += 1e-5f) check(value);  // where it changes its sign
    CHECK_EQUAL(log_of(1.0f), 0.0f);
}

TEST(square_root_is_correctly_rounded) {
    for_floats(0.0f, 1e9f, [](float value) {
        CHECK_EQUAL(sqrt_of(value), static_cast<float>(std::sqrt(static_cast<double>(value))));
    });
}

TEST(small_sincos_is_close_and_odd) {
    for (float angle = 0.0f; angle <= 0.9f; angle += 1e-5f) {
        float sine, cosine, mirrored_sine, mirrored_cosine;
        small_sincos_of(angle, sine, cosine);
        small_sincos_of(-angle, mirrored_sine, mirrored_cosine);
        CHECK_NEAR(static_cast<double>(sine), std::sin(static_cast<double>(angle)), 1e-6);
        CHECK_NEAR(static_cast<double>(cosine), std::cos(static_cast<double>(angle)), 1e-6);
        CHECK_EQUAL(mirrored_sine, -sine);
        CHECK_EQUAL(mirrored_cosine, cosine);
    }
}

TEST(inverse_square_root_is_close) {
    const auto check = [](float value) {
        const double exact = 1.0 / std::sqrt(static_cast<double>(value));
        CHECK_NEAR(static_cast<double>(inverse_sqrt_of(value)) / exact, 1.0, 8e-7);
    };
    for_floats(1e-30f, 1e30f, check);
    for (float value = 1.0f; value < 4.0f; value += 1e-5f) check(value);  // every mantissa, both parities
}

}  // namespace racecraft
