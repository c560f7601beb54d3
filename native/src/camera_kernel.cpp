#include "camera_kernel.hpp"

#include "ground_lanes.hpp"
#include "lanes.hpp"
#include "racecraft/camera_walk.hpp"
#include "racecraft/surroundings.hpp"

namespace racecraft::RC_ISA {
namespace {

constexpr int kMaxSamples = 8;  // of a row
constexpr int kBlock = 64;      // sample rows that are set up together

// The walks of a block of sample rows: everything that needs floating point, done for all rows at once.
struct Block {
    int32_t begin[kBlock], end[kBlock];  // pixels inside the room
    int32_t level[kBlock];
    float scale[kBlock];                                   // texels per metre of the level
    int32_t u[kBlock], v[kBlock], du[kBlock], dv[kBlock];  // GroundWalk
};

// plane_scale stretches the walks of the ground to another horizontal plane.
void set_up(const CameraView& camera, const GroundView& ground, const LensPose& lens, int first, int count,
            float plane_scale, Block& block) {
    for (int i = 0; i < count; ++i) {
        block.level[i] = sample_level(camera, ground, first + i);
        block.scale[i] = ground.levels[block.level[i]].texels_per_metre * kFixedOne;
    }
#pragma GCC ivdep
    for (int i = 0; i < count; ++i) {
        const SampleWalk walk = sample_walk(camera, ground, lens, first + i, plane_scale, block.scale[i]);
        block.begin[i] = walk.begin;
        block.end[i] = walk.end;
        block.u[i] = walk.u;
        block.v[i] = walk.v;
        block.du[i] = walk.du;
        block.dv[i] = walk.dv;
    }
}

// A row near the lens, see store_ground().
struct SharedRow {
    int samples;
    GroundWalk walk[kMaxSamples];
    int32_t sharpness[kMaxSamples];
    int32_t half_x[kMaxSamples], half_y[kMaxSamples];  // half a pixel's step in 1/256 texel
};

// Distance of a border from a position, brightness after it, for every pixel of a walk. The lanes compute
// exactly what the scalar code says with the functions of ground.hpp.
//
// add_ground() adds a sample to the sums of the pixels of a span, one row of `stride` sums per channel.
// store_ground() writes a whole row of one channel. There, close to the lens, pixels are smaller than texels:
// two neighbours share the texel under their common edge, which halves the fetches.
#if defined(RC_HAS_LANES)

template <int kChannels, bool kIsEdge>
void add_ground(const GroundView& ground, const GroundLevel& level, const GroundWalk& walk, int32_t sharpness,
                const ShadeTable* tables, PixelSpan span, int32_t* sums, int stride) {
    const uint32_t begin = static_cast<uint32_t>(span.begin);
    WalkLanes at = start_walk(walk.u + begin * walk.du, walk.v + begin * walk.dv, walk.du, walk.dv);
    const Lanes tile_row = tile_row_of(level);
    const Lanes sharp = splat(sharpness);
    for_each_vector(span.begin, span.end, [&](int i, auto mask) __attribute__((always_inline)) {
        const Lanes texel = gather(ground.texels + level.offset, offset_lanes(at.u, at.v, tile_row), mask);
        if constexpr (kIsEdge) {
            const Lanes mix = coverage_lanes(distance_lanes(texel, at.u, at.v), sharp);
            for (int c = 0; c < kChannels; ++c) {
                add_to(sums + c * stride + i, dot_halves(look_up(tables[c].ground.sides, texel), mix), mask);
            }
        } else {
            for (int c = 0; c < kChannels; ++c) {
                add_to(sums + c * stride + i,
                       dot_bytes(splat(static_cast<int32_t>(tables[c].ground.weights)), texel), mask);
            }
        }
        at.u = at.u + at.du;
        at.v = at.v + at.dv;
    });
}

void store_ground(const GroundView& ground, const SharedRow& row, const ShadeTable& table, int width,
                  uint8_t* line) {
    const GroundLevel& level = ground.levels[0];
    const uint32_t* texels = ground.texels + level.offset;
    const Lanes tile_row = tile_row_of(level);
    const Lanes rounding = splat(kCoverageUnit / 2 * row.samples);
    const int shift = row_shift(row.samples);
    WalkLanes at[kMaxSamples];
    StepLanes step[kMaxSamples];
    for (int k = 0; k < row.samples; ++k) {
        const GroundWalk& walk = row.walk[k];
        at[k] =
            start_walk(walk.u + half_step(walk.du), walk.v + half_step(walk.dv), 2 * walk.du, 2 * walk.dv);
        step[k] = step_lanes(row.half_x[k], row.half_y[k]);
    }
    for (int i = 0; i < width; i += 2 * Lanes::kCount) {
        Lanes left = rounding;
        Lanes right = rounding;
        for (int k = 0; k < row.samples; ++k) {
            const Lanes sharp = splat(row.sharpness[k]);
            const Lanes texel = gather(texels, offset_lanes(at[k].u, at[k].v, tile_row), AllLanes{});
            const Lanes distance = distance_lanes(texel, at[k].u, at[k].v);
            const Lanes growth = growth_lanes(texel, step[k]);
            const Lanes sides = look_up(table.ground.sides, texel);
            left = left + dot_halves(sides, coverage_lanes(distance - growth, sharp));
            right = right + dot_halves(sides, coverage_lanes(distance + growth, sharp));
            at[k].u = at[k].u + at[k].du;
            at[k].v = at[k].v + at[k].dv;
        }
        store_halves(line + i, shift_right(left, shift) | shift_left(shift_right(right, shift), 8));
    }
}

// Adds values[i] * factor to the sums of a span.
void add_values(int32_t* sums, const int32_t* values, int32_t factor, int begin, int end) {
    for_each_vector(begin, end, [&](int i, auto mask) __attribute__((always_inline)) {
        add_to(sums + i, load(values + i) * splat(factor), mask);
    });
}

void add_constant(int32_t* sums, int32_t value, int begin, int end) {
    for_each_vector(begin, end, [&](int i, auto mask) __attribute__((always_inline)) {
        add_to(sums + i, splat(value), mask);
    });
}

#else

template <int kChannels, bool kIsEdge>
void add_ground(const GroundView& ground, const GroundLevel& level, const GroundWalk& walk, int32_t sharpness,
                const ShadeTable* tables, PixelSpan span, int32_t* sums, int stride) {
    uint32_t u = walk.u + static_cast<uint32_t>(span.begin) * walk.du;
    uint32_t v = walk.v + static_cast<uint32_t>(span.begin) * walk.dv;
    for (int i = span.begin; i < span.end; ++i) {
        const uint32_t texel = ground.texels[texel_index(level, u, v)];
        for (int c = 0; c < kChannels; ++c) {
            sums[c * stride + i] +=
                kIsEdge ? shade_edge(texel, edge_distance(texel, u, v), sharpness, tables[c].ground.sides)
                        : shade_coverage(texel, tables[c].ground.weights);
        }
        u += walk.du;
        v += walk.dv;
    }
}

void store_ground(const GroundView& ground, const SharedRow& row, const ShadeTable& table, int width,
                  uint8_t* line) {
    const int shift = row_shift(row.samples);
    for (int i = 0; i < width; i += 2) {
        int32_t left = kCoverageUnit / 2 * row.samples;
        int32_t right = left;
        for (int k = 0; k < row.samples; ++k) {
            const GroundWalk& walk = row.walk[k];
            const uint32_t u = walk.u + half_step(walk.du) + static_cast<uint32_t>(i) * walk.du;
            const uint32_t v = walk.v + half_step(walk.dv) + static_cast<uint32_t>(i) * walk.dv;
            const uint32_t texel = ground.texels[texel_index(ground.levels[0], u, v)];
            const int32_t distance = edge_distance(texel, u, v);
            const int32_t growth = edge_growth(texel, row.half_x[k], row.half_y[k]);
            left += shade_edge(texel, distance - growth, row.sharpness[k], table.ground.sides);
            right += shade_edge(texel, distance + growth, row.sharpness[k], table.ground.sides);
        }
        line[i] = static_cast<uint8_t>(left >> shift);
        line[i + 1] = static_cast<uint8_t>(right >> shift);
    }
}

void add_values(int32_t* sums, const int32_t* values, int32_t factor, int begin, int end) {
    for (int i = begin; i < end; ++i) sums[i] += values[i] * factor;
}

void add_constant(int32_t* sums, int32_t value, int begin, int end) {
    for (int i = begin; i < end; ++i) sums[i] += value;
}

#endif

void fill(int32_t* values, int32_t value, int begin, int end) {
    for (int i = begin; i < end; ++i) values[i] = value;
}

// Draws one view, row by row. Sums of brightness times 64 gather a row's samples.
template <int kChannels>
class Painter {
  public:
    Painter(const CameraView& camera, const GroundView& ground, const GreyPalette* palettes,
            const Sheen& sheen, const LensPose& lens)
        : camera_(camera),
          ground_(ground),
          palettes_(palettes),
          sheen_(sheen),
          sheen_share_(sheen_share(camera, sheen, lens)),
          width_(camera.spec.width),
          stride_((camera.spec.width + 15) / 16 * 16),
          is_above_walls_(camera.spec.above >= camera.spec.wall_height),
          has_crowd_(palettes[0].crowd != 0),
          bearing_(has_crowd_ ? bearing_of(camera.spec, lens) : Bearing{}),
          num_walls_(walls_in_view(ground, lens, walls_)) {
        for (int c = 0; c < kChannels; ++c) {
            tables_[c] = shade_table(palettes[c]);
            print_row_[c] = -1;
        }
    }

