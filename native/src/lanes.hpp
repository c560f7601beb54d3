// Vectors of 32-bit integers for kernels, one definition per instruction set: 16 lanes with AVX-512, 8 with
// AVX2, 4 with SSE2, NEON and WebAssembly's SIMD. Include only from *_kernel.cpp. Without RC_HAS_LANES a
// kernel runs its scalar code, which gives the same bits. With RC_HAS_BYTE_PRODUCTS bytes are multiplied by
// bytes, without it low_bytes() and high_bytes() make halves of them.
#pragma once

#include "racecraft/platform.hpp"

#if defined(RC_SCALAR)  // the reference alone
#elif defined(__AVX2__)
#include <immintrin.h>
#define RC_HAS_LANES 1
#define RC_HAS_BYTE_PRODUCTS 1
#elif defined(__SSE2__) && defined(__x86_64__)
#include <emmintrin.h>
#define RC_HAS_LANES 1
#elif defined(__aarch64__) && defined(__ARM_NEON)
#include <arm_neon.h>
#define RC_HAS_LANES 1
#elif defined(__wasm_simd128__)
#include <wasm_simd128.h>
#define RC_HAS_LANES 1
#endif

#if defined(__GNUC__) && !defined(__clang__)
// GCC 12's own AVX-512 header leaves pass-through operands undefined on purpose and then warns of it.
#pragma GCC diagnostic ignored "-Wmaybe-uninitialized"
#endif

