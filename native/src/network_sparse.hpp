// Gradients of a layer through those outputs whose gradient is not 0, behind a ReLU less than half of them.
// Include only from network_kernel.cpp.
//
// A product with 0 changes no sum of finite numbers (but the sign of a 0, which moves no weight), so the bits
// are those of the dense kernels. What is not 0 is listed once and then serves all that it is multiplied by.
// Neighbours have other lists, so a tile is one row of many vectors: a multiply-add each needs a fetch of its
// own. Of vectors of four floats registers hold no better tile anyway; of wider ones they do, and there
// leaving out 60 % loses.
#pragma once

#include "network_sums.hpp"

#if defined(__wasm__) || defined(RC_HAS_DOUBLES)
#define RC_HAS_SPARSE_GRADIENTS 1

#include <algorithm>
#include <bit>
#include <cstdint>
#include <type_traits>

#include "network.hpp"

namespace racecraft::RC_ISA {
namespace {

constexpr size_t kListed = 8192;                            // numbers of a list, at most: 64 KB of the stack
constexpr size_t kListedRows = kListed / kChannelMultiple;  // that have as many channels as any
#if defined(RC_HAS_DOUBLES)
constexpr int kRowVectors = 4;  // 8 of 16 registers, as a double takes two lanes
#else
constexpr int kRowVectors = 8;
#endif

// A number that is not 0, and where what it is multiplied by begins, in bytes.
struct Listed {
    float value;
    uint32_t offset;
};

// Lists it unless it is 0; returns where the next one goes.
[[gnu::always_inline]] inline Listed* add_to_list(Listed* end, float value, size_t offset) {
    *end = {value, static_cast<uint32_t>(offset)};
    return end + ((std::bit_cast<uint32_t>(value) << 1) != 0);
}

// Calls add(value, row) for what is listed; rows begin at `from`.
template <typename Add>
[[gnu::always_inline]] inline void for_each_listed(const Listed* listed, const Listed* end, const float* from,
                                                   const Add& add) {
    const char* const bytes = reinterpret_cast<const char*>(from);
    for (; listed < end; ++listed) add(listed->value, reinterpret_cast<const float*>(bytes + listed->offset));
}

// sums[v] += value * row[v], for all that are listed in order.
template <int kVectors>
[[gnu::always_inline]] inline void add_rows(const Listed* listed, const Listed* end, const float* from,
                                            bool fits_doubled, FloatLanes (&sums)[1][kVectors]) {
    sum_up(sums, fits_doubled, [&](auto& arithmetic, auto& to) {
        const size_t count = static_cast<size_t>(end - listed);
        add_steps(arithmetic, to, count, [&](auto& sum, auto& next, size_t first, size_t last) {
            for_each_listed(listed + first, listed + last, from, [&](float value, const float* row) {
                std::remove_reference_t<decltype(next[0][0])> w[kVectors];
#pragma GCC unroll 8
                for (int v = 0; v < kVectors; ++v) w[v] = sum.lanes(load(row + v * FloatLanes::kCount));
                sum.add_products(sum.broadcast(value), w, next[0]);
            });
        });
    });
}

// Calls tile<vectors>(lane) for tiles that cover [first, last).
template <typename Tile>
[[gnu::always_inline]] inline void for_each_row_tile(size_t first, size_t last, const Tile& tile) {
    constexpr size_t kWide = kRowVectors * FloatLanes::kCount;
    constexpr size_t kHalf = kWide / 2;
    for (; first + kWide <= last; first += kWide) tile.template operator()<kRowVectors>(first);
    for (; first + kHalf <= last; first += kHalf) tile.template operator()<kRowVectors / 2>(first);
    for (; first < last; first += FloatLanes::kCount) tile.template operator()<1>(first);
}

// Whether sparse_input_gradient() takes a layer: all panels have the same width, and no two positions in a
// row share an input within one, so that what is added to an input is added in the order of the dense kernel.
inline bool has_sparse_input_gradient(const LayerShape& shape) {
    return shape.run_length % kPanel == 0 && (shape.num_positions() == 1 || shape.column_step >= kPanel) &&
           shape.out_size() <= kListed;
}

// As layer_input_gradient(), which it adds to, for one sample.
inline void sparse_input_gradient(const LayerShape& shape, const float* transposed, const float* grad_out,
                                  bool fits_doubled, float* grad_in) {
    Listed listed[kListed];
    const Listed* ends[kListedRows];  // of the positions
    const size_t channels = static_cast<size_t>(shape.out_channels);
    const size_t length = static_cast<size_t>(shape.run_length);
    Listed* end = listed;
    for (size_t position = 0; position < shape.num_positions(); ++position) {
        for (size_t c = 0; c < channels; ++c) end = add_to_list(end, *grad_out++, c * kPanel * sizeof(float));
        ends[position] = end;
    }
    for (size_t panel = 0; panel < shape.num_inputs(); panel += kPanel) {
        const size_t run = panel / length;
        float* const to = grad_in + run * shape.run_stride + (panel - run * length);
        for_each_row_tile(0, kPanel, [&]<int kVectors>(size_t lane) {
            const Listed* first = listed;
            const Listed* const* last = ends;
            for (size_t y = 0; y < static_cast<size_t>(shape.out_height); ++y) {
                float* at = to + y * shape.row_step + lane;
                for (int x = 0; x < shape.out_width; ++x, at += shape.column_step) {
                    FloatLanes sums[1][kVectors];
#pragma GCC unroll 8
                    for (int v = 0; v < kVectors; ++v) sums[0][v] = splat(0.0f);
                    add_rows(first, *last, transposed + panel * channels + lane, fits_doubled, sums);
                    first = *last++;
#pragma GCC unroll 8
                    for (int v = 0; v < kVectors; ++v) {
                        float* const sum = at + v * FloatLanes::kCount;
                        store(sum, load(sum) + sums[0][v]);
                    }
                }
            }
        });
    }
}

// Whether sparse_weight_gradient() takes a layer's inputs [first, last): vectors of them.
inline bool has_sparse_weight_gradient(const LayerShape& shape, size_t first, size_t last) {
    constexpr size_t kCount = FloatLanes::kCount;
    return first % kCount == 0 && last % kCount == 0 && static_cast<size_t>(shape.run_length) % kCount == 0;
}

// As layer_weight_gradient() for some positions, whose inputs begin so many bytes after `in`; `grad` and
// `rows` are the panel's, which is `width` channels wide.
inline void sparse_weight_gradient(const LayerShape& shape, size_t first, size_t last, const float* in,
                                   const float* grad, const uint32_t* offsets, size_t positions,
                                   bool fits_doubled, size_t width, float* rows) {
    Listed listed[kListed];
    const Listed* ends[kPanel];  // of the channels
    const size_t channels = static_cast<size_t>(shape.out_channels);
    const size_t length = static_cast<size_t>(shape.run_length);
    Listed* end = listed;
    for (size_t c = 0; c < width; ++c) {
        for (size_t p = 0; p < positions; ++p) end = add_to_list(end, grad[p * channels + c], offsets[p]);
        ends[c] = end;
    }
    for (size_t run = first / length; run * length < last; ++run) {
        const size_t from = std::max(first, run * length) - run * length;
        const size_t to = std::min(last, (run + 1) * length) - run * length;
        for_each_row_tile(from, to, [&]<int kVectors>(size_t lane) {
            constexpr size_t kLanes = static_cast<size_t>(kVectors) * FloatLanes::kCount;
            float* const gradient = rows + (run * length + lane) * width;
            float turned[kPanel][kLanes];  // the tile of the gradient, inputs side by side
            for (size_t c = 0; c < width; ++c)
                for (size_t i = 0; i < kLanes; ++i) turned[c][i] = gradient[i * width + c];
            const Listed* begin = listed;
            for (size_t c = 0; c < width; ++c) {
                FloatLanes sums[1][kVectors];
#pragma GCC unroll 8
                for (int v = 0; v < kVectors; ++v) sums[0][v] = load(turned[c] + v * FloatLanes::kCount);
                add_rows(begin, ends[c], in + run * shape.run_stride + lane, fits_doubled, sums);
                begin = ends[c];
#pragma GCC unroll 8
                for (int v = 0; v < kVectors; ++v) store(turned[c] + v * FloatLanes::kCount, sums[0][v]);
            }
            for (size_t i = 0; i < kLanes; ++i)
                for (size_t c = 0; c < width; ++c) gradient[i * width + c] = turned[c][i];
        });
    }
}

}  // namespace
}  // namespace racecraft::RC_ISA

#endif
