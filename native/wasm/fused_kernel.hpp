// What relaxed SIMD does here.
#pragma once

namespace racecraft::RC_ISA {

// Whether a product is kept whole until the sum is rounded, as the learner's bits need it.
bool is_multiply_add_fused();

}  // namespace racecraft::RC_ISA
