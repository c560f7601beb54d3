// Convolutions in both directions. A tile is a few positions (or inputs) by two vectors of channels, held in
// registers while one loop runs over everything they have in common: per step two loads of channels, one
// broadcast per position, and a fused multiply-add for each pair.
#include "network_kernel.hpp"

#include <algorithm>
#include <type_traits>

#include "network_sparse.hpp"
#include "network_sums.hpp"

namespace racecraft::RC_ISA {
namespace {

#if defined(__AVX512F__) || defined(__aarch64__)
constexpr int kTileRows = 8;  // 16 of 32 registers hold sums
#elif defined(RC_HAS_DOUBLES)
constexpr int kTileRows = 2;  // 8 of 16, as a double takes two lanes
#else
constexpr int kTileRows = 4;  // 8 of 16
#endif
constexpr int kLaneCount = FloatLanes::kCount;
constexpr size_t kSegment =
    256;  // inputs of a long run taken at once: 32 KB of weights, the size of an L1 cache

// sums[r] += rows[r][i] * weights[i], for i in [0, length).
template <int kRows, int kVectors, typename Sums>
[[gnu::always_inline]] inline void multiply(Sums& sums_of, typename Sums::Lanes (&sums)[kRows][kVectors],
                                            const float* const (&rows)[kRows], size_t offset,
                                            const float* weights, size_t width, size_t length) {
    add_steps(sums_of, sums, length, [&](auto& arithmetic, auto& to, size_t first, size_t last) {
        const float* from = weights + first * width;
        for (size_t i = offset + first; i < offset + last; ++i) {
            typename Sums::Lanes w[kVectors];
#pragma GCC unroll 2
            for (int v = 0; v < kVectors; ++v) w[v] = arithmetic.lanes(load(from + v * kLaneCount));
#pragma GCC unroll 16
            for (int r = 0; r < kRows; ++r)
                arithmetic.add_products(arithmetic.broadcast(rows[r][i]), w, to[r]);
            from += width;
        }
    });
}

// Walks over the positions of a layer's output, sample by sample, row by row.
struct Cursor {
    const LayerShape& shape;
    size_t sample = 0;  // offset of the sample's inputs
    size_t row = 0;     // offset of the row's first input
    int y = 0, x = 0;

    size_t next() {
        const size_t offset = sample + row + static_cast<size_t>(x) * shape.column_step;
        if (++x == shape.out_width) {
            x = 0;
            row += shape.row_step;
            if (++y == shape.out_height) {
                y = 0;
                row = 0;
                sample += shape.in_size;
            }
        }
        return offset;
    }
};

// Calls body.run<rows>(first position) for tiles that cover [0, positions).
template <typename Body>
[[gnu::always_inline]] inline void for_each_tile(size_t positions, Body& body) {
    size_t p = 0;
    for (; p + kTileRows <= positions; p += kTileRows) body.template run<kTileRows>(p);
    if constexpr (kTileRows > 4) {
        for (; p + 4 <= positions; p += 4) body.template run<4>(p);
    }
    for (; p < positions; ++p) body.template run<1>(p);
}

struct ForwardTerms {
    const LayerShape& shape;
    const float* weights;  // of the panel, at the lanes and the segment
    size_t width;          // of the panel
    const float* bias;     // at the lanes
    const float* in;       // at the segment
    float* out;            // at the lanes
    size_t segment;        // inputs per run
    bool is_first, is_last, is_relu;
    bool fits_doubled;
};

template <int kVectors>
struct ForwardBody {
    const ForwardTerms& t;
    Cursor cursor;

