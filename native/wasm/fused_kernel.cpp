// Whether this machine's fused multiply-add is one: relaxed SIMD leaves the rounding of the product to it.
#include "fused_kernel.hpp"

#include <limits>

#include "network_lanes.hpp"

namespace racecraft::RC_ISA {
namespace {

bool gives(float factor, float other, float addend, float expected) {
    volatile float a = factor, b = other, c = addend;  // so that no compiler works it out
    float sums[FloatLanes::kCount];
    store(sums, fused_multiply_add(splat(a), splat(b), splat(c)));
    bool all = true;
    for (const float sum : sums) all = all && sum == expected;
    return all;
}

}  // namespace

bool is_multiply_add_fused() {
    constexpr float kFactor = 1.0f + 0x1p-12f, kBelow = 1.0f + 0x1p-11f, kAbove = kBelow + 0x1p-23f;
    constexpr float kInfinite = std::numeric_limits<float>::infinity();
    // kFactor^2 = kBelow + 2^-24, in the middle between two floats: the product must be kept whole, and the
    // smallest addend decides where it goes, which a sum in double would lose.
    return gives(kFactor, kFactor, -kBelow, 0x1p-24f) && gives(kFactor, kFactor, 0x1p-80f, kAbove) &&
           gives(kFactor, kFactor, -0x1p-80f, kBelow) && gives(1.0f, 1.0f, kInfinite, kInfinite) &&
           gives(1.0f, 1.0f, -kInfinite, -kInfinite);
}

}  // namespace racecraft::RC_ISA
