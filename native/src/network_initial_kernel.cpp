// Orthonormal initial weights. Sums run over a fixed number of lanes side by side, so every machine gets the
// same bits.
#include <algorithm>

#include "network_kernel.hpp"
#include "racecraft/math.hpp"

namespace racecraft::RC_ISA {
namespace {

constexpr size_t kLanes = 32;
constexpr size_t kVectors = 8;  // made orthogonal together, so that they stay in the cache

double dot(const double* a, const double* b, size_t length) {
    double sums[kLanes] = {};
    size_t i = 0;
    for (; i + kLanes <= length; i += kLanes) {
        for (size_t lane = 0; lane < kLanes; ++lane) sums[lane] += a[i + lane] * b[i + lane];
    }
    for (size_t lane = 0; i < length; ++i, ++lane) sums[lane] += a[i] * b[i];
    double total = 0.0;
    for (const double sum : sums) total += sum;
    return total;
}

// vector -= (vector . direction) direction
void remove_direction(const double* direction, size_t length, double* vector) {
    const double factor = dot(vector, direction, length);
    for (size_t i = 0; i < length; ++i) vector[i] -= factor * direction[i];
}

}  // namespace

void orthonormalize(double* vectors, size_t count, size_t length) {
    for (size_t first = 0; first < count; first += kVectors) {
        const size_t last = std::min(count, first + kVectors);
        for (size_t i = 0; i < last; ++i) {
            double* direction = vectors + i * length;
            if (i >= first) {
                const double scale = 1.0 / sqrt_of(dot(direction, direction, length));
                for (size_t k = 0; k < length; ++k) direction[k] *= scale;
            }
            for (size_t j = std::max(first, i + 1); j < last; ++j) {
                remove_direction(direction, length, vectors + j * length);
            }
        }
    }
}

}  // namespace racecraft::RC_ISA
