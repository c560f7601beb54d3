// How kernels keep chains of fused multiply-adds: sum = round(x * w + sum), step after step. With the
// instruction in hardware that is all there is to it. SSE2 has none; there DoubledSums do it in doubles, a
// product exactly and a sum rounded to a float's 24 bits by adding half of the last one and cutting off what
// is below.
//
// That errs in two cases only. The double may itself have been rounded, onto the middle between two floats:
// there the sum is made again, in the slow way. And a float's grid ends at 2^-149, which bits cut off a
// double know nothing of: sums of products that are multiples of that stay on it, so the factors' range is
// asked for beforehand.
#pragma once

#include "network_lanes.hpp"

namespace racecraft::RC_ISA {
namespace {

struct FusedSums {
    using Lanes = FloatLanes;
    RC_HD Lanes lanes(FloatLanes a) { return a; }
    RC_HD FloatLanes floats(Lanes a) { return a; }
    // sums[v] += x * w[v]
    template <int kVectors>
    RC_HD void add_products(Lanes x, const Lanes (&w)[kVectors], Lanes (&sums)[kVectors]) {
#pragma GCC unroll 2
        for (int v = 0; v < kVectors; ++v) sums[v] = fused_multiply_add(x, w[v], sums[v]);
    }
};

#if defined(__SSE2__) && !defined(__FMA__) && !defined(RC_SCALAR)

#define RC_HAS_DOUBLED_SUMS 1

struct DoubledSums {
    using Lanes = DoubleLanes;
    RC_HD Lanes lanes(FloatLanes a) { return widen(a); }
    RC_HD FloatLanes floats(Lanes a) { return narrow(a); }

    template <int kVectors>
    RC_HD void add_products(Lanes x, const Lanes (&w)[kVectors], Lanes (&sums)[kVectors]) {
        Lanes rounded[kVectors];
        __m128i middles = _mm_setzero_si128();
#pragma GCC unroll 2
        for (int v = 0; v < kVectors; ++v) {
            rounded[v].low = add(_mm_mul_pd(x.low, w[v].low), sums[v].low, middles);
            rounded[v].high = add(_mm_mul_pd(x.high, w[v].high), sums[v].high, middles);
        }
        constexpr int kLowerHalves = 0x0f0f;  // the upper half of each double says nothing
        if ((_mm_movemask_epi8(middles) & kLowerHalves) != 0) [[unlikely]] {
#pragma GCC unroll 2
            for (int v = 0; v < kVectors; ++v) rounded[v] = widen(fused_multiply_add(x, w[v], sums[v]));
        }
#pragma GCC unroll 2
        for (int v = 0; v < kVectors; ++v) sums[v] = rounded[v];
    }

  private:
    // The sum rounded to 24 bits, middles away from zero; the lower half of `middles` is set for those.
    RC_HD __m128d add(__m128d product, __m128d sum, __m128i& middles) {
        const __m128i raised =
            _mm_add_epi64(_mm_castpd_si128(_mm_add_pd(product, sum)), _mm_set1_epi64x(1 << 28));
        const __m128i below = _mm_and_si128(raised, _mm_set1_epi64x((1 << 29) - 1));
        middles = _mm_or_si128(middles, _mm_cmpeq_epi32(below, _mm_setzero_si128()));
        return _mm_castsi128_pd(_mm_xor_si128(raised, below));
    }
};

// The least magnitude of numbers that are not 0, and the sum of all magnitudes: not finite where one of them
// is not.
struct Magnitudes {
    __m128 least = _mm_set1_ps(__builtin_inff());
    __m128 total = _mm_setzero_ps();

    // `count` is a multiple of 4 but for the numbers that a network is given.
    void look_at(const float* values, size_t count) {
        size_t i = 0;
        for (; i + 4 <= count; i += 4) look_at(_mm_loadu_ps(values + i));
        for (; i < count; ++i) look_at(_mm_set_ss(values[i]));
    }
    void look_at(__m128 values) {
        const __m128 magnitude = _mm_andnot_ps(_mm_set1_ps(-0.0f), values);
        total = _mm_add_ps(total, magnitude);
        const __m128 is_zero = _mm_cmpeq_ps(magnitude, _mm_setzero_ps());
        least =
            _mm_min_ps(_mm_or_ps(magnitude, is_zero), least);  // the second where the first is not a number
    }
    double smallest() const {
        alignas(16) float of[4];
        _mm_store_ps(of, least);
        float result = of[0];
        for (const float value : of) result = value < result ? value : result;
        return static_cast<double>(result);
    }
    double sum() const {
        alignas(16) float of[4];
        _mm_store_ps(of, total);
        double result = 0.0;
        for (const float value : of) result += static_cast<double>(value);
        return result;
    }
};

// Whether DoubledSums may add products of these factors to sums that begin with those.
inline bool fit_doubled_sums(const Magnitudes& x, const Magnitudes& w, double beginnings) {
    constexpr double kLeast = 0x1p-101;  // 48 bits of such a product end at 2^-149
    constexpr double kMost = 0x1p126;    // far from where a float becomes infinite
    return x.smallest() * w.smallest() >= kLeast && x.sum() * w.sum() + beginnings < kMost;
}

#endif

}  // namespace
}  // namespace racecraft::RC_ISA