    template <int kRows>
    [[gnu::always_inline]] void run(size_t position) {
        const size_t channels = static_cast<size_t>(t.shape.out_channels);
        const float* rows[kRows];
#pragma GCC unroll 16
        for (int r = 0; r < kRows; ++r) rows[r] = t.in + cursor.next();
        float* out = t.out + position * channels;
        FloatLanes sums[kRows][kVectors];
        RC_EACH_SUM {
            sums[r][v] =
                load((t.is_first ? t.bias : out + static_cast<size_t>(r) * channels) + v * kLaneCount);
        }
        sum_up(sums, t.fits_doubled, [&](auto& arithmetic, auto& to) {
            const float* weights = t.weights;
            for (int run = 0; run < t.shape.num_runs; ++run) {
                multiply(arithmetic, to, rows, static_cast<size_t>(run) * t.shape.run_stride, weights,
                         t.width, t.segment);
                weights += t.segment * t.width;
            }
        });
        if (t.is_last && t.is_relu) RC_EACH_SUM sums[r][v] = relu(sums[r][v]);
        RC_EACH_SUM store(out + static_cast<size_t>(r) * channels + v * kLaneCount, sums[r][v]);
    }
};

template <int kVectors>
void forward_lanes(const ForwardTerms& terms, size_t positions) {
    ForwardBody<kVectors> body{terms, Cursor{terms.shape}};
    for_each_tile(positions, body);
}

struct InputGradientTerms {
    const LayerShape& shape;
    const float* transposed;  // of the panel, at the lanes
    size_t width;             // of the panel
    const float* grad_out;
    float* grad_in;  // at the run and the lanes
    bool fits_doubled;
};

template <int kVectors>
struct InputGradientBody {
    const InputGradientTerms& t;
    Cursor cursor;

