#include "camera_kernel.hpp"

#if defined(__AVX2__)
#include <immintrin.h>
#endif

#if defined(__GNUC__) && !defined(__clang__)
// GCC 12's own AVX-512 header leaves pass-through operands undefined on purpose and then warns of it.
#pragma GCC diagnostic ignored "-Wmaybe-uninitialized"
#endif

namespace racecraft::RC_ISA {
namespace {

constexpr int kBlock = 64;  // sample rows that are set up together

// The walks of a block of sample rows: everything that needs floating point, done for all rows at once.
struct Block {
    float x[kBlock], y[kBlock], step_x[kBlock], step_y[kBlock];  // m
    int32_t begin[kBlock], end[kBlock];                          // pixels inside the room
};

void set_up(const CameraView& camera, const GroundView& ground, const LensPose& lens, int first, int count,
            float plane_scale, Block& block) {
    const float right_x = lens.sine;
    const float right_y = -lens.cosine;
    for (int i = 0; i < count; ++i) {
        const float ahead = camera.distance[first + i] * plane_scale;
        const float start = camera.start[first + i] * plane_scale;
        const float step = camera.step[first + i] * plane_scale;
        block.x[i] = lens.x + ahead * lens.cosine + start * right_x;
        block.y[i] = lens.y + ahead * lens.sine + start * right_y;
        block.step_x[i] = step * right_x;
        block.step_y[i] = step * right_y;
        const PixelSpan span =
            clip_walk(ground, block.x[i], block.y[i], block.step_x[i], block.step_y[i], camera.spec.width);
        block.begin[i] = span.begin;
        block.end[i] = span.end;
    }
}

struct LevelWalk {
    const uint32_t* texels;
    int32_t tiles_per_row;
    GroundWalk walk;
};

void add_constant(int32_t* sums, int begin, int end, int32_t value) {
    for (int i = begin; i < end; ++i) sums[i] += value;
}

// Adds a ground sample to the sums of pixels [begin, end). Each instruction set computes exactly shade_edge()
// or shade_coverage() of ground.hpp; the portable code *is* these functions.
#if defined(__AVX512VNNI__)

struct Lanes {
    __m512i u, v;
};

inline __m512i fetch(const GroundLevel& level, const uint32_t* texels, __m512i u, __m512i v, __mmask16 mask) {
    const __m512i column = _mm512_srli_epi32(u, 16);
    const __m512i row = _mm512_srli_epi32(v, 16);
    const __m512i tile = _mm512_add_epi32(
        _mm512_mullo_epi32(_mm512_srli_epi32(row, 2), _mm512_set1_epi32(level.tiles_per_row)),
        _mm512_srli_epi32(column, 2));
    const __m512i three = _mm512_set1_epi32(3);
    __m512i index = _mm512_slli_epi32(tile, 4);
    index = _mm512_or_si512(index, _mm512_slli_epi32(_mm512_and_si512(row, three), 2));
    index = _mm512_or_si512(index, _mm512_and_si512(column, three));
    return _mm512_mask_i32gather_epi32(_mm512_setzero_si512(), mask, index, texels + level.offset, 4);
}

static void add_ground(const GroundView& ground, int level_index, const GroundWalk& walk, int32_t sharpness,
                       const ShadeTable* tables, int num_channels, int begin, int end, int32_t* sums,
                       int stride) {
    const GroundLevel& level = ground.levels[level_index];
    const __m512i lane = _mm512_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
    const __m512i first = _mm512_add_epi32(_mm512_set1_epi32(begin), lane);
    __m512i u = _mm512_add_epi32(_mm512_set1_epi32(static_cast<int>(walk.u)),
                                 _mm512_mullo_epi32(first, _mm512_set1_epi32(static_cast<int>(walk.du))));
    __m512i v = _mm512_add_epi32(_mm512_set1_epi32(static_cast<int>(walk.v)),
                                 _mm512_mullo_epi32(first, _mm512_set1_epi32(static_cast<int>(walk.dv))));
    const __m512i du = _mm512_set1_epi32(static_cast<int>(walk.du << 4));
    const __m512i dv = _mm512_set1_epi32(static_cast<int>(walk.dv << 4));
    for (int i = begin; i < end; i += 16) {
        const int left = end - i;
        const __mmask16 mask = static_cast<__mmask16>(left >= 16 ? 0xffff : (1 << left) - 1);
        const __m512i texel = fetch(level, ground.texels, u, v, mask);
        if (level_index == 0) {
            const __m512i byte = _mm512_set1_epi32(255);
            __m512i position = _mm512_and_si512(_mm512_srli_epi32(u, 8), byte);
            position = _mm512_or_si512(position, _mm512_and_si512(v, _mm512_set1_epi32(0xff00)));
            position = _mm512_or_si512(position, _mm512_set1_epi32(kEdgeOffsetScale << 16));
            const __m512i distance = _mm512_dpbusd_epi32(_mm512_setzero_si512(), position, texel);
            __m512i ramp = _mm512_srai_epi32(_mm512_mullo_epi32(distance, _mm512_set1_epi32(sharpness)), 16);
            ramp = _mm512_add_epi32(ramp, _mm512_set1_epi32(kCoverageUnit / 2));
            ramp = _mm512_min_epi32(_mm512_max_epi32(ramp, _mm512_setzero_si512()),
                                    _mm512_set1_epi32(kCoverageUnit));
            const __m512i mix =
                _mm512_or_si512(_mm512_slli_epi32(ramp, 16), _mm512_set1_epi32(kCoverageUnit));
            const __m512i pair = _mm512_srli_epi32(texel, 24);
            for (int c = 0; c < num_channels; ++c) {
                const __m512i blend = _mm512_broadcast_i64x4(
                    _mm256_loadu_si256(reinterpret_cast<const __m256i*>(tables[c].blend)));
                const __m512i value = _mm512_madd_epi16(_mm512_permutexvar_epi32(pair, blend), mix);
                int32_t* target = sums + c * stride + i;
                _mm512_mask_storeu_epi32(target, mask,
                                         _mm512_add_epi32(_mm512_maskz_loadu_epi32(mask, target), value));
            }
        } else {
            for (int c = 0; c < num_channels; ++c) {
                int32_t* target = sums + c * stride + i;
                const __m512i value =
                    _mm512_dpbusd_epi32(_mm512_maskz_loadu_epi32(mask, target),
                                        _mm512_set1_epi32(static_cast<int>(tables[c].weights)), texel);
                _mm512_mask_storeu_epi32(target, mask, value);
            }
        }
        u = _mm512_add_epi32(u, du);
        v = _mm512_add_epi32(v, dv);
    }
}

#else

static void add_ground(const GroundView& ground, int level_index, const GroundWalk& walk, int32_t sharpness,
                       const ShadeTable* tables, int num_channels, int begin, int end, int32_t* sums,
                       int stride) {
    const GroundLevel& level = ground.levels[level_index];
    uint32_t u = walk.u + static_cast<uint32_t>(begin) * walk.du;
    uint32_t v = walk.v + static_cast<uint32_t>(begin) * walk.dv;
    for (int i = begin; i < end; ++i) {
        const uint32_t texel = ground.texels[texel_index(level, u, v)];
        for (int c = 0; c < num_channels; ++c) {
            sums[c * stride + i] += level_index == 0 ? shade_edge(texel, u, v, sharpness, tables[c].blend)
                                                     : shade_coverage(texel, tables[c].weights);
        }
        u += walk.du;
        v += walk.dv;
    }
}

#endif

// Walls over [begin, end) less [hole_begin, hole_end), each in its own shade.
void add_walls(const CameraView& camera, int sample, const WallSpan* walls, int num_walls,
               const ShadeTable& table, PixelSpan range, PixelSpan hole, int32_t* sums) {
    for (int w = 0; w < num_walls; ++w) {
        const float middle = camera.corner_start[sample];
        const float scale = camera.corner_scale[sample];
        const int left = max_of(pixel_of_slope(middle, scale, walls[w].left, camera.spec.width), range.begin);
        const int right = min_of(pixel_of_slope(middle, scale, walls[w].right, camera.spec.width), range.end);
        add_constant(sums, left, min_of(right, hole.begin), table.wall[walls[w].wall]);
        add_constant(sums, max_of(left, hole.end), right, table.wall[walls[w].wall]);
    }
}

int32_t fixed_point(float texels) {
    return static_cast<int32_t>(floor_of(texels * 65536.0f + 0.5f));
}

}  // namespace

void render_room(const CameraView& camera, const GroundView& ground, const ShadeTable* tables,
                 int num_channels, const LensPose& lens, uint8_t* out) {
    constexpr int kMaxChannels = 3;
    alignas(64) int32_t sums[kMaxChannels * (kMaxImageWidth + 16)];
    const int width = camera.spec.width;
    const int stride = (width + 15) / 16 * 16;
    const bool is_above_walls = camera.spec.above >= kWallHeight;
    const PixelSpan all = {0, width};
    WallSpan walls[kNumWalls];
    const int num_walls = walls_in_view(ground, lens, walls);

    alignas(64) Block block;
    alignas(64) Block upper;  // in the plane of the walls' upper edge; used only from above it
    int row = 0;
    for (int first = 0; first < camera.num_samples; first += kBlock) {
        const int count = min_of(kBlock, camera.num_samples - first);
        set_up(camera, ground, lens, first, count, 1.0f, block);
        if (is_above_walls) set_up(camera, ground, lens, first, count, camera.sky_scale, upper);
        for (int i = 0; i < count; ++i) {
            const int sample = first + i;
            if (sample == camera.row_begin[row]) {
                for (int k = 0; k < num_channels * stride; ++k) sums[k] = 0;
            }
            PixelSpan inside = {block.begin[i], block.end[i]};
            if (camera.kind[sample] == kSampleWall) inside = {0, 0};
            if (camera.kind[sample] == kSampleGround && inside.begin < inside.end) {
                const int level = clamp(camera.exponent[sample] - ground.exponent, 0, ground.num_levels - 1);
                const float scale = ground.levels[level].texels_per_metre;
                const GroundWalk walk = {
                    static_cast<uint32_t>(fixed_point((block.x[i] - ground.min_x) * scale + 1.0f)),
                    static_cast<uint32_t>(fixed_point((block.y[i] - ground.min_y) * scale + 1.0f)),
                    static_cast<uint32_t>(fixed_point(block.step_x[i] * scale)),
                    static_cast<uint32_t>(fixed_point(block.step_y[i] * scale))};
                const int32_t sharpness =
                    static_cast<int32_t>(min_of(camera.sharpness[sample] * ground.texel, 32767.0f));
                add_ground(ground, level, walk, sharpness, tables, num_channels, inside.begin, inside.end,
                           sums, stride);
            }
            if (inside.begin > 0 || inside.end < width) {
                for (int c = 0; c < num_channels; ++c) {
                    int32_t* target = sums + c * stride;
                    if (!is_above_walls) {
                        add_walls(camera, sample, walls, num_walls, tables[c], all, inside, target);
                        if (camera.kind[sample] == kSampleSky) {
                            add_constant(target, inside.begin, inside.end, tables[c].sky);
                        }
                    } else if (camera.kind[sample] == kSampleGround) {
                        PixelSpan opening = {min_of(upper.begin[i], inside.begin),
                                             max_of(upper.end[i], inside.end)};
                        if (inside.begin >= inside.end) opening = {upper.begin[i], upper.end[i]};
                        add_walls(camera, sample, walls, num_walls, tables[c], opening, inside, target);
                        add_constant(target, 0, opening.begin, tables[c].outside);
                        add_constant(target, opening.end, width, tables[c].outside);
                    } else {
                        add_constant(target, 0, width, tables[c].sky);
                    }
                }
            } else if (camera.kind[sample] == kSampleSky) {
                for (int c = 0; c < num_channels; ++c)
                    add_constant(sums + c * stride, 0, width, tables[c].sky);
            }

            if (sample + 1 == camera.row_begin[row + 1]) {
                const int samples = camera.row_begin[row + 1] - camera.row_begin[row];
                const int shift = samples == 1 ? 6 : samples == 2 ? 7 : samples == 4 ? 8 : 9;
                uint8_t* line = out + static_cast<size_t>(row) * width * num_channels;
                for (int c = 0; c < num_channels; ++c) {
                    for (int x = 0; x < width; ++x) {
                        line[x * num_channels + c] =
                            static_cast<uint8_t>((sums[c * stride + x] + (1 << (shift - 1))) >> shift);
                    }
                }
                ++row;
            }
        }
    }
}

}  // namespace racecraft::RC_ISA
