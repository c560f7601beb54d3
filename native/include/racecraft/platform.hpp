// What makes a function of the core fit for every engine: CPU scalar, CPU vector block, GPU thread.
#pragma once

#if defined(__CUDACC_RTC__)
// NVRTC compiles without a standard library.
using int8_t = signed char;
using uint8_t = unsigned char;
using int16_t = short;
using uint16_t = unsigned short;
using int32_t = int;
using uint32_t = unsigned int;
using int64_t = long;
using uint64_t = unsigned long;
#define __builtin_memcpy memcpy
#else
#include <cstddef>
#include <cstdint>
#endif

// RC_APART: a function too large to be repeated wherever it is called.
#if defined(__CUDACC__)
#define RC_HD __host__ __device__ inline
#define RC_APART __noinline__
#else
// Internal linkage, so that one instruction set's copy can never be linked into another's kernel.
#define RC_HD [[gnu::always_inline]] static inline
#define RC_APART
#endif