    template <int kRows>
    [[gnu::always_inline]] void run(size_t position) {
        const size_t channels = static_cast<size_t>(t.shape.out_channels);
        const float* rows[kRows];
#pragma GCC unroll 16
        for (int r = 0; r < kRows; ++r) rows[r] = t.grad_out + (position + static_cast<size_t>(r)) * channels;
        FloatLanes sums[kRows][kVectors];
        RC_EACH_SUM sums[r][v] = splat(0.0f);
        sum_up(sums, t.fits_doubled, [&](auto& arithmetic, auto& to) {
            multiply(arithmetic, to, rows, 0, t.transposed, t.width, channels);
        });
        // neighbouring positions share inputs, so they are added one after the other
#pragma GCC unroll 16
        for (int r = 0; r < kRows; ++r) {
            float* to = t.grad_in + cursor.next();
#pragma GCC unroll 2
            for (int v = 0; v < kVectors; ++v) {
                store(to + v * kLaneCount, load(to + v * kLaneCount) + sums[r][v]);
            }
        }
    }
};

template <int kVectors>
void input_gradient_lanes(const InputGradientTerms& terms, size_t positions) {
    InputGradientBody<kVectors> body{terms, Cursor{terms.shape}};
    for_each_tile(positions, body);
}

// Positions as a nest of three loops, the innermost as long as possible.
struct Positions {
    size_t samples, rows, columns;
    size_t sample_step, row_step, column_step;  // between inputs
};

template <int kRows, int kVectors>
void weight_gradient_tile(const Positions& p, size_t channels, const float* in, const float* grad_out,
                          bool fits_doubled, size_t width, float* gradient) {
    FloatLanes sums[kRows][kVectors];
    RC_EACH_SUM sums[r][v] = load(gradient + static_cast<size_t>(r) * width + v * kLaneCount);
    sum_up(sums, fits_doubled, [&]<typename Sums>(Sums& arithmetic, auto& to) {
        const float* grad = grad_out;
        for (size_t s = 0; s < p.samples; ++s) {
            for (size_t y = 0; y < p.rows; ++y) {
                const float* row = in + s * p.sample_step + y * p.row_step;
                add_steps(arithmetic, to, p.columns, [&](auto& sum, auto& next, size_t begin, size_t end) {
                    const float* x = row + begin * p.column_step;
                    const float* of = grad + begin * channels;
                    for (size_t column = begin; column < end; ++column) {
                        typename Sums::Lanes g[kVectors];
#pragma GCC unroll 2
                        for (int v = 0; v < kVectors; ++v) g[v] = sum.lanes(load(of + v * kLaneCount));
#pragma GCC unroll 16
                        for (int r = 0; r < kRows; ++r) sum.add_products(sum.broadcast(x[r]), g, next[r]);
                        x += p.column_step;
                        of += channels;
                    }
                });
                grad += p.columns * channels;
            }
        }
    });
    RC_EACH_SUM store(gradient + static_cast<size_t>(r) * width + v * kLaneCount, sums[r][v]);
}

// Inputs [first, last) of one run.
template <int kVectors>
void weight_gradient_lanes(const Positions& positions, size_t channels, const float* in, const float* grad,
                           bool fits_doubled, size_t width, size_t first, size_t last, float* gradient) {
    size_t i = first;
    const auto step = [&](auto tile, size_t rows) {
        for (; i + rows <= last; i += rows)
            tile(positions, channels, in + i, grad, fits_doubled, width, gradient + i * width);
    };
    if constexpr (kTileRows * 2 > 8 && kVectors == 1) step(weight_gradient_tile<16, 1>, 16);
    step(weight_gradient_tile<kTileRows, kVectors>, kTileRows);
    if constexpr (kTileRows > 4) step(weight_gradient_tile<4, kVectors>, 4);
    step(weight_gradient_tile<1, kVectors>, 1);
}

// Calls lanes<vectors>(lane) for the vectors that cover a panel of `width` channels; `is_narrow` takes 16 of
// them at a time, on every instruction set.
template <typename Lanes>
[[gnu::always_inline]] inline void for_each_vector_pair(size_t width, const Lanes& lanes,
                                                        bool is_narrow = false) {
    size_t lane = 0;
    const bool is_paired = kLaneCount < kChannelMultiple || !is_narrow;
    for (; is_paired && lane + 2 * kLaneCount <= width; lane += 2 * kLaneCount)
        lanes.template operator()<2>(lane);
    if constexpr (kLaneCount == kChannelMultiple) {
        for (; lane < width; lane += kLaneCount) lanes.template operator()<1>(lane);
    }
}

size_t panel_width(size_t panel, size_t channels) {
    return std::min<size_t>(kPanel, channels - panel * kPanel);
}

// Rows of numbers, each `stride` after the one before.
struct Numbers {
    const float* first;
    size_t count, stride, rows;
};

// Whether DoubledSums may add products of these to sums that begin with those; where nothing has to ask,
// false.
bool fits_doubled_sums([[maybe_unused]] const Numbers& x, [[maybe_unused]] const Numbers& w,
                       [[maybe_unused]] const Numbers& beginnings) {
#if defined(RC_HAS_DOUBLES)
    const auto look = [](const Numbers& numbers) {
        Magnitudes found;
        for (size_t row = 0; row < numbers.rows; ++row)
            found.look_at(numbers.first + row * numbers.stride, numbers.count);
        return found;
    };
    return fit_doubled_sums(look(x), look(w), look(beginnings).sum());
#else
    return false;
#endif
}

void forward_panel(const LayerShape& shape, Activation activation, size_t panel, const float* weights,
                   const float* bias, const float* in, size_t samples, float* out, bool fits_doubled) {
    const size_t length = static_cast<size_t>(shape.run_length);
    const size_t segment = shape.num_runs == 1 ? std::min(kSegment, length) : length;
    const size_t width = panel_width(panel, static_cast<size_t>(shape.out_channels));
    const float* panel_weights = weights + panel * kPanel * shape.num_inputs();
    for (size_t first = 0; first < length; first += segment) {
        const size_t last = std::min(length, first + segment);
        for_each_vector_pair(width, [&]<int kVectors>(size_t lane) {
            const size_t channel = panel * kPanel + lane;
            const ForwardTerms terms{shape,          panel_weights + first * width + lane,
                                     width,          bias + channel,
                                     in + first,     out + channel,
                                     last - first,   first == 0,
                                     last == length, activation == Activation::relu,
                                     fits_doubled};
            forward_lanes<kVectors>(terms, samples * shape.num_positions());
        });
    }
}

// Adds to the panel of inputs that begins with `first` of a run.
void input_gradient_panel(const LayerShape& shape, size_t run, size_t first, const float* transposed,
                          const float* grad_out, size_t samples, float* grad_in, bool fits_doubled) {
    const size_t length = static_cast<size_t>(shape.run_length);
    // Neighbouring positions that share inputs within a panel would be added in an order that depends on the
    // width of vectors.
    const bool is_narrow = shape.num_positions() > 1 && shape.column_step < kPanel;
    const size_t width = std::min<size_t>(kPanel, length - first);
    const float* panel = transposed + (run * length + first) * static_cast<size_t>(shape.out_channels);
    for_each_vector_pair(
        width,
        [&]<int kVectors>(size_t lane) {
            const InputGradientTerms terms{
                shape,       panel + lane, width, grad_out, grad_in + run * shape.run_stride + first + lane,
                fits_doubled};
            input_gradient_lanes<kVectors>(terms, samples * shape.num_positions());
        },
        is_narrow);
}

}  // namespace

void layer_forward(const LayerShape& shape, Activation activation, const float* weights, const float* bias,
                   const float* in, size_t samples, float* out) {
    const bool fits_doubled =
        fits_doubled_sums({in, samples * shape.in_size, 0, 1}, {weights, shape.num_weights(), 0, 1},
                          {bias, static_cast<size_t>(shape.out_channels), 0, 1});
    for (size_t panel = 0; panel * kPanel < static_cast<size_t>(shape.out_channels); ++panel)
        forward_panel(shape, activation, panel, weights, bias, in, samples, out, fits_doubled);
    if (activation == Activation::tanh) apply_tanh(out, samples * shape.out_size());
}

void dense_forward(const LayerShape& shape, Activation activation, int panel, const float* weights,
                   const float* bias, const float* in, size_t samples, float* out) {
    const size_t at = static_cast<size_t>(panel);
    const size_t first = at * kPanel, width = panel_width(at, static_cast<size_t>(shape.out_channels));
    const bool fits_doubled =
        fits_doubled_sums({in, samples * shape.in_size, 0, 1},
                          {weights + first * shape.num_inputs(), width * shape.num_inputs(), 0, 1},
                          {bias + first, width, 0, 1});
    forward_panel(shape, activation, at, weights, bias, in, samples, out, fits_doubled);
}

void layer_input_gradient(const LayerShape& shape, const float* transposed, const float* grad_out,
                          size_t samples, float* grad_in) {
    std::fill_n(grad_in, samples * shape.in_size, 0.0f);
    const bool fits_doubled = fits_doubled_sums({grad_out, samples * shape.out_size(), 0, 1},
                                                {transposed, shape.num_weights(), 0, 1}, {});
#if defined(RC_HAS_SPARSE_GRADIENTS)
    if (has_sparse_input_gradient(shape)) {
        for (size_t i = 0; i < samples; ++i)
            sparse_input_gradient(shape, transposed, grad_out + i * shape.out_size(), fits_doubled,
                                  grad_in + i * shape.in_size);
        return;
    }
#endif
    for (size_t run = 0; run < static_cast<size_t>(shape.num_runs); ++run) {
        for (size_t first = 0; first < static_cast<size_t>(shape.run_length); first += kPanel)
            input_gradient_panel(shape, run, first, transposed, grad_out, samples, grad_in, fits_doubled);
    }
}

void dense_input_gradient(const LayerShape& shape, size_t first, const float* transposed,
                          const float* grad_out, size_t samples, float* grad_in) {
    const size_t width = std::min(static_cast<size_t>(kPanel), shape.num_inputs() - first);
    for (size_t i = 0; i < samples; ++i) std::fill_n(grad_in + i * shape.in_size + first, width, 0.0f);
    const size_t channels = static_cast<size_t>(shape.out_channels);
    const bool fits_doubled = fits_doubled_sums({grad_out, samples * shape.out_size(), 0, 1},
                                                {transposed + first * channels, width * channels, 0, 1}, {});
    input_gradient_panel(shape, 0, first, transposed, grad_out, samples, grad_in, fits_doubled);
}

void layer_weight_gradient(const LayerShape& shape, int panel, size_t first, size_t last, const float* in,
                           const float* grad_out, size_t samples, float* gradient) {
    const size_t channels = static_cast<size_t>(shape.out_channels);
    const size_t length = static_cast<size_t>(shape.run_length);
    const size_t first_channel = static_cast<size_t>(panel) * kPanel;
    const size_t width = panel_width(static_cast<size_t>(panel), channels);
    Positions positions{samples,
                        static_cast<size_t>(shape.out_height),
                        static_cast<size_t>(shape.out_width),
                        shape.in_size,
                        shape.row_step,
                        shape.column_step};
    if (shape.num_positions() == 1) positions = {1, 1, samples, 0, 0, shape.in_size};
    float* panel_rows = gradient + first_channel * shape.num_inputs();
    // of a dense layer only the inputs that are asked for: other tasks have the others
    const Numbers inputs = shape.num_positions() == 1
                               ? Numbers{in + first, last - first, shape.in_size, samples}
                               : Numbers{in, samples * shape.in_size, 0, 1};
    const bool fits_doubled = fits_doubled_sums(
        inputs, {grad_out + first_channel, width, channels, samples * shape.num_positions()},
        {panel_rows + first * width, (last - first) * width, 0, 1});
#if defined(RC_HAS_SPARSE_GRADIENTS)
    if (has_sparse_weight_gradient(shape, first, last)) {
        Cursor cursor{shape};
        const size_t all = samples * shape.num_positions(), most = kListed / width;
        for (size_t begin = 0; begin < all; begin += most) {
            const size_t count = std::min(most, all - begin);
            uint32_t offsets[kListedRows];
            for (size_t p = 0; p < count; ++p)
                offsets[p] = static_cast<uint32_t>(cursor.next() * sizeof(float));
            sparse_weight_gradient(shape, first, last, in, grad_out + begin * channels + first_channel,
                                   offsets, count, fits_doubled, width, panel_rows);
        }
        return;
    }
#endif
    for (size_t run = first / length; run * length < last; ++run) {
        const size_t from = std::max(first, run * length) - run * length;
        const size_t to = std::min(last, (run + 1) * length) - run * length;
        float* rows = panel_rows + run * length * width;
        for_each_vector_pair(width, [&]<int kVectors>(size_t lane) {
            weight_gradient_lanes<kVectors>(positions, channels, in + run * shape.run_stride,
                                            grad_out + first_channel + lane, fits_doubled, width, from, to,
                                            rows + lane);
        });
    }
}

double multiply_add_only(size_t steps, float* out) {
    // chains: latency times throughput of any CPU, and they fit 16 registers
    constexpr int kRows = kTileRows == 2 ? 4 : 12;
    constexpr int kVectors = 1;
    const FloatLanes factor = load(out);
    FloatLanes sums[kRows][kVectors];
    RC_EACH_SUM sums[r][v] = splat(static_cast<float>(r));
    sum_up(sums, true, [&](auto& arithmetic, auto& to) {
        const auto wide = arithmetic.lanes(factor);
        const typename std::remove_cvref_t<decltype(arithmetic)>::Lanes factors[kVectors] = {wide};
        for (size_t step = 0; step < steps; ++step) {
#pragma GCC unroll 12
            for (int r = 0; r < kRows; ++r) arithmetic.add_products(wide, factors, to[r]);
        }
    });
    for (int r = 1; r < kRows; ++r) sums[0][0] = sums[0][0] + sums[r][0];
    store(out, sums[0][0]);
    return 2.0 * kRows * kLaneCount * static_cast<double>(steps);
}

}  // namespace racecraft::RC_ISA