namespace racecraft::RC_ISA {
namespace {

// In place of a mask: all lanes.
struct AllLanes {};

#if defined(RC_SCALAR)
#elif defined(__AVX512VNNI__)

struct Lanes {
    static constexpr int kCount = 16;
    __m512i v;
};
using LaneMask = __mmask16;

RC_HD Lanes splat(int32_t value) {
    return {_mm512_set1_epi32(value)};
}
RC_HD Lanes lane_numbers() {
    return {_mm512_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15)};
}
RC_HD LaneMask first_lanes(int count) {
    return static_cast<__mmask16>(count >= 16 ? 0xffff : (1 << count) - 1);
}
RC_HD Lanes operator+(Lanes a, Lanes b) {
    return {_mm512_add_epi32(a.v, b.v)};
}
RC_HD Lanes operator-(Lanes a, Lanes b) {
    return {_mm512_sub_epi32(a.v, b.v)};
}
RC_HD Lanes operator*(Lanes a, Lanes b) {
    return {_mm512_mullo_epi32(a.v, b.v)};
}
RC_HD Lanes operator&(Lanes a, Lanes b) {
    return {_mm512_and_si512(a.v, b.v)};
}
RC_HD Lanes operator|(Lanes a, Lanes b) {
    return {_mm512_or_si512(a.v, b.v)};
}
RC_HD Lanes shift_left(Lanes a, int bits) {
    return {_mm512_slli_epi32(a.v, static_cast<unsigned>(bits))};
}
RC_HD Lanes shift_right(Lanes a, int bits) {
    return {_mm512_srli_epi32(a.v, static_cast<unsigned>(bits))};
}
RC_HD Lanes shift_right_signed(Lanes a, int bits) {
    return {_mm512_srai_epi32(a.v, static_cast<unsigned>(bits))};
}
// All three within 16 bits.
RC_HD Lanes clamp_lanes(Lanes a, Lanes low, Lanes high) {
    return {_mm512_min_epi32(_mm512_max_epi32(a.v, low.v), high.v)};
}
// Dot product of the four bytes of each lane, a unsigned and b signed; pairs of products must fit 16 bits.
RC_HD Lanes dot_bytes(Lanes a, Lanes b) {
    return {_mm512_dpbusd_epi32(_mm512_setzero_si512(), a.v, b.v)};
}
// Dot product of the two signed 16-bit halves of each lane.
RC_HD Lanes dot_halves(Lanes a, Lanes b) {
    return {_mm512_madd_epi16(a.v, b.v)};
}
// The entry that the upper byte of each lane names, of a table of eight pairs of bytes, each as a half.
RC_HD Lanes look_up(const int32_t* table, Lanes a) {
    const __m256i entries = _mm256_loadu_si256(reinterpret_cast<const __m256i*>(table));
    return {_mm512_permutexvar_epi32(shift_right(a, 24).v, _mm512_broadcast_i64x4(entries))};
}
// The words at base and so many bytes; what lanes outside the mask hold is nobody's business.
RC_HD Lanes gather(const uint32_t* base, Lanes offset, LaneMask mask) {
    return {_mm512_mask_i32gather_epi32(_mm512_setzero_si512(), mask, offset.v, base, 1)};
}
RC_HD Lanes gather(const uint32_t* base, Lanes offset, AllLanes) {
    return {_mm512_i32gather_epi32(offset.v, base, 1)};
}
RC_HD void add_to(int32_t* sums, Lanes value, AllLanes) {
    _mm512_storeu_si512(sums, _mm512_add_epi32(_mm512_loadu_si512(sums), value.v));
}
RC_HD void add_to(int32_t* sums, Lanes value, LaneMask mask) {
    _mm512_mask_storeu_epi32(sums, mask, _mm512_add_epi32(_mm512_loadu_si512(sums), value.v));
}
RC_HD Lanes load(const int32_t* values) {
    return {_mm512_loadu_si512(values)};
}
// The low 16 bits of each lane.
RC_HD void store_halves(uint8_t* out, Lanes a) {
    _mm256_storeu_si256(reinterpret_cast<__m256i*>(out), _mm512_cvtepi32_epi16(a.v));
}

#elif defined(__AVX2__)

struct Lanes {
    static constexpr int kCount = 8;
    __m256i v;
};
using LaneMask = __m256i;

RC_HD Lanes splat(int32_t value) {
    return {_mm256_set1_epi32(value)};
}
RC_HD Lanes lane_numbers() {
    return {_mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7)};
}
RC_HD LaneMask first_lanes(int count) {
    return _mm256_cmpgt_epi32(_mm256_set1_epi32(count), lane_numbers().v);
}
RC_HD Lanes operator+(Lanes a, Lanes b) {
    return {_mm256_add_epi32(a.v, b.v)};
}
RC_HD Lanes operator-(Lanes a, Lanes b) {
    return {_mm256_sub_epi32(a.v, b.v)};
}
RC_HD Lanes operator*(Lanes a, Lanes b) {
    return {_mm256_mullo_epi32(a.v, b.v)};
}
RC_HD Lanes operator&(Lanes a, Lanes b) {
    return {_mm256_and_si256(a.v, b.v)};
}
RC_HD Lanes operator|(Lanes a, Lanes b) {
    return {_mm256_or_si256(a.v, b.v)};
}
RC_HD Lanes shift_left(Lanes a, int bits) {
    return {_mm256_slli_epi32(a.v, bits)};
}
RC_HD Lanes shift_right(Lanes a, int bits) {
    return {_mm256_srli_epi32(a.v, bits)};
}
RC_HD Lanes shift_right_signed(Lanes a, int bits) {
    return {_mm256_srai_epi32(a.v, bits)};
}
RC_HD Lanes clamp_lanes(Lanes a, Lanes low, Lanes high) {
    return {_mm256_min_epi32(_mm256_max_epi32(a.v, low.v), high.v)};
}
RC_HD Lanes dot_bytes(Lanes a, Lanes b) {
    return {_mm256_madd_epi16(_mm256_maddubs_epi16(a.v, b.v), _mm256_set1_epi16(1))};
}
RC_HD Lanes dot_halves(Lanes a, Lanes b) {
    return {_mm256_madd_epi16(a.v, b.v)};
}
RC_HD Lanes look_up(const int32_t* table, Lanes a) {
    const __m256i entries = _mm256_loadu_si256(reinterpret_cast<const __m256i*>(table));
    return {_mm256_permutevar8x32_epi32(entries, shift_right(a, 24).v)};
}
RC_HD Lanes gather(const uint32_t* base, Lanes offset, LaneMask mask) {
    const int* words = reinterpret_cast<const int*>(base);
    return {_mm256_mask_i32gather_epi32(_mm256_setzero_si256(), words, offset.v, mask, 1)};
}
RC_HD Lanes gather(const uint32_t* base, Lanes offset, AllLanes) {
    return {_mm256_i32gather_epi32(reinterpret_cast<const int*>(base), offset.v, 1)};
}
RC_HD void add_to(int32_t* sums, Lanes value, AllLanes) {
    __m256i* const to = reinterpret_cast<__m256i*>(sums);
    _mm256_storeu_si256(to, _mm256_add_epi32(_mm256_loadu_si256(to), value.v));
}
RC_HD void add_to(int32_t* sums, Lanes value, LaneMask mask) {
    add_to(sums, {_mm256_and_si256(value.v, mask)}, AllLanes{});
}
RC_HD Lanes load(const int32_t* values) {
    return {_mm256_loadu_si256(reinterpret_cast<const __m256i*>(values))};
}
RC_HD void store_halves(uint8_t* out, Lanes a) {
    const __m256i packed = _mm256_packus_epi32(a.v, a.v);
    const __m256i ordered = _mm256_permute4x64_epi64(packed, 0x08);
    _mm_storeu_si128(reinterpret_cast<__m128i*>(out), _mm256_castsi256_si128(ordered));
}