    // begin is the row's first sample; its walks start at index i of block (and of upper, their counterparts
    // in the plane of the walls' upper edge, used only from above it).
    void draw_row(int row, int begin, int samples, const Block& block, const Block& upper, int i,
                  uint8_t* line) {
        if (sheen_share_ > 0.0f && row % kSheenRows == 0) {
            for (int c = 0; c < kChannels; ++c) {
                tables_[c].ground = row_shades(camera_, palettes_[c], sheen_, sheen_share_, row);
            }
        }
        if (kChannels == 1 && can_share(begin, samples, block, i)) {
            SharedRow shared;
            shared.samples = samples;
            for (int k = 0; k < samples; ++k) {
                shared.walk[k] = walk_of(block, i + k);
                shared.sharpness[k] = sharpness_of(begin + k);
                shared.half_x[k] = block.du[i + k] >> 9;
                shared.half_y[k] = block.dv[i + k] >> 9;
            }
            store_ground(ground_, shared, tables_[0], width_, line);
            return;
        }
        for (int k = 0; k < kChannels * stride_; ++k) sums_[k] = 0;
        bool has_walls = false;
        int bare = 0;   // samples that show nothing but walls
        int clear = 0;  // and nothing but sky
        for (int k = 0; k < samples; ++k) {
            const PixelSpan inside = {block.begin[i + k], block.end[i + k]};
            const uint8_t kind = camera_.kind[begin + k];
            if (kind == kSampleGround && inside.begin < inside.end) add_walk(begin + k, block, i + k, inside);
            if (kind != kSampleWall && inside.begin == 0 && inside.end == width_) {
                if (kind == kSampleSky) ++clear;
                continue;
            }
            if (is_above_walls_ && kind != kSampleGround) {
                ++clear;
                continue;
            }
            if (!has_walls) find_walls(row);
            has_walls = true;
            if (is_above_walls_) {
                add_from_above(inside, {upper.begin[i + k], upper.end[i + k]});
            } else if (kind == kSampleWall || inside.begin >= inside.end) {
                ++bare;
            } else {
                if (kind == kSampleSky) add_sky(row, 1, inside.begin, inside.end);
                add_walls(0, inside.begin);
                add_walls(inside.end, width_);
            }
        }
        if (clear > 0) add_sky(row, clear, 0, width_);
        for (int c = 0; bare > 0 && c < kChannels; ++c) {
            add_values(sums_ + c * stride_, wall_row_ + c * stride_, bare, 0, width_);
        }
        store_row(samples, line);
    }

