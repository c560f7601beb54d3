// What ground.hpp says of a pixel, for the pixels of a vector. Include only from *_kernel.cpp.
#pragma once

#include "lanes.hpp"
#include "racecraft/ground.hpp"

#if defined(RC_HAS_LANES)

namespace racecraft::RC_ISA {
namespace {

// Calls work(i, lanes) for vectors that begin at pixel i and together cover [begin, end).
template <typename Work>
RC_HD void for_each_vector(int begin, int end, const Work& work) {
    int i = begin;
    for (; i + Lanes::kCount <= end; i += Lanes::kCount) work(i, AllLanes{});
    if (i < end) work(i, first_lanes(end - i));
}

struct WalkLanes {
    Lanes u, v, du, dv;
};

RC_HD WalkLanes start_walk(uint32_t u, uint32_t v, uint32_t du, uint32_t dv) {
    const Lanes lane = lane_numbers();
    return {splat(static_cast<int32_t>(u)) + lane * splat(static_cast<int32_t>(du)),
            splat(static_cast<int32_t>(v)) + lane * splat(static_cast<int32_t>(dv)),
            splat(static_cast<int32_t>(du * Lanes::kCount)), splat(static_cast<int32_t>(dv * Lanes::kCount))};
}

// Bytes from a level's first texel to that of texel_index(): of the row of tiles, of the tile, then of the
// row and the column in the tile. tile_row is the bytes of a row of tiles.
RC_HD Lanes offset_lanes(Lanes u, Lanes v, Lanes tile_row) {
    const Lanes in_tile_row = (shift_right(u, 12) & splat(~63)) | (shift_right(v, 12) & splat(48)) |
                              (shift_right(u, 14) & splat(12));
    return shift_right(v, 18) * tile_row + in_tile_row;
}

RC_HD Lanes tile_row_of(const GroundLevel& level) {
    return splat(level.tiles_per_row * 64);
}

// edge_distance() and edge_growth() for steps that are the same in all lanes.
#if defined(RC_HAS_BYTE_PRODUCTS)

RC_HD Lanes distance_lanes(Lanes texel, Lanes u, Lanes v) {
    const Lanes position =
        (shift_right(u, 8) & splat(255)) | (v & splat(255 << 8)) | splat(kEdgeOffsetScale << 16);
    return dot_bytes(position, texel);
}

struct StepLanes {
    Lanes both;  // shifted by 128, as bytes of dot_bytes() are unsigned on this side
};

RC_HD StepLanes step_lanes(int32_t x, int32_t y) {
    return {splat(((y + 128) << 8) | (x + 128))};
}

RC_HD Lanes growth_lanes(Lanes texel, const StepLanes& step) {
    return dot_bytes(step.both, texel) - dot_bytes(splat((128 << 8) | 128), texel);
}

#else

RC_HD Lanes distance_lanes(Lanes texel, Lanes u, Lanes v) {
    const Lanes low = (shift_right(u, 8) & splat(255)) | splat(kEdgeOffsetScale << 16);
    return dot_halves(low, low_bytes(texel), shift_right(v, 8) & splat(255), high_bytes(texel));
}

struct StepLanes {
    Lanes x, y;  // lower halves
};

RC_HD StepLanes step_lanes(int32_t x, int32_t y) {
    return {splat(x & 0xffff), splat(y & 0xffff)};
}

RC_HD Lanes growth_lanes(Lanes texel, const StepLanes& step) {
    return dot_halves(step.x, low_bytes(texel), step.y, high_bytes(texel));
}

#endif

// What the two sides of the border have of shade_edge(): unit less coverage, and coverage.
RC_HD Lanes coverage_lanes(Lanes distance, Lanes sharpness) {
    constexpr int32_t half = kCoverageUnit / 2;
    const Lanes ramp = shift_right_signed(distance * sharpness, 16);
    const Lanes above = clamp_lanes(ramp, splat(-half), splat(half));
    return shift_left(above, 16) - above + splat(half << 16 | half);
}

}  // namespace
}  // namespace racecraft::RC_ISA

#endif
