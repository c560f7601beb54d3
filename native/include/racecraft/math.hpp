// Our own elementary functions: the same bits on every compiler, optimisation level, CPU and GPU.
//
// Only +, -, *, / and sqrt are used, which IEEE 754 defines to the last bit, in a fixed order and without
// fused multiply-add (-ffp-contract=off). All functions are branch-free, so a loop over cars turns into
// vector code.
#pragma once

#include "racecraft/platform.hpp"

#if !defined(__CUDACC__)
#include <cmath>
#endif

namespace racecraft {

constexpr float kPi = 3.14159265358979323846f;
constexpr float kTwoPi = 6.28318530717958647692f;

template <typename T>
RC_HD T min_of(T a, T b) {
    return a < b ? a : b;
}

template <typename T>
RC_HD T max_of(T a, T b) {
    return a < b ? b : a;
}

template <typename T>
RC_HD T clamp(T value, T low, T high) {
    return min_of(max_of(value, low), high);
}

RC_HD float abs_of(float value) {
    return value < 0.0f ? -value : value;
}
RC_HD double abs_of(double value) {
    return value < 0.0 ? -value : value;
}

// Largest integer not above value, for |value| < 2^31; truncation and one correction vectorise everywhere.
RC_HD float floor_of(float value) {
    const float truncated = static_cast<float>(static_cast<int32_t>(value));
    return truncated > value ? truncated - 1.0f : truncated;
}

RC_HD double floor_of(double value) {
    const double truncated = static_cast<double>(static_cast<int64_t>(value));
    return truncated > value ? truncated - 1.0 : truncated;
}

// Nearest integer, halves away from zero, for |value| < 2^31: rounds -value to minus what it rounds value to.
RC_HD float round_of(float value) {
    return static_cast<float>(static_cast<int32_t>(value + (value < 0.0f ? -0.5f : 0.5f)));
}

RC_HD float sqrt_of(float value) {
    return sqrtf(value);
}
RC_HD double sqrt_of(double value) {
    return sqrt(value);
}

// 1 / sqrt(value) for value in [1e-30, 1e30], within 8e-7 of itself: halving the exponent gives a first
// guess, which two Newton steps refine; the constants of the first are those of least error (Kadlec, 2010).
// Half of the time of a root and a division, which no vector unit pipelines.
RC_HD float inverse_sqrt_of(float value) {
    uint32_t bits;
    __builtin_memcpy(&bits, &value, sizeof(bits));
    bits = 0x5f1ffff9u - (bits >> 1);
    float y;
    __builtin_memcpy(&y, &bits, sizeof(y));
    y = y * (0.703952253f * (2.38924456f - value * y * y));
    return y * (1.5f - 0.5f * value * y * y);
}

// Angle in [-pi, pi] up to the rounding of the number of turns; error below 1e-6 for a few thousand turns,
// none without.
RC_HD float wrap_angle(float angle) {
    const float turns = round_of(angle * (1.0f / kTwoPi));
    // 2*pi in two parts (Cody and Waite), so that subtracting whole turns loses nothing.
    return (angle - turns * 6.28125f) - turns * 1.9353071795864769e-3f;
}

// sin and cos of an angle within 0.9 rad, absolute error below 1e-6 (1e-7 within pi/4). Minimax polynomials
// on
// [-pi/4, pi/4] as in Cephes sinf/cosf (Moshier, 1984).
RC_HD void small_sincos_of(float r, float& sine, float& cosine) {
    const float r2 = r * r;
    sine = r + r * r2 * (-1.6666654611e-1f + r2 * (8.3321608736e-3f + r2 * -1.9515295891e-4f));
    cosine = 1.0f - 0.5f * r2 +
             r2 * r2 * (4.166664568298827e-2f + r2 * (-1.388731625493765e-3f + r2 * 2.443315711809948e-5f));
}

// sin and cos together, absolute error below 1e-7 for |angle| < 1000 rad (checked in
// native/tests/math_test.cpp). Odd and even to the bit, so that a mirrored car is a car's mirror image.
RC_HD void sincos_of(float angle, float& sine, float& cosine) {
    const float quadrant = round_of(angle * 0.636619772367581343f);
    float r = angle - quadrant * 1.5703125f;
    r = r - quadrant * 4.8375129699707031e-4f;
    r = r - quadrant * 7.5495075e-8f;
    float s, c;
    small_sincos_of(r, s, c);
    const int32_t q = static_cast<int32_t>(quadrant) & 3;
    const bool swap = (q & 1) != 0;
    const float sine_of_r = swap ? c : s;
    const float cosine_of_r = swap ? s : c;
    sine = (q & 2) != 0 ? -sine_of_r : sine_of_r;
    cosine = ((q + 1) & 2) != 0 ? -cosine_of_r : cosine_of_r;
}

// Natural logarithm of a positive normal number, relative error below 2e-7 (Cephes logf).
RC_HD float log_of(float value) {
    uint32_t bits;
    __builtin_memcpy(&bits, &value, sizeof(bits));
    const uint32_t mantissa_bits = (bits & 0x007fffffu) | 0x3f000000u;  // in [1/2, 1)
    float m;
    __builtin_memcpy(&m, &mantissa_bits, sizeof(m));
    const bool is_low = m < 0.707106781186547524f;
    const float exponent = static_cast<float>(static_cast<int32_t>(bits >> 23) - (is_low ? 127 : 126));
    m = (is_low ? m + m : m) - 1.0f;
    const float m2 = m * m;
    float y = 7.0376836292e-2f;
    y = y * m - 1.1514610310e-1f;
    y = y * m + 1.1676998740e-1f;
    y = y * m - 1.2420140846e-1f;
    y = y * m + 1.4249322787e-1f;
    y = y * m - 1.6668057665e-1f;
    y = y * m + 2.0000714765e-1f;
    y = y * m - 2.4999993993e-1f;
    y = y * m + 3.3333331174e-1f;
    y = y * m * m2 - 2.12194440e-4f * exponent - 0.5f * m2;
    return m + y + 0.693359375f * exponent;
}

// Arc tangent of y/x in (-pi, pi], absolute error below 3e-7; atan2_of(0, 0) is 0.
RC_HD float atan2_of(float y, float x) {
    const float ax = abs_of(x);
    const float ay = abs_of(y);
    const float high = max_of(ax, ay);
    const float low = min_of(ax, ay);
    const float ratio = high > 0.0f ? low / high : 0.0f;
    // Cephes atanf: one reduction at tan(pi/8), then an odd polynomial.
    const bool reduce = ratio > 0.4142135623730950f;
    const float t = reduce ? (ratio - 1.0f) / (ratio + 1.0f) : ratio;
    const float t2 = t * t;
    float angle = t + t * t2 *
                          (-3.33329491539e-1f +
                           t2 * (1.99777106478e-1f + t2 * (-1.38776856032e-1f + t2 * 8.05374449538e-2f)));
    angle = reduce ? angle + 0.25f * kPi : angle;
    angle = ay > ax ? 0.5f * kPi - angle : angle;
    angle = x < 0.0f ? kPi - angle : angle;
    return y < 0.0f ? -angle : angle;
}

}  // namespace racecraft
