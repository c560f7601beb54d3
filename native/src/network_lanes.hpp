// Vectors of floats for the network's kernels, one definition per instruction set: 16 lanes with AVX-512, 8
// with AVX2, 4 with SSE2, NEON, WebAssembly's SIMD or otherwise. Include only from *_kernel.cpp.
//
// Lanes never meet: every operation works on each lane by itself, in IEEE 754 arithmetic with an explicit
// fused multiply-add, so the width of a vector cannot change a result.
#pragma once

#include <cmath>

#include "doubles.hpp"
#include "racecraft/platform.hpp"
#include "scalar_multiply_add.hpp"

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
#if defined(__wasm__)
    return each_lane([&](int i) { return scalar_multiply_add(a.v[i], b.v[i], c.v[i]); });
#else
    return each_lane([&](int i) { return std::fma(a.v[i], b.v[i], c.v[i]); });
#endif
}
RC_HD FloatLanes relu(FloatLanes a) {
    return each_lane([&](int i) { return a.v[i] < 0.0f ? 0.0f : a.v[i]; });
}
RC_HD FloatLanes where_positive(FloatLanes a, FloatLanes b) {
    return each_lane([&](int i) { return a.v[i] > 0.0f ? b.v[i] : 0.0f; });
}

#endif

#if defined(RC_HAS_DOUBLES)

struct DoubleLanes {
    Doubles low, high;
};

RC_HD DoubleLanes widen(FloatLanes a) {
    return {widen_lower(a.v), widen_upper(a.v)};
}
RC_HD FloatLanes narrow(DoubleLanes a) {
    return {narrow(a.low, a.high)};
}
RC_HD FloatLanes fused_multiply_add(DoubleLanes a, DoubleLanes b, DoubleLanes c) {
    return {narrow(add_rounding_to_odd(a.low * b.low, c.low), add_rounding_to_odd(a.high * b.high, c.high))};
}
RC_HD FloatLanes fused_multiply_add(FloatLanes a, FloatLanes b, FloatLanes c) {
    return fused_multiply_add(widen(a), widen(b), widen(c));
}

#endif

}  // namespace
}  // namespace racecraft::RC_ISA