  private:
    static GroundWalk walk_of(const Block& block, int i) {
        return {static_cast<uint32_t>(block.u[i]), static_cast<uint32_t>(block.v[i]),
                static_cast<uint32_t>(block.du[i]), static_cast<uint32_t>(block.dv[i])};
    }

    int32_t sharpness_of(int sample) const { return sample_sharpness(camera_, ground_, sample); }

    // Whether store_ground() may draw the row.
    bool can_share(int sample, int samples, const Block& block, int i) const {
        bool can = width_ % 32 == 0;
        for (int k = 0; k < samples; ++k) {
            can = can && can_share_texels(camera_, ground_, sample + k, block.begin[i + k], block.end[i + k],
                                          block.level[i + k]);
        }
        return can;
    }

    void add_walk(int sample, const Block& block, int i, PixelSpan inside) {
        const GroundLevel& level = ground_.levels[block.level[i]];
        if (block.level[i] == 0) {
            add_ground<kChannels, true>(ground_, level, walk_of(block, i), sharpness_of(sample), tables_,
                                        inside, sums_, stride_);
        } else {
            add_ground<kChannels, false>(ground_, level, walk_of(block, i), 0, tables_, inside, sums_,
                                         stride_);
        }
    }

    // Around the ground: walls within the opening between their upper edges, the world outside beyond it.
    void add_from_above(PixelSpan inside, PixelSpan opening) {
        if (inside.begin < inside.end) {
            opening = {min_of(opening.begin, inside.begin), max_of(opening.end, inside.end)};
        } else {
            inside = {opening.end, opening.end};
        }
        add_all(0, opening.begin, &ShadeTable::outside);
        add_walls(opening.begin, inside.begin);
        add_walls(inside.end, opening.end);
        add_all(opening.end, width_, &ShadeTable::outside);
    }

