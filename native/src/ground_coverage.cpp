#include "ground_coverage.hpp"

#include <algorithm>
#include <cmath>

namespace racecraft {
namespace {

Coverage covered_by(int32_t material) {
    Coverage coverage{};
    coverage.share[material] = 65536u;
    return coverage;
}

double share_above_border(uint32_t texel) {
    const double x = static_cast<int8_t>(texel & 255);
    const double y = static_cast<int8_t>(texel >> 8 & 255);
    const double offset = static_cast<int8_t>(texel >> 16 & 255);
    const double high = std::max(std::fabs(x), std::fabs(y)) * 256.0;
    const double low = std::min(std::fabs(x), std::fabs(y)) * 256.0;
    return share_above(127.5 * (x + y) + kEdgeOffsetScale * offset, high, low);
}

Coverage coverage_of(uint32_t texel) {
    const MaterialPair pair = kMaterialPairs[texel >> 24];
    const uint32_t above = static_cast<uint32_t>(std::floor(65536.0 * share_above_border(texel) + 0.5));
    Coverage coverage{};
    coverage.share[pair.above] += above;
    coverage.share[pair.below] += 65536u - above;
    return coverage;
}

// Divides the parts, which sum to 4 * 65536, by divisor, which divides that sum, so that the results still
// sum up: the largest remainders are rounded up.
void share_out(const uint32_t* parts, uint32_t divisor, uint32_t* results) {
    uint32_t missing = 4u * 65536u / divisor;
    uint32_t remainders[kNumMaterials];
    for (int i = 0; i < kNumMaterials; ++i) {
        results[i] = parts[i] / divisor;
        remainders[i] = parts[i] % divisor;
        missing -= results[i];
    }
    for (; missing > 0; --missing) {
        const auto largest = std::max_element(remainders, remainders + kNumMaterials) - remainders;
        ++results[largest];
        remainders[largest] = 0;
    }
}

}  // namespace

double share_above(double center, double high, double low) {
    const double depth = std::fabs(center);
    const double reach = 0.5 * (high + low);
    double share = 1.0;
    if (depth < 0.5 * (high - low)) {
        share = 0.5 + depth / high;
    } else if (depth < reach) {
        share = 1.0 - (reach - depth) * (reach - depth) / (2.0 * high * low);
    }
    return center < 0.0 ? 1.0 - share : share;
}

Covered::Covered(const GroundLevel& level)
    : columns_(level.columns),
      rows_(level.rows),
      soles_(size_t(level.columns) * level.rows),
      shares_(std::make_unique_for_overwrite<Coverage[]>(soles_.size())) {}

void Covered::put(int column, int row, uint32_t texel) {
    const uint32_t material = (texel >> 24) - kGrainPairs;  // wraps for pairs of two materials
    const bool is_sole = material < kNumMaterials;
    soles_[at(column, row)] = is_sole ? static_cast<uint8_t>(material) : kMixed;
    if (!is_sole) shares_[at(column, row)] = coverage_of(texel);
}

// The only material of 2 x 2 texels, or kMixed.
uint8_t Covered::sole_of_four(int column, int row) const {
    if (column + 1 >= columns_ || row + 1 >= rows_) return kMixed;
    const uint8_t* upper = &soles_[at(column, row)];
    const uint8_t* lower = upper + columns_;
    return upper[0] == upper[1] && upper[0] == lower[0] && upper[0] == lower[1] ? upper[0] : kMixed;
}

// Beyond the room lies field.
Coverage Covered::get(int column, int row) const {
    if (column >= columns_ || row >= rows_) return covered_by(kField);
    const uint8_t sole = soles_[at(column, row)];
    return sole == kMixed ? shares_[at(column, row)] : covered_by(sole);
}

// Takes what four texels of the finer level cover, and returns the coverage texel.
uint32_t Covered::join(int column, int row, const Covered& finer) {
    const uint8_t sole = soles_[at(column, row)] = finer.sole_of_four(2 * column, 2 * row);
    if (sole != kMixed) return static_cast<uint32_t>(kCoverageUnit) << (8 * sole);
    uint32_t sum[kNumMaterials] = {};
    for (int k = 0; k < 4; ++k) {
        const Coverage part = finer.get(2 * column + (k & 1), 2 * row + (k >> 1));
        for (int m = 0; m < kNumMaterials; ++m) sum[m] += part.share[m];
    }
    share_out(sum, 4, shares_[at(column, row)].share);
    uint32_t bytes[kNumMaterials];
    share_out(sum, 4u * 65536u / kCoverageUnit, bytes);
    return bytes[0] | bytes[1] << 8 | bytes[2] << 16 | bytes[3] << 24;
}

}  // namespace racecraft
