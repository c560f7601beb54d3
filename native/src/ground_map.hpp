// Builds and owns the ground of a track (include/racecraft/ground.hpp says what it is).
#pragma once

#include <vector>

#include "racecraft/ground.hpp"
#include "track_outline.hpp"

namespace racecraft {

struct GroundOptions {
    float texel = 0.01f;                  // m, wanted size of an edge texel; rounded to 0.01 * 2^n
    size_t max_bytes = size_t{24} << 20;  // the texel grows until the whole pyramid fits
};

class GroundMap {
  public:
    // Throws std::invalid_argument for fewer than two points or coordinates that are not finite.
    explicit GroundMap(const TrackOutline& outline, const GroundOptions& options = {});

    GroundMap(GroundMap&&) = default;
    GroundMap& operator=(GroundMap&&) = default;

    const GroundView& view() const { return view_; }
    size_t num_bytes() const { return texels_.size() * sizeof(uint32_t); }

  private:
    std::vector<uint32_t> texels_;
    GroundView view_{};
};

}  // namespace racecraft
