// How kernels keep chains of fused multiply-adds: sum = round(x * w + sum), step after step. With the
// instruction in hardware that is all there is to it. Where there is none DoubledSums do it in doubles, a
// product exactly and a sum rounded to a float's 24 bits by adding half of the last one and cutting off what
// is below.
//
// That errs in two cases only. The double may itself have been rounded, onto the middle between two floats:
// that is noticed, and the last few steps are done again by ExactSums. And a float's grid ends at 2^-149,
// which bits cut off a double know nothing of: sums of products that are multiples of that stay on it, so
// the factors' range is asked for beforehand.
#pragma once

#include "network_lanes.hpp"

namespace racecraft::RC_ISA {
namespace {

struct FusedSums {
    using Lanes = FloatLanes;
    static constexpr bool kMayErr = false;
    RC_HD Lanes broadcast(float a) { return splat(a); }
    RC_HD Lanes lanes(FloatLanes a) { return a; }
    RC_HD FloatLanes floats(Lanes a) { return a; }
    // sums[v] += x * w[v]
    template <int kVectors>
    RC_HD void add_products(Lanes x, const Lanes (&w)[kVectors], Lanes (&sums)[kVectors]) {
#pragma GCC unroll 8
        for (int v = 0; v < kVectors; ++v) sums[v] = fused_multiply_add(x, w[v], sums[v]);
    }
};

#if defined(RC_HAS_DOUBLES)

struct DoubledSums {
    using Lanes = DoubleLanes;
    static constexpr bool kMayErr = true;
    RC_HD Lanes broadcast(float a) {
        const Doubles twice = both(static_cast<double>(a));
        return {twice, twice};
    }
    RC_HD Lanes lanes(FloatLanes a) { return widen(a); }
    RC_HD FloatLanes floats(Lanes a) { return narrow(a); }

    template <int kVectors>
    [[gnu::always_inline]] inline void add_products(Lanes x, const Lanes (&w)[kVectors],
                                                    Lanes (&sums)[kVectors]) {
#pragma GCC unroll 8
        for (int v = 0; v < kVectors; ++v) {
            const Doubles low = add(x.low, w[v].low, sums[v].low);
            const Doubles high = add(x.high, w[v].high, sums[v].high);
            // of the 29 bits that are cut off, none is set: the lower halves of the doubles hold them
            const Floats cut = keep_bits(lower_halves(low, high), (1 << 29) - 1);
            least_ = lesser(cut, least_);  // as integers, which those that are no NaN are ordered like
        }
    }
    // Whether a sum since the last call was, in doubles, between two floats, so that it may be the wrong one.
    [[gnu::always_inline]] inline bool has_erred() {
        const bool found = has_zero_bits(least_);
        least_ = four(1.0f);
        return found;
    }

  private:
    // Makes the sum of it rounded to 24 bits, middles away from zero, and gives it with the bits cut off.
    RC_HD Doubles add(Doubles x, Doubles w, Doubles& sum) {
        const Doubles raised = add_to_bits(x * w + sum, 1 << 28);
        sum = keep_bits(raised, -(int64_t{1} << 29));
        return raised;
    }

    Floats least_ = four(1.0f);
};

// What DoubledSums ends in where it does not err, six times as slowly.
struct ExactSums : DoubledSums {
    template <int kVectors>
    RC_HD void add_products(Lanes x, const Lanes (&w)[kVectors], Lanes (&sums)[kVectors]) {
#pragma GCC unroll 8
        for (int v = 0; v < kVectors; ++v) sums[v] = widen(fused_multiply_add(x, w[v], sums[v]));
    }
};

// The least magnitude of numbers that are not 0, and the sum of all magnitudes: not finite where one of them
// is not.
struct Magnitudes {
    Floats least = four(__builtin_inff());
    Floats total = four(0.0f);

    // `count` is a multiple of 4 but for the numbers that a network is given.
    void look_at(const float* values, size_t count) {
        size_t i = 0;
        for (; i + 4 <= count; i += 4) look_at(load_floats(values + i));
        for (; i < count; ++i) look_at(only(values[i]));
    }
    void look_at(Floats values) {
        const Floats magnitude = keep_bits(values, 0x7FFFFFFF);
        total = added(total, magnitude);
        least = lesser(nan_where_zero(magnitude), least);
    }
    double smallest() const {
        float of[4];
        store_floats(of, least);
        float result = of[0];
        for (const float value : of) result = value < result ? value : result;
        return static_cast<double>(result);
    }
    double sum() const {
        float of[4];
        store_floats(of, total);
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

template <typename Lanes, int kRows, int kVectors>
RC_HD void copy_sums(Lanes (&to)[kRows][kVectors], const Lanes (&from)[kRows][kVectors]) {
#pragma GCC unroll 16
    for (int r = 0; r < kRows; ++r)
#pragma GCC unroll 8
        for (int v = 0; v < kVectors; ++v) to[r][v] = from[r][v];
}

// Calls steps(arithmetic, sums, first, last) for all of [0, count) in order; it adds products to the sums.
template <typename Sums, int kRows, int kVectors, typename Steps>
[[gnu::always_inline]] inline void add_steps(Sums& arithmetic, typename Sums::Lanes (&sums)[kRows][kVectors],
                                             size_t count, const Steps& steps) {
    if constexpr (!Sums::kMayErr) {
        steps(arithmetic, sums, size_t{0}, count);
    } else {
#if defined(RC_HAS_DOUBLES)
        constexpr size_t kPiece = 64;
        for (size_t first = 0; first < count; first += kPiece) {
            const size_t last = first + kPiece < count ? first + kPiece : count;
            typename Sums::Lanes next[kRows][kVectors];
            copy_sums(next, sums);
            steps(arithmetic, next, first, last);
            if (arithmetic.has_erred()) [[unlikely]] {
                copy_sums(next, sums);
                ExactSums exact;
                steps(exact, next, first, last);
            }
            copy_sums(sums, next);
        }
#endif
    }
}

#define RC_EACH_SUM                                          \
    _Pragma("GCC unroll 16") for (int r = 0; r < kRows; ++r) \
        _Pragma("GCC unroll 8") for (int v = 0; v < kVectors; ++v)

// Calls add(arithmetic, sums) with the fastest arithmetic that is exact: what it adds to depends on it alone.
template <int kRows, int kVectors, typename Add>
[[gnu::always_inline]] inline void sum_up(FloatLanes (&sums)[kRows][kVectors],
                                          [[maybe_unused]] bool fits_doubled, const Add& add) {
#if defined(RC_HAS_DOUBLES)
    if (fits_doubled) {
        DoubledSums doubled;
        DoubledSums::Lanes wide[kRows][kVectors];
        RC_EACH_SUM wide[r][v] = doubled.lanes(sums[r][v]);
        add(doubled, wide);
        RC_EACH_SUM sums[r][v] = doubled.floats(wide[r][v]);
        return;
    }
#endif
    FusedSums fused;
    add(fused, sums);
}

}  // namespace
}  // namespace racecraft::RC_ISA
