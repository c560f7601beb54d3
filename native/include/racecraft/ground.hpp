// The ground of a track as the cameras see it: a pyramid of 32-bit texels in tiles of one cache line (4 x 4).
//
//   level 0     edge texels      a straight border between two materials inside the texel: bytes normal x,
//   normal y,
//                                offset, pair. One fetch gives the exact distance to the border, so lines and
//                                dashes stay sharp however close the camera comes, with the pixel's own width
//                                as filter.
//   level 1...  coverage texels  how many 64ths of the texel each of the four materials covers, one byte
//   each.
//                                Texel size doubles with every level.
//
// Grain: a texel of level 0 with one material has a border, too, at random, between a darker and a lighter
// shade of it. That costs no drawing time, looks like short strokes close to the lens, and fades with
// distance by itself: the filter widens, and coverage texels know of no shades.
//
// Colours are no part of it: a car's palette is applied after the fetch, so domain randomisation is free.
// Everything after the row set-up is integer arithmetic, hence the same bits on every instruction set.
#pragma once

#include "racecraft/math.hpp"

namespace racecraft {

enum Material : int32_t { kField = 0, kRoad = 1, kEdgeLine = 2, kCenterLine = 3, kNumMaterials = 4 };

constexpr float kRoomMargin = 0.86f;       // m from the track's bounding box to the walls
constexpr float kWallHeight = 1.0f;        // m
constexpr float kEdgeLineWidth = 0.0762f;  // m, white, inside the road's border

constexpr int32_t kMaxGroundLevels = 12;
constexpr int32_t kNumMaterialPairs = 8;        // the palette's table has as many entries as an AVX2 register
constexpr int32_t kCoverageUnit = 64;           // coverage bytes of a texel sum to this
constexpr int32_t kEdgeOffsetScale = 192;       // weight of the offset byte against a position byte of 0..255
constexpr int32_t kEdgeNormalScale = 64;        // length of the normal bytes
constexpr float kEdgeDistanceScale = 16384.0f;  // distance of one texel in the units of edge_distance()

// Material below and above the border, for every pair index that a texel may hold.
struct MaterialPair {
    uint8_t below;  // where the signed distance is negative
    uint8_t above;
};
constexpr MaterialPair kMaterialPairs[kNumMaterialPairs] = {
    {kField, kEdgeLine}, {kEdgeLine, kRoad},     {kRoad, kCenterLine},       {kField, kField},
    {kRoad, kRoad},      {kEdgeLine, kEdgeLine}, {kCenterLine, kCenterLine}, {kField, kRoad}};
constexpr int32_t kGrainPairs = 3;  // the pair of a material's two shades is this and the material

struct GroundLevel {
    uint32_t offset;         // of the level's first texel
    int32_t tiles_per_row;   // tiles of 4 x 4 texels
    int32_t columns, rows;   // texels inside the room; a ring of one more texel lies around them
    float texels_per_metre;  // 1/m
};

// Points at memory owned by GroundMap (native/src/ground_map.hpp), so that the same struct serves a GPU.
struct GroundView {
    const uint32_t* texels;
    GroundLevel levels[kMaxGroundLevels];
    int32_t num_levels;
    int32_t exponent;                  // texel size of level 0 is 0.01 m * 2^exponent
    float texel;                       // m, texel size of level 0
    float min_x, min_y, max_x, max_y;  // m, the room's walls
};

// A straight walk over one level in 16.16 fixed-point texels, ring included: pixel i is at (u + i du, v + i
// dv).
struct GroundWalk {
    uint32_t u, v, du, dv;
};

RC_HD uint32_t texel_index(const GroundLevel& level, uint32_t u, uint32_t v) {
    const uint32_t column = u >> 16;
    const uint32_t row = v >> 16;
    const uint32_t tile = (row >> 2) * static_cast<uint32_t>(level.tiles_per_row) + (column >> 2);
    return level.offset + (tile << 4) + ((row & 3) << 2) + (column & 3);
}

// Signed distance from the texel's border to the point (u, v), in 1/16384 texel.
RC_HD int32_t edge_distance(uint32_t texel, uint32_t u, uint32_t v) {
    const int32_t along_x = static_cast<int32_t>((u >> 8) & 255);
    const int32_t along_y = static_cast<int32_t>((v >> 8) & 255);
    const int32_t normal_x = static_cast<int8_t>(texel & 255);
    const int32_t normal_y = static_cast<int8_t>((texel >> 8) & 255);
    const int32_t offset = static_cast<int8_t>((texel >> 16) & 255);
    return along_x * normal_x + along_y * normal_y + kEdgeOffsetScale * offset;
}

// How much the distance grows over the step (x, y) in 1/256 texel.
RC_HD int32_t edge_growth(uint32_t texel, int32_t x, int32_t y) {
    return x * static_cast<int8_t>(texel & 255) + y * static_cast<int8_t>((texel >> 8) & 255);
}

// Brightness times 64 of an edge texel. sharpness is 256 over the filter width in texels; sides holds, per
// pair, the brightness below in the low half and that above in the high half.
RC_HD int32_t shade_edge(uint32_t texel, int32_t distance, int32_t sharpness, const int32_t* sides) {
    const int32_t ramp = ((distance * sharpness) >> 16) + kCoverageUnit / 2;
    const int32_t coverage = clamp(ramp, 0, kCoverageUnit);
    const int32_t pair = sides[texel >> 24];
    return (kCoverageUnit - coverage) * (pair & 0xffff) + coverage * (pair >> 16);
}

// Brightness times 64 of a coverage texel; weights are the four brightnesses, one byte each.
RC_HD int32_t shade_coverage(uint32_t texel, uint32_t weights) {
    int32_t sum = 0;
    for (int32_t shift = 0; shift < 32; shift += 8) {
        sum += static_cast<int32_t>((texel >> shift) & 255) * static_cast<int32_t>((weights >> shift) & 255);
    }
    return sum;
}

}  // namespace racecraft
