// Vectors of bytes for kernels, one definition per instruction set: 64 with AVX-512, 32 with AVX2, 16 with
// SSE2 and NEON, one byte elsewhere, with the functions of lens.hpp. Include only from *_kernel.cpp.
#pragma once

#include "racecraft/lens.hpp"

#if defined(RC_SCALAR)  // the reference alone
#elif defined(__AVX2__)
#include <immintrin.h>
#elif defined(__SSE2__)
#include <emmintrin.h>
#elif defined(__aarch64__) && defined(__ARM_NEON)
#include <arm_neon.h>
#endif

namespace racecraft::RC_ISA {
namespace {

#if !defined(RC_SCALAR) && defined(__AVX512BW__)

struct Bytes {
    static constexpr int kCount = 64;
    __m512i v;
};

RC_HD Bytes splat_bytes(uint8_t value) {
    return {_mm512_set1_epi8(static_cast<char>(value))};
}
RC_HD Bytes load_bytes(const uint8_t* from) {
    return {_mm512_loadu_si512(from)};
}
RC_HD void store_bytes(uint8_t* to, Bytes a) {
    _mm512_storeu_si512(to, a.v);
}
// The first `count` of them, fewer than all.
RC_HD void store_first(uint8_t* to, Bytes a, int count) {
    _mm512_mask_storeu_epi8(to, (uint64_t{1} << count) - 1, a.v);
}
// Rounded mean, halves up.
RC_HD Bytes mean_of(Bytes a, Bytes b) {
    return {_mm512_avg_epu8(a.v, b.v)};
}
// Sum and difference within 0 to 255.
RC_HD Bytes add_bytes(Bytes a, Bytes b) {
    return {_mm512_adds_epu8(a.v, b.v)};
}
RC_HD Bytes subtract_bytes(Bytes a, Bytes b) {
    return {_mm512_subs_epu8(a.v, b.v)};
}
// Product over 256.
RC_HD Bytes share_of(Bytes a, Bytes b) {
    const __m512i zero = _mm512_setzero_si512();
    return {_mm512_packus_epi16(
        _mm512_mulhi_epu16(_mm512_unpacklo_epi8(zero, a.v), _mm512_unpacklo_epi8(b.v, zero)),
        _mm512_mulhi_epu16(_mm512_unpackhi_epi8(zero, a.v), _mm512_unpackhi_epi8(b.v, zero)))};
}

#elif !defined(RC_SCALAR) && defined(__AVX2__)

struct Bytes {
    static constexpr int kCount = 32;
    __m256i v;
};

RC_HD Bytes splat_bytes(uint8_t value) {
    return {_mm256_set1_epi8(static_cast<char>(value))};
}
RC_HD Bytes load_bytes(const uint8_t* from) {
    return {_mm256_loadu_si256(reinterpret_cast<const __m256i*>(from))};
}
RC_HD void store_bytes(uint8_t* to, Bytes a) {
    _mm256_storeu_si256(reinterpret_cast<__m256i*>(to), a.v);
}
RC_HD void store_first(uint8_t* to, Bytes a, int count) {
    alignas(32) uint8_t bytes[32];
    _mm256_store_si256(reinterpret_cast<__m256i*>(bytes), a.v);
    for (int i = 0; i < count; ++i) to[i] = bytes[i];
}
RC_HD Bytes mean_of(Bytes a, Bytes b) {
    return {_mm256_avg_epu8(a.v, b.v)};
}
RC_HD Bytes add_bytes(Bytes a, Bytes b) {
    return {_mm256_adds_epu8(a.v, b.v)};
}
RC_HD Bytes subtract_bytes(Bytes a, Bytes b) {
    return {_mm256_subs_epu8(a.v, b.v)};
}
RC_HD Bytes share_of(Bytes a, Bytes b) {
    const __m256i zero = _mm256_setzero_si256();
    return {_mm256_packus_epi16(
        _mm256_mulhi_epu16(_mm256_unpacklo_epi8(zero, a.v), _mm256_unpacklo_epi8(b.v, zero)),
        _mm256_mulhi_epu16(_mm256_unpackhi_epi8(zero, a.v), _mm256_unpackhi_epi8(b.v, zero)))};
}

#elif !defined(RC_SCALAR) && defined(__SSE2__)

struct Bytes {
    static constexpr int kCount = 16;
    __m128i v;
};

RC_HD Bytes splat_bytes(uint8_t value) {
    return {_mm_set1_epi8(static_cast<char>(value))};
}
RC_HD Bytes load_bytes(const uint8_t* from) {
    return {_mm_loadu_si128(reinterpret_cast<const __m128i*>(from))};
}
RC_HD void store_bytes(uint8_t* to, Bytes a) {
    _mm_storeu_si128(reinterpret_cast<__m128i*>(to), a.v);
}
RC_HD void store_first(uint8_t* to, Bytes a, int count) {
    alignas(16) uint8_t bytes[16];
    _mm_store_si128(reinterpret_cast<__m128i*>(bytes), a.v);
    for (int i = 0; i < count; ++i) to[i] = bytes[i];
}
RC_HD Bytes mean_of(Bytes a, Bytes b) {
    return {_mm_avg_epu8(a.v, b.v)};
}
RC_HD Bytes add_bytes(Bytes a, Bytes b) {
    return {_mm_adds_epu8(a.v, b.v)};
}
RC_HD Bytes subtract_bytes(Bytes a, Bytes b) {
    return {_mm_subs_epu8(a.v, b.v)};
}
RC_HD Bytes share_of(Bytes a, Bytes b) {
    const __m128i zero = _mm_setzero_si128();
    return {_mm_packus_epi16(_mm_mulhi_epu16(_mm_unpacklo_epi8(zero, a.v), _mm_unpacklo_epi8(b.v, zero)),
                             _mm_mulhi_epu16(_mm_unpackhi_epi8(zero, a.v), _mm_unpackhi_epi8(b.v, zero)))};
}

#elif !defined(RC_SCALAR) && defined(__aarch64__) && defined(__ARM_NEON)

struct Bytes {
    static constexpr int kCount = 16;
    uint8x16_t v;
};

RC_HD Bytes splat_bytes(uint8_t value) {
    return {vdupq_n_u8(value)};
}
RC_HD Bytes load_bytes(const uint8_t* from) {
    return {vld1q_u8(from)};
}
RC_HD void store_bytes(uint8_t* to, Bytes a) {
    vst1q_u8(to, a.v);
}
RC_HD void store_first(uint8_t* to, Bytes a, int count) {
    uint8_t bytes[16];
    vst1q_u8(bytes, a.v);
    for (int i = 0; i < count; ++i) to[i] = bytes[i];
}
RC_HD Bytes mean_of(Bytes a, Bytes b) {
    return {vrhaddq_u8(a.v, b.v)};
}
RC_HD Bytes add_bytes(Bytes a, Bytes b) {
    return {vqaddq_u8(a.v, b.v)};
}
RC_HD Bytes subtract_bytes(Bytes a, Bytes b) {
    return {vqsubq_u8(a.v, b.v)};
}
RC_HD Bytes share_of(Bytes a, Bytes b) {
    const uint8x8_t low = vshrn_n_u16(vmull_u8(vget_low_u8(a.v), vget_low_u8(b.v)), 8);
    return {vcombine_u8(low, vshrn_n_u16(vmull_high_u8(a.v, b.v), 8))};
}

#else

struct Bytes {
    static constexpr int kCount = 1;
    uint8_t v;
};

RC_HD Bytes splat_bytes(uint8_t value) {
    return {value};
}
RC_HD Bytes load_bytes(const uint8_t* from) {
    return {*from};
}
RC_HD void store_bytes(uint8_t* to, Bytes a) {
    *to = a.v;
}
RC_HD void store_first(uint8_t*, Bytes, int) {}
RC_HD Bytes mean_of(Bytes a, Bytes b) {
    return {racecraft::mean_of(a.v, b.v)};
}
RC_HD Bytes add_bytes(Bytes a, Bytes b) {
    return {racecraft::add_bytes(a.v, b.v)};
}
RC_HD Bytes subtract_bytes(Bytes a, Bytes b) {
    return {racecraft::subtract_bytes(a.v, b.v)};
}
RC_HD Bytes share_of(Bytes a, Bytes b) {
    return {racecraft::share_of(a.v, b.v)};
}

#endif

}  // namespace
}  // namespace racecraft::RC_ISA
