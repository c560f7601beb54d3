// Pixels of a driver's frame, one at a time: what the CPU's renderer (native/src/camera_kernel.cpp) sums up
// row by row, with the same integers.
#pragma once

#include "racecraft/batch.hpp"
#include "racecraft/camera_walk.hpp"
#include "racecraft/exposure.hpp"

namespace racecraft {

constexpr int32_t kMostSamples = 256;  // sample rows that a block holds at once
constexpr int32_t kQuad = 4;           // neighbouring pixels that a thread draws

// A sample row, ready for its pixels.
struct DrawnSample {
    SampleWalk walk;
    int32_t upper_begin, upper_end;  // the opening between the walls' upper edges, used only from above them
    int32_t level;
    int32_t sharpness;
    uint32_t kind;  // SampleKind
};

// What the pixels of a row have in common.
struct DrawnRow {
    int32_t begin, samples;  // in the block's samples
    bool is_shared;          // pairs of pixels share their texels
    GroundShades ground;
    WallEdge edges[kNumWalls];
};

// What all pixels of a frame have in common.
struct DrawnFrame {
    GroundView ground;
    ShadeTable table;
    float sheen;  // share of it that the ground shows
    WallSpan walls[kNumWalls];
    int32_t num_walls;
    LensPose lens;
    bool is_above_walls;
};

RC_HD DrawnSample draw_sample(const CameraView& camera, const DrawnFrame& frame, int32_t sample) {
    const GroundView& ground = frame.ground;
    DrawnSample drawn;
    drawn.level = sample_level(camera, ground, sample);
    const float scale = ground.levels[drawn.level].texels_per_metre * kFixedOne;
    drawn.walk = sample_walk(camera, ground, frame.lens, sample, 1.0f, scale);
    drawn.upper_begin = drawn.upper_end = 0;
    if (frame.is_above_walls) {
        const SampleWalk upper = sample_walk(camera, ground, frame.lens, sample, camera.upper_scale, scale);
        drawn.upper_begin = upper.begin;
        drawn.upper_end = upper.end;
    }
    drawn.sharpness = sample_sharpness(camera, ground, sample);
    drawn.kind = camera.kind[sample];
    return drawn;
}

RC_HD DrawnRow draw_row(const CameraView& camera, const DrawnFrame& frame, const GreyPalette& palette,
                        const Sheen& sheen, const DrawnSample* samples, int32_t first, int32_t row) {
    DrawnRow drawn;
    drawn.ground =
        frame.sheen > 0.0f ? row_shades(camera, palette, sheen, frame.sheen, row) : frame.table.ground;
    const int32_t width = camera.spec.width;
    drawn.begin = camera.row_begin[row] - first;
    drawn.samples = camera.row_begin[row + 1] - camera.row_begin[row];
    drawn.is_shared = width % 32 == 0;
    for (int32_t k = 0; k < drawn.samples; ++k) {
        const DrawnSample& sample = samples[drawn.begin + k];
        drawn.is_shared =
            drawn.is_shared && can_share_texels(camera, frame.ground, camera.row_begin[row] + k,
                                                sample.walk.begin, sample.walk.end, sample.level);
    }
    for (int32_t w = 0; w + 1 < frame.num_walls; ++w) {
        drawn.edges[w] = wall_edge(frame.walls, w, camera.corner_scale[row], width, frame.table.wall);
    }
    return drawn;
}

// Brightness times 64 of a pixel that shows nothing but walls.
RC_HD int32_t wall_pixel(const DrawnFrame& frame, const DrawnRow& row, int32_t x) {
    int32_t value = 0;
    int32_t begin = 0;
    for (int32_t w = 0; w < frame.num_walls; ++w) {
        const int32_t shade = frame.table.wall[frame.walls[w].wall];
        if (w + 1 == frame.num_walls) {
            if (x >= begin) value = shade;
            break;
        }
        const WallEdge edge = row.edges[w];
        if (x >= begin && x < edge.pixel) value = shade;
        if (x == edge.pixel) value = edge.mixture;
        begin = max_of(begin, edge.pixel + 1);
    }
    return value;
}

// The same of the ground.
RC_HD int32_t ground_pixel(const DrawnFrame& frame, const DrawnRow& row, const DrawnSample& sample,
                           int32_t x) {
    const uint32_t i = static_cast<uint32_t>(x);
    const uint32_t u = static_cast<uint32_t>(sample.walk.u) + i * static_cast<uint32_t>(sample.walk.du);
    const uint32_t v = static_cast<uint32_t>(sample.walk.v) + i * static_cast<uint32_t>(sample.walk.dv);
    const uint32_t texel = frame.ground.texels[texel_index(frame.ground.levels[sample.level], u, v)];
    return sample.level == 0
               ? shade_edge(texel, edge_distance(texel, u, v), sample.sharpness, row.ground.sides)
               : shade_coverage(texel, row.ground.weights);
}

// The same of a sample, whatever it shows there.
RC_HD int32_t sample_pixel(const DrawnFrame& frame, const DrawnRow& row, const DrawnSample& sample,
                           int32_t x) {
    const int32_t begin = sample.walk.begin;
    const int32_t end = sample.walk.end;
    const bool is_inside = x >= begin && x < end;
    if (sample.kind == kSampleGround && is_inside) return ground_pixel(frame, row, sample, x);
    if (sample.kind == kSampleSky && is_inside) return frame.table.sky;
    if (!frame.is_above_walls) return wall_pixel(frame, row, x);
    if (sample.kind != kSampleGround) return frame.table.sky;
    // Around the ground: walls within the opening between their upper edges, the world outside beyond it.
    const bool has_ground = begin < end;
    const int32_t from = has_ground ? min_of(sample.upper_begin, begin) : sample.upper_begin;
    const int32_t to = has_ground ? max_of(sample.upper_end, end) : sample.upper_end;
    return x >= from && x < to ? wall_pixel(frame, row, x) : frame.table.outside;
}

// Four pixels of a row from column x on, rounded; those beyond the row's end mean nothing.
RC_HD void draw_quad(const DrawnFrame& frame, const DrawnRow& row, const DrawnSample* samples, int32_t x,
                     uint8_t* out) {
    const int32_t shift = row_shift(row.samples);
    int32_t sums[kQuad];
    for (int32_t i = 0; i < kQuad; ++i) sums[i] = kCoverageUnit / 2 * row.samples;
    for (int32_t k = 0; k < row.samples; ++k) {
        const DrawnSample& sample = samples[row.begin + k];
        if (!row.is_shared) {
            for (int32_t i = 0; i < kQuad; ++i) sums[i] += sample_pixel(frame, row, sample, x + i);
            continue;
        }
        const uint32_t du = static_cast<uint32_t>(sample.walk.du);
        const uint32_t dv = static_cast<uint32_t>(sample.walk.dv);
        for (int32_t i = 0; i < kQuad; i += 2) {
            const uint32_t left = static_cast<uint32_t>(x + i);
            const uint32_t u = static_cast<uint32_t>(sample.walk.u) + half_step(du) + left * du;
            const uint32_t v = static_cast<uint32_t>(sample.walk.v) + half_step(dv) + left * dv;
            const uint32_t texel = frame.ground.texels[texel_index(frame.ground.levels[0], u, v)];
            const int32_t distance = edge_distance(texel, u, v);
            const int32_t growth = edge_growth(texel, sample.walk.du >> 9, sample.walk.dv >> 9);
            sums[i] += shade_edge(texel, distance - growth, sample.sharpness, row.ground.sides);
            sums[i + 1] += shade_edge(texel, distance + growth, sample.sharpness, row.ground.sides);
        }
    }
    for (int32_t i = 0; i < kQuad; ++i) out[i] = static_cast<uint8_t>(sums[i] >> shift);
}

}  // namespace racecraft
