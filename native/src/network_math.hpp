// exp, log, tanh, sine and cosine of the network, its loss and its policy: the same bits everywhere, like
// racecraft/math.hpp, in double but for tanh.
#pragma once

#include <bit>

#include "racecraft/platform.hpp"

namespace racecraft {

// Relative error below 1e-15; results below 1e-300 or above 1e300 are held there. Branch-free.
RC_HD double exp_of(double x) {
    constexpr double kRound = 6755399441055744.0;  // 1.5 * 2^52: adding it leaves the integer in the low bits
    x = x < -690.0 ? -690.0 : x;
    x = x > 690.0 ? 690.0 : x;
    const double shifted = x * 1.4426950408889634 + kRound;
    const double k = shifted - kRound;
    // ln 2 in two parts (Cody and Waite), so that subtracting k of them loses nothing
    const double r = (x - k * 0.693147180369123816490) - k * 1.90821492927058770002e-10;
    double sum = 1.0 / 6227020800.0;  // Taylor's series; |r| <= 0.35, so the 14th term is below 1e-17
    sum = sum * r + 1.0 / 479001600.0;
    sum = sum * r + 1.0 / 39916800.0;
    sum = sum * r + 1.0 / 3628800.0;
    sum = sum * r + 1.0 / 362880.0;
    sum = sum * r + 1.0 / 40320.0;
    sum = sum * r + 1.0 / 5040.0;
    sum = sum * r + 1.0 / 720.0;
    sum = sum * r + 1.0 / 120.0;
    sum = sum * r + 1.0 / 24.0;
    sum = sum * r + 1.0 / 6.0;
    sum = sum * r + 0.5;
    sum = sum * r + 1.0;
    sum = sum * r + 1.0;
    const uint64_t exponent = std::bit_cast<uint64_t>(shifted) << 52;
    return sum * std::bit_cast<double>(exponent + std::bit_cast<uint64_t>(1.0));
}

// Natural logarithm of a normal number above 0; absolute error below 1e-15 near 1, relative elsewhere. NaN
// stays NaN.
RC_HD double log_of(double x) {
    constexpr uint64_t kMantissa = (uint64_t{1} << 52) - 1;
    const uint64_t bits = std::bit_cast<uint64_t>(x);
    double k = static_cast<double>(static_cast<int64_t>(bits >> 52) - 1023);
    double m = std::bit_cast<double>((bits & kMantissa) | std::bit_cast<uint64_t>(1.0));
    if (m > 1.4142135623730951) {
        m *= 0.5;
        k += 1.0;
    }
    const double s = (m - 1.0) / (m + 1.0);  // log m = 2 artanh s, |s| <= 0.172
    const double s2 = s * s;
    double sum = 1.0 / 21.0;
    sum = sum * s2 + 1.0 / 19.0;
    sum = sum * s2 + 1.0 / 17.0;
    sum = sum * s2 + 1.0 / 15.0;
    sum = sum * s2 + 1.0 / 13.0;
    sum = sum * s2 + 1.0 / 11.0;
    sum = sum * s2 + 1.0 / 9.0;
    sum = sum * s2 + 1.0 / 7.0;
    sum = sum * s2 + 1.0 / 5.0;
    sum = sum * s2 + 1.0 / 3.0;
    sum = sum * s2 + 1.0;
    return x == x ? k * 0.69314718055994530942 + 2.0 * s * sum : x;
}

// Sine and cosine of 2 pi * turn, for turn in [0, 1); absolute error below 1e-15.
RC_HD void sincos_of_turn(double turn, double& sine, double& cosine) {
    const int64_t quadrant = static_cast<int64_t>(4.0 * turn + 0.5);  // 0 to 4
    const double r = (turn - 0.25 * static_cast<double>(quadrant)) * 6.28318530717958647692;
    const double r2 = r * r;  // Taylor's series; |r| <= pi/4, so what follows is below 1e-17
    double s = -1.0 / 1307674368000.0;
    s = s * r2 + 1.0 / 6227020800.0;
    s = s * r2 - 1.0 / 39916800.0;
    s = s * r2 + 1.0 / 362880.0;
    s = s * r2 - 1.0 / 5040.0;
    s = s * r2 + 1.0 / 120.0;
    s = s * r2 - 1.0 / 6.0;
    s = r + r * r2 * s;
    double c = 1.0 / 20922789888000.0;
    c = c * r2 - 1.0 / 87178291200.0;
    c = c * r2 + 1.0 / 479001600.0;
    c = c * r2 - 1.0 / 3628800.0;
    c = c * r2 + 1.0 / 40320.0;
    c = c * r2 - 1.0 / 720.0;
    c = c * r2 + 1.0 / 24.0;
    c = 1.0 - 0.5 * r2 + r2 * r2 * c;
    const bool swap = (quadrant & 1) != 0;
    const double sine_of_r = swap ? c : s, cosine_of_r = swap ? s : c;
    sine = (quadrant & 2) != 0 ? -sine_of_r : sine_of_r;
    cosine = ((quadrant + 1) & 2) != 0 ? -cosine_of_r : cosine_of_r;
}

// x P(x^2) / Q(x^2), fitted to the relative error over [0, 9.02], beyond which the result is 1 in float:
// within 4e-7 of the exact value, relative. In float throughout, as a network's layers spend much of their
// time here.
RC_HD float tanh_of(float x) {
    constexpr float kMost = 9.02f;
    x = x < -kMost ? -kMost : x;
    x = x > kMost ? kMost : x;
    const float x2 = x * x;
    float p = 1.3319107594611523e-08f;
    p = p * x2 + 2.058350946754217e-05f;
    p = p * x2 + 0.0034940363839268684f;
    p = p * x2 + 0.13379719853401184f;
    p = p * x2 + 1.0f;
    float q = 7.762034783809213e-07f;
    q = q * x2 + 0.0003283095720689744f;
    q = q * x2 + 0.02587108127772808f;
    q = q * x2 + 0.4671303331851959f;
    q = q * x2 + 1.0f;
    float t = x * p / q;
    t = t < -1.0f ? -1.0f : t;
    return t > 1.0f ? 1.0f : t;
}

}  // namespace racecraft
