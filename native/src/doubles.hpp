// Doubles in pairs, which hold the product of two floats exactly: what a fused multiply-add is made of where
// there is no instruction for it, with SSE2 and with WebAssembly's SIMD that is not relaxed. Include only
// from *_kernel.cpp.
//
// Integers are bits of numbers, four of 32 in the registers of floats and two of 64 in those of doubles.
#pragma once

#include <cstdint>

#include "racecraft/platform.hpp"

#if defined(RC_SCALAR)  // has std::fma
#elif defined(__SSE2__) && !defined(__FMA__)
#define RC_HAS_DOUBLES 1
#include <emmintrin.h>
#elif defined(__wasm_simd128__) && !defined(__wasm_relaxed_simd__)
#define RC_HAS_DOUBLES 1
#include <wasm_simd128.h>
#endif

#if defined(RC_HAS_DOUBLES)

namespace racecraft::RC_ISA {
namespace {

#if defined(__SSE2__)

using Floats = __m128;
struct Doubles {
    __m128d v;
};

RC_HD Doubles both(double a) {
    return {_mm_set1_pd(a)};
}
RC_HD Doubles widen_lower(Floats a) {
    return {_mm_cvtps_pd(a)};
}
RC_HD Doubles widen_upper(Floats a) {
    return {_mm_cvtps_pd(_mm_movehl_ps(a, a))};
}
RC_HD Floats narrow(Doubles lower, Doubles upper) {
    return _mm_movelh_ps(_mm_cvtpd_ps(lower.v), _mm_cvtpd_ps(upper.v));
}
RC_HD Doubles operator+(Doubles a, Doubles b) {
    return {_mm_add_pd(a.v, b.v)};
}
RC_HD Doubles operator-(Doubles a, Doubles b) {
    return {_mm_sub_pd(a.v, b.v)};
}
RC_HD Doubles operator*(Doubles a, Doubles b) {
    return {_mm_mul_pd(a.v, b.v)};
}

RC_HD Doubles add_to_bits(Doubles a, int64_t n) {
    return {_mm_castsi128_pd(_mm_add_epi64(_mm_castpd_si128(a.v), _mm_set1_epi64x(n)))};
}
RC_HD Doubles keep_bits(Doubles a, int64_t mask) {
    return {_mm_castsi128_pd(_mm_and_si128(_mm_castpd_si128(a.v), _mm_set1_epi64x(mask)))};
}
// The lower 32 bits of each.
RC_HD Floats lower_halves(Doubles lower, Doubles upper) {
    return _mm_shuffle_ps(_mm_castpd_ps(lower.v), _mm_castpd_ps(upper.v), 0x88);
}
// Away from zero by a last bit where the error has the sign of the sum, else towards it, if that bit is 0 and
// the error is not; an infinite sum's error is NaN.
RC_HD Doubles to_odd(Doubles sum, Doubles error) {
    const __m128d zero = _mm_setzero_pd();
    const __m128d inexact = _mm_or_pd(_mm_cmplt_pd(error.v, zero), _mm_cmplt_pd(zero, error.v));
    const __m128i bits = _mm_castpd_si128(sum.v);
    const __m128i one = _mm_set1_epi64x(1);
    const __m128i even =
        _mm_shuffle_epi32(_mm_cmpeq_epi32(_mm_and_si128(bits, one), _mm_setzero_si128()), 0xA0);
    const __m128i signs = _mm_srai_epi32(_mm_xor_si128(bits, _mm_castpd_si128(error.v)), 31);
    const __m128i step = _mm_or_si128(_mm_shuffle_epi32(signs, 0xF5), one);
    return {_mm_castsi128_pd(
        _mm_add_epi64(bits, _mm_and_si128(step, _mm_and_si128(even, _mm_castpd_si128(inexact)))))};
}

RC_HD Floats four(float a) {
    return _mm_set1_ps(a);
}
RC_HD Floats load_floats(const float* from) {
    return _mm_loadu_ps(from);
}
RC_HD Floats only(float a) {  // and zeros
    return _mm_set_ss(a);
}
RC_HD Floats added(Floats a, Floats b) {
    return _mm_add_ps(a, b);
}
RC_HD Floats keep_bits(Floats a, int32_t mask) {
    return _mm_and_ps(a, _mm_castsi128_ps(_mm_set1_epi32(mask)));
}
// The lesser; `b` where one of them is not a number.
RC_HD Floats lesser(Floats a, Floats b) {
    return _mm_min_ps(a, b);
}
RC_HD Floats nan_where_zero(Floats a) {
    return _mm_or_ps(a, _mm_cmpeq_ps(a, _mm_setzero_ps()));
}
RC_HD bool has_zero_bits(Floats a) {
    return _mm_movemask_epi8(_mm_cmpeq_epi32(_mm_castps_si128(a), _mm_setzero_si128())) != 0;
}
RC_HD void store_floats(float* to, Floats a) {
    _mm_storeu_ps(to, a);
}

#else

using Floats = v128_t;
struct Doubles {
    v128_t v;
};

RC_HD Doubles both(double a) {
    return {wasm_f64x2_splat(a)};
}
RC_HD Doubles widen_lower(Floats a) {
    return {wasm_f64x2_promote_low_f32x4(a)};
}
RC_HD Doubles widen_upper(Floats a) {
    return {wasm_f64x2_promote_low_f32x4(wasm_i64x2_shuffle(a, a, 1, 1))};
}
RC_HD Floats narrow(Doubles lower, Doubles upper) {
    return wasm_i64x2_shuffle(wasm_f32x4_demote_f64x2_zero(lower.v), wasm_f32x4_demote_f64x2_zero(upper.v), 0,
                              2);
}
RC_HD Doubles operator+(Doubles a, Doubles b) {
    return {wasm_f64x2_add(a.v, b.v)};
}
RC_HD Doubles operator-(Doubles a, Doubles b) {
    return {wasm_f64x2_sub(a.v, b.v)};
}
RC_HD Doubles operator*(Doubles a, Doubles b) {
    return {wasm_f64x2_mul(a.v, b.v)};
}

RC_HD Doubles add_to_bits(Doubles a, int64_t n) {
    return {wasm_i64x2_add(a.v, wasm_i64x2_splat(n))};
}
RC_HD Doubles keep_bits(Doubles a, int64_t mask) {
    return {wasm_v128_and(a.v, wasm_i64x2_splat(mask))};
}
RC_HD Floats lower_halves(Doubles lower, Doubles upper) {
    return wasm_i32x4_shuffle(lower.v, upper.v, 0, 2, 4, 6);
}
RC_HD Doubles to_odd(Doubles sum, Doubles error) {
    const v128_t zero = wasm_f64x2_const_splat(0.0);
    const v128_t one = wasm_i64x2_const_splat(1);
    const v128_t inexact = wasm_v128_or(wasm_f64x2_lt(error.v, zero), wasm_f64x2_lt(zero, error.v));
    const v128_t even = wasm_i64x2_eq(wasm_v128_and(sum.v, one), wasm_i64x2_const_splat(0));
    const v128_t step = wasm_v128_or(wasm_i64x2_shr(wasm_v128_xor(sum.v, error.v), 63), one);
    return {wasm_i64x2_add(sum.v, wasm_v128_and(step, wasm_v128_and(even, inexact)))};
}

RC_HD Floats four(float a) {
    return wasm_f32x4_splat(a);
}
RC_HD Floats load_floats(const float* from) {
    return wasm_v128_load(from);
}
RC_HD Floats only(float a) {
    return wasm_f32x4_replace_lane(wasm_f32x4_const_splat(0.0f), 0, a);
}
RC_HD Floats added(Floats a, Floats b) {
    return wasm_f32x4_add(a, b);
}
RC_HD Floats keep_bits(Floats a, int32_t mask) {
    return wasm_v128_and(a, wasm_i32x4_splat(mask));
}
RC_HD Floats lesser(Floats a, Floats b) {
    return wasm_f32x4_pmin(b, a);
}
RC_HD Floats nan_where_zero(Floats a) {
    return wasm_v128_or(a, wasm_f32x4_eq(a, wasm_f32x4_const_splat(0.0f)));
}
RC_HD bool has_zero_bits(Floats a) {
    return !wasm_i32x4_all_true(a);
}
RC_HD void store_floats(float* to, Floats a) {
    wasm_v128_store(to, a);
}

#endif

// a + b rounded to odd: where it is inexact, the neighbour whose last bit is 1. A double keeps more than two
// bits beyond a float, so rounding that to float is as if the exact sum had been rounded once (Boldo and
// Melquiond, "Emulation of a FMA and correctly rounded sums", 2008). The error of the sum is Knuth's TwoSum.
RC_HD Doubles add_rounding_to_odd(Doubles a, Doubles b) {
    const Doubles sum = a + b;
    const Doubles b_part = sum - a;
    return to_odd(sum, (a - (sum - b_part)) + (b - b_part));
}

}  // namespace
}  // namespace racecraft::RC_ISA

#endif