    void add_all(int begin, int end, int32_t ShadeTable::* shade) {
        for (int c = 0; c < kChannels; ++c) add_constant(sums_ + c * stride_, tables_[c].*shade, begin, end);
    }

    void add_sky(int row, int samples, int begin, int end) {
        if (has_crowd_) find_crowd(row);
        for (int c = 0; c < kChannels; ++c) {
            int32_t* sums = sums_ + c * stride_;
            if (has_crowd_) {
                add_values(sums, crowd_ + c * stride_, samples, begin, end);
            } else {
                add_constant(sums, samples * tables_[c].sky, begin, end);
            }
        }
    }

    // What stands above the walls.
    void find_crowd(int row) {
        if (row / kCrowdRows == crowd_row_) return;
        crowd_row_ = row / kCrowdRows;
        for (int c = 0; c < kChannels; ++c) {
            const GreyPalette palette = palettes_[c];
            const Bearing bearing = bearing_;
            const int32_t sky = tables_[c].sky;
            int32_t* values = crowd_ + c * stride_;
            const int width = width_;
#pragma GCC ivdep
            for (int x = 0; x < width; ++x) values[x] = above_walls(palette, bearing, row, x, sky);
        }
    }

    void add_walls(int begin, int end) {
        for (int c = 0; c < kChannels; ++c)
            add_values(sums_ + c * stride_, wall_row_ + c * stride_, 1, begin, end);
    }

    // What the row would show if there were only walls; a corner's pixel is a mixture of both walls.
    void find_walls(int row) {
        if (num_walls_ == 1 && row / kPrintRows == wall_row_of_) return;
        wall_row_of_ = row / kPrintRows;
        for (int c = 0; c < kChannels; ++c) {
            int32_t* values = wall_row_ + c * stride_;
            int x = 0;
            for (int w = 0; w < num_walls_; ++w) {
                const int32_t shade = tables_[c].wall[walls_[w].wall];
                if (w + 1 == num_walls_) {
                    fill(values, shade, x, width_);
                    break;
                }
                const WallEdge edge =
                    wall_edge(walls_, w, camera_.corner_scale[row], width_, tables_[c].wall);
                fill(values, shade, x, edge.pixel);
                values[edge.pixel] = edge.mixture;
                x = max_of(x, edge.pixel + 1);
            }
            if (has_crowd_) add_prints(row, c, values);
        }
    }

