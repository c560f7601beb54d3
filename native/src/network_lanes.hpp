// Vectors of floats for the network's kernels, one definition per instruction set: 16 lanes with AVX-512, 8
// with AVX2, 4 with SSE2, NEON, WebAssembly's SIMD or otherwise. Include only from *_kernel.cpp.
//
// Lanes never meet: every operation works on each lane by itself, in IEEE 754 arithmetic with an explicit
// fused multiply-add, so the width of a vector cannot change a result.
#pragma once

#include <cmath>

#include "racecraft/platform.hpp"

#if defined(RC_SCALAR)  // the reference alone
#elif defined(__AVX2__)
#include <immintrin.h>
#elif defined(__SSE2__)
#include <emmintrin.h>
#elif defined(__aarch64__) && defined(__ARM_NEON)
#include <arm_neon.h>
#elif defined(__wasm_simd128__)
#include <wasm_simd128.h>
#endif

#if defined(__GNUC__) && !defined(__clang__)
// GCC 12's own AVX-512 header leaves pass-through operands undefined on purpose and then warns of it.
#pragma GCC diagnostic ignored "-Wmaybe-uninitialized"
#endif

namespace racecraft::RC_ISA {
namespace {

#if !defined(RC_SCALAR) && defined(__AVX512F__)

struct FloatLanes {
    static constexpr int kCount = 16;
    __m512 v;
};

RC_HD FloatLanes splat(float value) {
    return {_mm512_set1_ps(value)};
}
RC_HD FloatLanes load(const float* from) {
    return {_mm512_loadu_ps(from)};
}
RC_HD void store(float* to, FloatLanes a) {
    _mm512_storeu_ps(to, a.v);
}
RC_HD FloatLanes operator+(FloatLanes a, FloatLanes b) {
    return {_mm512_add_ps(a.v, b.v)};
}
RC_HD FloatLanes operator-(FloatLanes a, FloatLanes b) {
    return {_mm512_sub_ps(a.v, b.v)};
}
RC_HD FloatLanes operator*(FloatLanes a, FloatLanes b) {
    return {_mm512_mul_ps(a.v, b.v)};
}
RC_HD FloatLanes fused_multiply_add(FloatLanes a, FloatLanes b, FloatLanes c) {
    return {_mm512_fmadd_ps(a.v, b.v, c.v)};
}
// 0 where a is negative, else a: NaN stays NaN.
RC_HD FloatLanes relu(FloatLanes a) {
    return {_mm512_max_ps(_mm512_setzero_ps(), a.v)};
}
// b where a is above 0, else 0.
RC_HD FloatLanes where_positive(FloatLanes a, FloatLanes b) {
    return {_mm512_maskz_mov_ps(_mm512_cmp_ps_mask(a.v, _mm512_setzero_ps(), _CMP_GT_OQ), b.v)};
}

#elif !defined(RC_SCALAR) && defined(__AVX2__)

struct FloatLanes {
    static constexpr int kCount = 8;
    __m256 v;
};

RC_HD FloatLanes splat(float value) {
    return {_mm256_set1_ps(value)};
}
RC_HD FloatLanes load(const float* from) {
    return {_mm256_loadu_ps(from)};
}
RC_HD void store(float* to, FloatLanes a) {
    _mm256_storeu_ps(to, a.v);
}
RC_HD FloatLanes operator+(FloatLanes a, FloatLanes b) {
    return {_mm256_add_ps(a.v, b.v)};
}
RC_HD FloatLanes operator-(FloatLanes a, FloatLanes b) {
    return {_mm256_sub_ps(a.v, b.v)};
}
RC_HD FloatLanes operator*(FloatLanes a, FloatLanes b) {
    return {_mm256_mul_ps(a.v, b.v)};
}
RC_HD FloatLanes fused_multiply_add(FloatLanes a, FloatLanes b, FloatLanes c) {
    return {_mm256_fmadd_ps(a.v, b.v, c.v)};
}
RC_HD FloatLanes relu(FloatLanes a) {
    return {_mm256_max_ps(_mm256_setzero_ps(), a.v)};
}
RC_HD FloatLanes where_positive(FloatLanes a, FloatLanes b) {
    return {_mm256_and_ps(_mm256_cmp_ps(a.v, _mm256_setzero_ps(), _CMP_GT_OQ), b.v)};
}

#elif !defined(RC_SCALAR) && defined(__SSE2__)

struct FloatLanes {
    static constexpr int kCount = 4;
    __m128 v;
};

RC_HD FloatLanes splat(float value) {
    return {_mm_set1_ps(value)};
}
RC_HD FloatLanes load(const float* from) {
    return {_mm_loadu_ps(from)};
}
RC_HD void store(float* to, FloatLanes a) {
    _mm_storeu_ps(to, a.v);
}
RC_HD FloatLanes operator+(FloatLanes a, FloatLanes b) {
    return {_mm_add_ps(a.v, b.v)};
}
RC_HD FloatLanes operator-(FloatLanes a, FloatLanes b) {
    return {_mm_sub_ps(a.v, b.v)};
}
RC_HD FloatLanes operator*(FloatLanes a, FloatLanes b) {
    return {_mm_mul_ps(a.v, b.v)};
}

// Floats in pairs as doubles, which hold the product of two floats exactly.
struct DoubleLanes {
    __m128d low, high;
};

RC_HD DoubleLanes widen(FloatLanes a) {
    return {_mm_cvtps_pd(a.v), _mm_cvtps_pd(_mm_movehl_ps(a.v, a.v))};
}
RC_HD FloatLanes narrow(DoubleLanes a) {
    return {_mm_movelh_ps(_mm_cvtpd_ps(a.low), _mm_cvtpd_ps(a.high))};
}

// a + b rounded to odd: where it is inexact, the neighbour whose last bit is 1. A double keeps more than two
// bits beyond a float, so rounding that to float is as if the exact sum had been rounded once (Boldo and
// Melquiond, "Emulation of a FMA and correctly rounded sums", 2008). The error of the sum is Knuth's TwoSum.
RC_HD __m128d add_rounding_to_odd(__m128d a, __m128d b) {
    const __m128d sum = _mm_add_pd(a, b);
    const __m128d b_part = _mm_sub_pd(sum, a);
    const __m128d error = _mm_add_pd(_mm_sub_pd(a, _mm_sub_pd(sum, b_part)), _mm_sub_pd(b, b_part));
    const __m128d zero = _mm_setzero_pd();
    // false for NaN, which is the error of an infinite sum
    const __m128d inexact = _mm_or_pd(_mm_cmplt_pd(error, zero), _mm_cmplt_pd(zero, error));
    const __m128i bits = _mm_castpd_si128(sum);
    const __m128i one = _mm_set1_epi64x(1);
    const __m128i even =
        _mm_shuffle_epi32(_mm_cmpeq_epi32(_mm_and_si128(bits, one), _mm_setzero_si128()), 0xA0);
    const __m128i signs = _mm_srai_epi32(_mm_xor_si128(bits, _mm_castpd_si128(error)), 31);
    const __m128i step = _mm_or_si128(_mm_shuffle_epi32(signs, 0xF5), one);  // away from zero 1, else -1
    return _mm_castsi128_pd(
        _mm_add_epi64(bits, _mm_and_si128(step, _mm_and_si128(even, _mm_castpd_si128(inexact)))));
}

RC_HD FloatLanes fused_multiply_add(DoubleLanes a, DoubleLanes b, DoubleLanes c) {
    return narrow({add_rounding_to_odd(_mm_mul_pd(a.low, b.low), c.low),
                   add_rounding_to_odd(_mm_mul_pd(a.high, b.high), c.high)});
}
RC_HD FloatLanes fused_multiply_add(FloatLanes a, FloatLanes b, FloatLanes c) {
    return fused_multiply_add(widen(a), widen(b), widen(c));
}
RC_HD FloatLanes relu(FloatLanes a) {
    return {_mm_max_ps(_mm_setzero_ps(), a.v)};
}
RC_HD FloatLanes where_positive(FloatLanes a, FloatLanes b) {
    return {_mm_and_ps(_mm_cmpgt_ps(a.v, _mm_setzero_ps()), b.v)};
}

#elif !defined(RC_SCALAR) && defined(__aarch64__) && defined(__ARM_NEON)

struct FloatLanes {
    static constexpr int kCount = 4;
    float32x4_t v;
};

RC_HD FloatLanes splat(float value) {
    return {vdupq_n_f32(value)};
}
RC_HD FloatLanes load(const float* from) {
    return {vld1q_f32(from)};
}
RC_HD void store(float* to, FloatLanes a) {
    vst1q_f32(to, a.v);
}
RC_HD FloatLanes operator+(FloatLanes a, FloatLanes b) {
    return {vaddq_f32(a.v, b.v)};
}
RC_HD FloatLanes operator-(FloatLanes a, FloatLanes b) {
    return {vsubq_f32(a.v, b.v)};
}
RC_HD FloatLanes operator*(FloatLanes a, FloatLanes b) {
    return {vmulq_f32(a.v, b.v)};
}
RC_HD FloatLanes fused_multiply_add(FloatLanes a, FloatLanes b, FloatLanes c) {
    return {vfmaq_f32(c.v, a.v, b.v)};
}
// Not by a maximum, which makes 0 of -0.
RC_HD FloatLanes relu(FloatLanes a) {
    return {vreinterpretq_f32_u32(vbicq_u32(vreinterpretq_u32_f32(a.v), vcltzq_f32(a.v)))};
}
RC_HD FloatLanes where_positive(FloatLanes a, FloatLanes b) {
    return {vreinterpretq_f32_u32(vandq_u32(vreinterpretq_u32_f32(b.v), vcgtzq_f32(a.v)))};
}

#elif defined(__wasm_simd128__)

struct FloatLanes {
    static constexpr int kCount = 4;
    v128_t v;
};

RC_HD FloatLanes splat(float value) {
    return {wasm_f32x4_splat(value)};
}
RC_HD FloatLanes load(const float* from) {
    return {wasm_v128_load(from)};
}
RC_HD void store(float* to, FloatLanes a) {
    wasm_v128_store(to, a.v);
}
RC_HD FloatLanes operator+(FloatLanes a, FloatLanes b) {
    return {wasm_f32x4_add(a.v, b.v)};
}
RC_HD FloatLanes operator-(FloatLanes a, FloatLanes b) {
    return {wasm_f32x4_sub(a.v, b.v)};
}
RC_HD FloatLanes operator*(FloatLanes a, FloatLanes b) {
    return {wasm_f32x4_mul(a.v, b.v)};
}
#if defined(__wasm_relaxed_simd__)
// Whether the product is rounded before the sum is the machine's choice: native/wasm/fused_kernel.cpp asks.
RC_HD FloatLanes fused_multiply_add(FloatLanes a, FloatLanes b, FloatLanes c) {
    return {wasm_f32x4_relaxed_madd(a.v, b.v, c.v)};
}
#else
// As add_rounding_to_odd() of SSE2, above.
RC_HD v128_t add_rounding_to_odd(v128_t a, v128_t b) {
    const v128_t sum = wasm_f64x2_add(a, b);
    const v128_t b_part = wasm_f64x2_sub(sum, a);
    const v128_t error =
        wasm_f64x2_add(wasm_f64x2_sub(a, wasm_f64x2_sub(sum, b_part)), wasm_f64x2_sub(b, b_part));
    const v128_t zero = wasm_f64x2_const_splat(0.0);
    const v128_t one = wasm_i64x2_const_splat(1);
    // false for NaN, which is the error of an infinite sum
    const v128_t inexact = wasm_v128_or(wasm_f64x2_lt(error, zero), wasm_f64x2_lt(zero, error));
    const v128_t even = wasm_i64x2_eq(wasm_v128_and(sum, one), wasm_i64x2_const_splat(0));
    const v128_t step = wasm_v128_or(wasm_i64x2_shr(wasm_v128_xor(sum, error), 63), one);
    return wasm_i64x2_add(sum, wasm_v128_and(step, wasm_v128_and(even, inexact)));
}
RC_HD v128_t fused_pair(v128_t a, v128_t b, v128_t c) {  // of the lower two lanes
    const v128_t product = wasm_f64x2_mul(wasm_f64x2_promote_low_f32x4(a), wasm_f64x2_promote_low_f32x4(b));
    return wasm_f32x4_demote_f64x2_zero(add_rounding_to_odd(product, wasm_f64x2_promote_low_f32x4(c)));
}
RC_HD v128_t upper_pair(v128_t a) {
    return wasm_i64x2_shuffle(a, a, 1, 1);
}
RC_HD FloatLanes fused_multiply_add(FloatLanes a, FloatLanes b, FloatLanes c) {
    const v128_t lower = fused_pair(a.v, b.v, c.v);
    const v128_t upper = fused_pair(upper_pair(a.v), upper_pair(b.v), upper_pair(c.v));
    return {wasm_i64x2_shuffle(lower, upper, 0, 2)};
}
#endif
RC_HD FloatLanes relu(FloatLanes a) {
    return {wasm_f32x4_pmax(a.v, wasm_f32x4_const_splat(0.0f))};
}
RC_HD FloatLanes where_positive(FloatLanes a, FloatLanes b) {
    return {wasm_v128_and(wasm_f32x4_gt(a.v, wasm_f32x4_const_splat(0.0f)), b.v)};
}

#else

struct FloatLanes {
    static constexpr int kCount = 4;
    float v[kCount];
};

template <typename Operation>
RC_HD FloatLanes each_lane(const Operation& operation) {
    return {{operation(0), operation(1), operation(2), operation(3)}};
}
RC_HD FloatLanes splat(float value) {
    return {{value, value, value, value}};
}
RC_HD FloatLanes load(const float* from) {
    return {{from[0], from[1], from[2], from[3]}};
}
RC_HD void store(float* to, FloatLanes a) {
    for (int i = 0; i < FloatLanes::kCount; ++i) to[i] = a.v[i];
}
RC_HD FloatLanes operator+(FloatLanes a, FloatLanes b) {
    return each_lane([&](int i) { return a.v[i] + b.v[i]; });
}
RC_HD FloatLanes operator-(FloatLanes a, FloatLanes b) {
    return each_lane([&](int i) { return a.v[i] - b.v[i]; });
}
RC_HD FloatLanes operator*(FloatLanes a, FloatLanes b) {
    return each_lane([&](int i) { return a.v[i] * b.v[i]; });
}
RC_HD FloatLanes fused_multiply_add(FloatLanes a, FloatLanes b, FloatLanes c) {
    return each_lane([&](int i) { return std::fma(a.v[i], b.v[i], c.v[i]); });
}
RC_HD FloatLanes relu(FloatLanes a) {
    return each_lane([&](int i) { return a.v[i] < 0.0f ? 0.0f : a.v[i]; });
}
RC_HD FloatLanes where_positive(FloatLanes a, FloatLanes b) {
    return each_lane([&](int i) { return a.v[i] > 0.0f ? b.v[i] : 0.0f; });
}

#endif

}  // namespace
}  // namespace racecraft::RC_ISA
