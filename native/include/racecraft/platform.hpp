// What makes a function of the core fit for every engine: CPU scalar, CPU vector block, GPU thread.
#pragma once

#include <cstddef>
#include <cstdint>

#if defined(__CUDACC__)
#define RC_HD __host__ __device__ __forceinline__
#else
// Internal linkage, so that one instruction set's copy can never be linked into another's kernel.
#define RC_HD [[gnu::always_inline]] static inline
#endif
