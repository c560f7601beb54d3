// How much of a texel each material covers: the coarser levels of a ground, made from the finest.
#pragma once

#include <memory>
#include <vector>

#include "racecraft/ground.hpp"

namespace racecraft {

// Share of the unit square above a straight line whose signed distance from the square's centre is `center`;
// high and low are the larger and the smaller absolute component of its normal, in the same unit.
double share_above(double center, double high, double low);

// Exact coverage while the pyramid is built, in 1/65536 of a texel; sums to 65536.
struct Coverage {
    uint32_t share[kNumMaterials];
};

// What a level's texels cover, row by row: most of a ground is one material, so the exact shares, 16 bytes a
// texel, are written and read only where several meet.
class Covered {
  public:
    explicit Covered(const GroundLevel& level);

    // Of an edge texel.
    void put(int column, int row, uint32_t texel);

    // The level that is twice as coarse; calls store(column, row, texel) for every coverage texel of it.
    template <typename Store>
    Covered coarser(const GroundLevel& level, const Store& store) const {
        Covered result(level);
        for (int row = 0; row < level.rows; ++row) {
            for (int column = 0; column < level.columns; ++column) {
                store(column, row, result.join(column, row, *this));
            }
        }
        return result;
    }

  private:
    static constexpr uint8_t kMixed = kNumMaterials;  // where several materials may meet

    size_t at(int column, int row) const { return size_t(row) * columns_ + column; }
    uint8_t sole_of_four(int column, int row) const;
    Coverage get(int column, int row) const;
    uint32_t join(int column, int row, const Covered& finer);

    int columns_, rows_;
    std::vector<uint8_t> soles_;  // the only material, or kMixed
    std::unique_ptr<Coverage[]> shares_;
};

}  // namespace racecraft
