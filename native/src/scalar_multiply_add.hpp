// a * b + c of floats, rounded once, in doubles: for WebAssembly, whose C library rounds what is below the
// normal numbers twice (musl's fmaf asks for floating-point exceptions, of which there are none).
#pragma once

#include <bit>
#include <cstdint>

#include "racecraft/platform.hpp"

namespace racecraft {

// As add_rounding_to_odd() of doubles.hpp, in which the sources are named.
RC_HD float scalar_multiply_add(float a, float b, float c) {
    const double product = static_cast<double>(a) * static_cast<double>(b), addend = static_cast<double>(c);
    const double sum = product + addend, part = sum - product;
    const double error = (product - (sum - part)) + (addend - part);
    const uint64_t bits = std::bit_cast<uint64_t>(sum);
    const bool is_inexact = error < 0.0 || error > 0.0;  // not if NaN, which is the error of an infinite sum
    if (!is_inexact || (bits & 1) != 0) return static_cast<float>(sum);
    const bool is_larger = (error < 0.0) == (sum < 0.0);
    return static_cast<float>(std::bit_cast<double>(is_larger ? bits + 1 : bits - 1));
}

}  // namespace racecraft