#elif defined(__SSE2__) && defined(__x86_64__)

struct Lanes {
    static constexpr int kCount = 4;
    __m128i v;
};
using LaneMask = __m128i;

RC_HD Lanes splat(int32_t value) {
    return {_mm_set1_epi32(value)};
}
RC_HD Lanes lane_numbers() {
    return {_mm_setr_epi32(0, 1, 2, 3)};
}
RC_HD LaneMask first_lanes(int count) {
    return _mm_cmpgt_epi32(_mm_set1_epi32(count), lane_numbers().v);
}
RC_HD Lanes operator+(Lanes a, Lanes b) {
    return {_mm_add_epi32(a.v, b.v)};
}
RC_HD Lanes operator-(Lanes a, Lanes b) {
    return {_mm_sub_epi32(a.v, b.v)};
}
// The lower halves of 64-bit products, which signs do not touch.
RC_HD Lanes operator*(Lanes a, Lanes b) {
    const __m128i even = _mm_mul_epu32(a.v, b.v);
    const __m128i odd = _mm_mul_epu32(_mm_srli_epi64(a.v, 32), _mm_srli_epi64(b.v, 32));
    const __m128 both = _mm_shuffle_ps(_mm_castsi128_ps(even), _mm_castsi128_ps(odd), 0x88);
    return {_mm_shuffle_epi32(_mm_castps_si128(both), 0xD8)};
}
RC_HD Lanes operator&(Lanes a, Lanes b) {
    return {_mm_and_si128(a.v, b.v)};
}
RC_HD Lanes operator|(Lanes a, Lanes b) {
    return {_mm_or_si128(a.v, b.v)};
}
RC_HD Lanes shift_left(Lanes a, int bits) {
    return {_mm_slli_epi32(a.v, bits)};
}
RC_HD Lanes shift_right(Lanes a, int bits) {
    return {_mm_srli_epi32(a.v, bits)};
}
RC_HD Lanes shift_right_signed(Lanes a, int bits) {
    return {_mm_srai_epi32(a.v, bits)};
}
// The upper half of a lane is its sign, which is compared as a number as well.
RC_HD Lanes clamp_lanes(Lanes a, Lanes low, Lanes high) {
    return {_mm_min_epi16(_mm_max_epi16(a.v, low.v), high.v)};
}
// Bytes 0 and 2 of each lane, and bytes 1 and 3, as signed halves.
RC_HD Lanes low_bytes(Lanes a) {
    return {_mm_srai_epi16(_mm_slli_epi16(a.v, 8), 8)};
}
RC_HD Lanes high_bytes(Lanes a) {
    return {_mm_srai_epi16(a.v, 8)};
}
RC_HD Lanes dot_halves(Lanes a, Lanes b) {
    return {_mm_madd_epi16(a.v, b.v)};
}
// The sum of two dot products whose products fit 16 bits.
RC_HD Lanes dot_halves(Lanes a, Lanes b, Lanes c, Lanes d) {
    return dot_halves(a, b) + dot_halves(c, d);
}
RC_HD Lanes dot_bytes(Lanes a, Lanes b) {
    const Lanes first = {_mm_and_si128(a.v, _mm_set1_epi16(255))};
    return dot_halves(first, low_bytes(b), {_mm_srli_epi16(a.v, 8)}, high_bytes(b));
}
RC_HD Lanes gather(const uint32_t* base, Lanes offset, AllLanes) {
    const auto lower = static_cast<uint64_t>(_mm_cvtsi128_si64(offset.v));
    const auto upper = static_cast<uint64_t>(_mm_cvtsi128_si64(_mm_unpackhi_epi64(offset.v, offset.v)));
    const char* bytes = reinterpret_cast<const char*>(base);
    const auto at = [bytes](uint64_t i) { return _mm_loadu_si32(bytes + i); };
    return {_mm_unpacklo_epi64(_mm_unpacklo_epi32(at(lower & 0xffffffff), at(lower >> 32)),
                               _mm_unpacklo_epi32(at(upper & 0xffffffff), at(upper >> 32)))};
}
RC_HD Lanes look_up(const int32_t* table, Lanes a) {
    return gather(reinterpret_cast<const uint32_t*>(table), shift_left(shift_right(a, 24), 2), AllLanes{});
}
// Lanes outside the mask read the first word.
RC_HD Lanes gather(const uint32_t* base, Lanes offset, LaneMask mask) {
    return gather(base, {_mm_and_si128(offset.v, mask)}, AllLanes{});
}
RC_HD Lanes load(const int32_t* values) {
    return {_mm_loadu_si128(reinterpret_cast<const __m128i*>(values))};
}
RC_HD void add_to(int32_t* sums, Lanes value, AllLanes) {
    _mm_storeu_si128(reinterpret_cast<__m128i*>(sums), (load(sums) + value).v);
}
RC_HD void add_to(int32_t* sums, Lanes value, LaneMask mask) {
    add_to(sums, {_mm_and_si128(value.v, mask)}, AllLanes{});
}
RC_HD void store_halves(uint8_t* out, Lanes a) {
    const __m128i low = _mm_shufflelo_epi16(a.v, 0x08);
    const __m128i both = _mm_shuffle_epi32(_mm_shufflehi_epi16(low, 0x08), 0x08);
    _mm_storel_epi64(reinterpret_cast<__m128i*>(out), both);
}