    // What hangs on the walls, which are `values` of a row.
    void add_prints(int row, int c, int32_t* values) {
        int32_t* prints = prints_ + c * stride_;
        const int width = width_;
        if (row / kPrintRows != print_row_[c]) {
            print_row_[c] = row / kPrintRows;
            const GreyPalette palette = palettes_[c];
            const Bearing bearing = bearing_;
#pragma GCC ivdep
            for (int x = 0; x < width; ++x) prints[x] = print_on_wall(palette, bearing, row, x);
        }
#pragma GCC ivdep
        for (int x = 0; x < width; ++x) values[x] = clamp(values[x] + prints[x], 0, 255 * kCoverageUnit);
    }

    void store_row(int samples, uint8_t* line) const {
        const int shift = row_shift(samples);
        const int32_t rounding = 1 << (shift - 1);
        const int width = width_;  // a local, since bytes may alias anything
        for (int c = 0; c < kChannels; ++c) {
            const int32_t* values = sums_ + c * stride_;
#pragma GCC ivdep
            for (int x = 0; x < width; ++x) {
                line[x * kChannels + c] = static_cast<uint8_t>((values[x] + rounding) >> shift);
            }
        }
    }

    const CameraView& camera_;
    const GroundView& ground_;
    const GreyPalette* palettes_;
    const Sheen& sheen_;
    float sheen_share_;
    ShadeTable tables_[kChannels];
    int width_;
    int stride_;  // of a channel in the arrays below
    bool is_above_walls_;
    bool has_crowd_;
    Bearing bearing_;
    int crowd_row_ = -1;    // what crowd_ is of, in kCrowdRows
    int wall_row_of_ = -1;  // and wall_row_, in kPrintRows
    int print_row_[kChannels];
    WallSpan walls_[kNumWalls];
    int num_walls_;
    alignas(64) int32_t sums_[kChannels * (kMaxImageWidth + 16)];
    alignas(64) int32_t wall_row_[kChannels * (kMaxImageWidth + 16)];
    alignas(64) int32_t crowd_[kChannels * (kMaxImageWidth + 16)];
    alignas(64) int32_t prints_[kChannels * (kMaxImageWidth + 16)];
};

template <int kChannels>
void render(const CameraView& camera, const GroundView& ground, const GreyPalette* palettes,
            const Sheen& sheen, const LensPose& lens, uint8_t* out) {
    Painter<kChannels> painter(camera, ground, palettes, sheen, lens);
    const bool is_above_walls = camera.spec.above >= camera.spec.wall_height;
    alignas(64) Block block;
    alignas(64) Block upper;
    for (int row = 0; row < camera.spec.height;) {
        const int first = camera.row_begin[row];
        int end = row + 1;
        while (end < camera.spec.height && camera.row_begin[end + 1] - first <= kBlock) ++end;
        const int count = camera.row_begin[end] - first;
        set_up(camera, ground, lens, first, count, 1.0f, block);
        if (is_above_walls) set_up(camera, ground, lens, first, count, camera.upper_scale, upper);
        for (; row < end; ++row) {
            const int begin = camera.row_begin[row];
            painter.draw_row(row, begin, camera.row_begin[row + 1] - begin, block, upper, begin - first,
                             out + static_cast<size_t>(row) * camera.spec.width * kChannels);
        }
    }
}

}  // namespace

void render_room(const CameraView& camera, const GroundView& ground, const GreyPalette* palettes,
                 const Sheen& sheen, int num_channels, const LensPose& lens, uint8_t* out) {
    if (num_channels == 1) {
        render<1>(camera, ground, palettes, sheen, lens, out);
    } else {
        render<3>(camera, ground, palettes, sheen, lens, out);
    }
}

}  // namespace racecraft::RC_ISA
