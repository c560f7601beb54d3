// How a kernel is written, so that the same text runs on a GPU and, in tests, on the CPU.
//
// A block's threads share the elements of RC_EACH; what one of them leaves for another is in RC_SHARED
// memory, and RC_SYNC stands between. The CPU runs a block's loops one after the other, which is what the
// barriers ask for. Nothing else may be kept between two loops.
#pragma once

#include "racecraft/batch.hpp"

#if defined(__CUDACC_RTC__)

static_assert(sizeof(racecraft::Batch) == RC_BATCH_BYTES,
              "host and device disagree about the layout of a batch");

#define RC_KERNEL(name, threads)                          \
    extern "C" __global__ void __launch_bounds__(threads) \
        name(const __grid_constant__ racecraft::Batch batch, const void* input, const void* extra)
#define RC_SHARED __shared__
#define RC_SYNC() __syncthreads()
#define RC_BLOCK static_cast<int32_t>(blockIdx.x)
#define RC_EACH(i, count) \
    for (int32_t i = static_cast<int32_t>(threadIdx.x); i < (count); i += static_cast<int32_t>(blockDim.x))

#else

static int32_t rc_block;

#define RC_KERNEL(name, threads)                                                                         \
    static void name(const racecraft::Batch& batch, const void* input, const void* extra);               \
    extern "C" void run_##name(int32_t blocks, const racecraft::Batch* batch, const void* input,         \
                               const void* extra) {                                                      \
        for (rc_block = 0; rc_block < blocks; ++rc_block) name(*batch, input, extra);                    \
    }                                                                                                    \
    static void name([[maybe_unused]] const racecraft::Batch& batch, [[maybe_unused]] const void* input, \
                     [[maybe_unused]] const void* extra)
#define RC_SHARED static
#define RC_SYNC()
#define RC_BLOCK rc_block
#define RC_EACH(i, count) for (int32_t i = 0; i < (count); ++i)

#endif

// Runs its body for every car of the block.
#define RC_EACH_CAR(env)                       \
    RC_EACH(rc_thread, racecraft::kCarThreads) \
    if (const int32_t env = RC_BLOCK * racecraft::kCarThreads + rc_thread; env < batch.num_envs)