#elif defined(__aarch64__) && defined(__ARM_NEON)

struct Lanes {
    static constexpr int kCount = 4;
    int32x4_t v;
};
using LaneMask = int32x4_t;

// As halves and bytes, whatever they held before.
RC_HD int16x8_t halves_of(int32x4_t a) {
    return vreinterpretq_s16_s32(a);
}
RC_HD Lanes splat(int32_t value) {
    return {vdupq_n_s32(value)};
}
RC_HD Lanes lane_numbers() {
    return {int32x4_t{0, 1, 2, 3}};
}
RC_HD LaneMask first_lanes(int count) {
    return vreinterpretq_s32_u32(vcgtq_s32(vdupq_n_s32(count), lane_numbers().v));
}
RC_HD Lanes operator+(Lanes a, Lanes b) {
    return {vaddq_s32(a.v, b.v)};
}
RC_HD Lanes operator-(Lanes a, Lanes b) {
    return {vsubq_s32(a.v, b.v)};
}
RC_HD Lanes operator*(Lanes a, Lanes b) {
    return {vmulq_s32(a.v, b.v)};
}
RC_HD Lanes operator&(Lanes a, Lanes b) {
    return {vandq_s32(a.v, b.v)};
}
RC_HD Lanes operator|(Lanes a, Lanes b) {
    return {vorrq_s32(a.v, b.v)};
}
// Operators, since NEON's shifts by a constant take nothing that an optimiser makes one.
RC_HD Lanes shift_left(Lanes a, int bits) {
    return {vreinterpretq_s32_u32(vreinterpretq_u32_s32(a.v) << static_cast<uint32_t>(bits))};
}
RC_HD Lanes shift_right(Lanes a, int bits) {
    return {vreinterpretq_s32_u32(vreinterpretq_u32_s32(a.v) >> static_cast<uint32_t>(bits))};
}
RC_HD Lanes shift_right_signed(Lanes a, int bits) {
    return {a.v >> bits};
}
RC_HD Lanes clamp_lanes(Lanes a, Lanes low, Lanes high) {
    return {vminq_s32(vmaxq_s32(a.v, low.v), high.v)};
}
// Bytes 0 and 2 of each lane, and bytes 1 and 3, as signed halves.
RC_HD Lanes low_bytes(Lanes a) {
    return {vreinterpretq_s32_s16(vshrq_n_s16(vshlq_n_s16(halves_of(a.v), 8), 8))};
}
RC_HD Lanes high_bytes(Lanes a) {
    return {vreinterpretq_s32_s16(vshrq_n_s16(halves_of(a.v), 8))};
}
// The sum of two dot products whose products fit 16 bits.
RC_HD Lanes dot_halves(Lanes a, Lanes b, Lanes c, Lanes d) {
    const int16x8_t first = vmulq_s16(halves_of(a.v), halves_of(b.v));
    return {vpadalq_s16(vpaddlq_s16(first), vmulq_s16(halves_of(c.v), halves_of(d.v)))};
}
RC_HD Lanes dot_bytes(Lanes a, Lanes b) {
    const uint16x8_t bytes = vreinterpretq_u16_s32(a.v);
    const Lanes first = {vreinterpretq_s32_u16(vandq_u16(bytes, vdupq_n_u16(255)))};
    return dot_halves(first, low_bytes(b), {vreinterpretq_s32_u16(vshrq_n_u16(bytes, 8))}, high_bytes(b));
}
RC_HD Lanes dot_halves(Lanes a, Lanes b) {
    const int16x8_t x = halves_of(a.v), y = halves_of(b.v);
    return {vpaddq_s32(vmull_s16(vget_low_s16(x), vget_low_s16(y)), vmull_high_s16(x, y))};
}
// The table as one vector of bytes; where a byte's number is not one of the vector's, there is 0.
RC_HD Lanes look_up(const int32_t* table, Lanes a) {
    const uint8x16_t entries = vcombine_u8(vmovn_u16(vreinterpretq_u16_s32(vld1q_s32(table))),
                                           vmovn_u16(vreinterpretq_u16_s32(vld1q_s32(table + 4))));
    const uint32x4_t index = vshrq_n_u32(vreinterpretq_u32_s32(a.v), 24);
    const uint32x4_t bytes = vmlaq_u32(vdupq_n_u32(0xff01ff00), index, vdupq_n_u32(0x00020002));
    return {vreinterpretq_s32_u8(vqtbl1q_u8(entries, vreinterpretq_u8_u32(bytes)))};
}
RC_HD Lanes gather(const uint32_t* base, Lanes offset, AllLanes) {
    const uint32x4_t i = vreinterpretq_u32_s32(offset.v);
    const char* bytes = reinterpret_cast<const char*>(base);
    const auto at = [bytes](uint32_t byte) { return reinterpret_cast<const uint32_t*>(bytes + byte); };
    uint32x4_t all = vld1q_dup_u32(at(vgetq_lane_u32(i, 0)));
    all = vld1q_lane_u32(at(vgetq_lane_u32(i, 1)), all, 1);
    all = vld1q_lane_u32(at(vgetq_lane_u32(i, 2)), all, 2);
    return {vreinterpretq_s32_u32(vld1q_lane_u32(at(vgetq_lane_u32(i, 3)), all, 3))};
}
// Lanes outside the mask read the first word.
RC_HD Lanes gather(const uint32_t* base, Lanes offset, LaneMask mask) {
    return gather(base, {vandq_s32(offset.v, mask)}, AllLanes{});
}
RC_HD void add_to(int32_t* sums, Lanes value, AllLanes) {
    vst1q_s32(sums, vaddq_s32(vld1q_s32(sums), value.v));
}
RC_HD void add_to(int32_t* sums, Lanes value, LaneMask mask) {
    add_to(sums, {vandq_s32(value.v, mask)}, AllLanes{});
}
RC_HD Lanes load(const int32_t* values) {
    return {vld1q_s32(values)};
}
RC_HD void store_halves(uint8_t* out, Lanes a) {
    vst1_u8(out, vreinterpret_u8_s16(vmovn_s32(a.v)));
}

