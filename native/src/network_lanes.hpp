// Vectors of floats for the network's kernels, one definition per instruction set: 16 lanes with AVX-512, 8
// with AVX2, 4 otherwise. Include only from *_kernel.cpp.
//
// Lanes never meet: every operation works on each lane by itself, in IEEE 754 arithmetic with an explicit
// fused multiply-add, so the width of a vector cannot change a result.
#pragma once

#include <cmath>

#include "racecraft/platform.hpp"

#if defined(__AVX2__)
#include <immintrin.h>
#endif

#if defined(__GNUC__) && !defined(__clang__)
// GCC 12's own AVX-512 header leaves pass-through operands undefined on purpose and then warns of it.
#pragma GCC diagnostic ignored "-Wmaybe-uninitialized"
#endif

namespace racecraft::RC_ISA {
namespace {

#if defined(__AVX512F__)

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

#elif defined(__AVX2__)

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