#elif defined(__wasm_simd128__)

struct Lanes {
    static constexpr int kCount = 4;
    v128_t v;
};
using LaneMask = v128_t;

RC_HD Lanes splat(int32_t value) {
    return {wasm_i32x4_splat(value)};
}
RC_HD Lanes lane_numbers() {
    return {wasm_i32x4_const(0, 1, 2, 3)};
}
RC_HD LaneMask first_lanes(int count) {
    return wasm_i32x4_gt(wasm_i32x4_splat(count), lane_numbers().v);
}
RC_HD Lanes operator+(Lanes a, Lanes b) {
    return {wasm_i32x4_add(a.v, b.v)};
}
RC_HD Lanes operator-(Lanes a, Lanes b) {
    return {wasm_i32x4_sub(a.v, b.v)};
}
RC_HD Lanes operator*(Lanes a, Lanes b) {
    return {wasm_i32x4_mul(a.v, b.v)};
}
RC_HD Lanes operator&(Lanes a, Lanes b) {
    return {wasm_v128_and(a.v, b.v)};
}
RC_HD Lanes operator|(Lanes a, Lanes b) {
    return {wasm_v128_or(a.v, b.v)};
}
RC_HD Lanes shift_left(Lanes a, int bits) {
    return {wasm_i32x4_shl(a.v, static_cast<uint32_t>(bits))};
}
RC_HD Lanes shift_right(Lanes a, int bits) {
    return {wasm_u32x4_shr(a.v, static_cast<uint32_t>(bits))};
}
RC_HD Lanes shift_right_signed(Lanes a, int bits) {
    return {wasm_i32x4_shr(a.v, static_cast<uint32_t>(bits))};
}
RC_HD Lanes clamp_lanes(Lanes a, Lanes low, Lanes high) {
    return {wasm_i32x4_min(wasm_i32x4_max(a.v, low.v), high.v)};
}
// Bytes 0 and 2 of each lane, and bytes 1 and 3, as signed halves.
RC_HD Lanes low_bytes(Lanes a) {
    return {wasm_i16x8_shr(wasm_i16x8_shl(a.v, 8), 8)};
}
RC_HD Lanes high_bytes(Lanes a) {
    return {wasm_i16x8_shr(a.v, 8)};
}
RC_HD Lanes dot_halves(Lanes a, Lanes b) {
    return {wasm_i32x4_dot_i16x8(a.v, b.v)};
}
// The sum of two dot products whose products fit 16 bits.
RC_HD Lanes dot_halves(Lanes a, Lanes b, Lanes c, Lanes d) {
    return dot_halves(a, b) + dot_halves(c, d);
}
RC_HD Lanes dot_bytes(Lanes a, Lanes b) {
    const Lanes first = {wasm_v128_and(a.v, wasm_i16x8_const_splat(255))};
    return dot_halves(first, low_bytes(b), {wasm_u16x8_shr(a.v, 8)}, high_bytes(b));
}
// The table as one vector of bytes; byte 255 of it is 0, with relaxed SIMD as well.
RC_HD Lanes look_up(const int32_t* table, Lanes a) {
    const v128_t entries = wasm_u8x16_narrow_i16x8(wasm_v128_load(table), wasm_v128_load(table + 4));
    const v128_t index = wasm_i8x16_shuffle(a.v, a.v, 3, 3, 3, 3, 7, 7, 7, 7, 11, 11, 11, 11, 15, 15, 15, 15);
    const v128_t bytes = wasm_v128_or(wasm_i16x8_shl(index, 1), wasm_u32x4_const_splat(0xff01ff00));
#if defined(__wasm_relaxed_simd__)
    return {wasm_i8x16_relaxed_swizzle(entries, bytes)};
#else
    return {wasm_i8x16_swizzle(entries, bytes)};
#endif
}
RC_HD Lanes gather(const uint32_t* base, Lanes offset, AllLanes) {
    const v128_t address = wasm_i32x4_add(offset.v, wasm_u32x4_splat(reinterpret_cast<uint32_t>(base)));
    const auto at = [](uint32_t byte) { return reinterpret_cast<const uint32_t*>(byte); };
    v128_t all = wasm_v128_load32_zero(at(wasm_u32x4_extract_lane(address, 0)));
    all = wasm_v128_load32_lane(at(wasm_u32x4_extract_lane(address, 1)), all, 1);
    all = wasm_v128_load32_lane(at(wasm_u32x4_extract_lane(address, 2)), all, 2);
    return {wasm_v128_load32_lane(at(wasm_u32x4_extract_lane(address, 3)), all, 3)};
}
// Lanes outside the mask read the first word.
RC_HD Lanes gather(const uint32_t* base, Lanes offset, LaneMask mask) {
    return gather(base, {wasm_v128_and(offset.v, mask)}, AllLanes{});
}
RC_HD void add_to(int32_t* sums, Lanes value, AllLanes) {
    wasm_v128_store(sums, wasm_i32x4_add(wasm_v128_load(sums), value.v));
}
RC_HD void add_to(int32_t* sums, Lanes value, LaneMask mask) {
    add_to(sums, {wasm_v128_and(value.v, mask)}, AllLanes{});
}
RC_HD Lanes load(const int32_t* values) {
    return {wasm_v128_load(values)};
}
RC_HD void store_halves(uint8_t* out, Lanes a) {
    const v128_t packed = wasm_i16x8_shuffle(a.v, a.v, 0, 2, 4, 6, 0, 2, 4, 6);
    wasm_v128_store64_lane(out, packed, 0);
}

#endif

}  // namespace
}  // namespace racecraft::RC_ISA
