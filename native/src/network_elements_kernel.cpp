// What a network does to each number by itself: activations, the optimiser's step, the layout of frames and
// weights.
#include <algorithm>
#include <cmath>
#include <cstring>

#include "network_kernel.hpp"
#include "network_lanes.hpp"
#include "network_math.hpp"
#include "racecraft/math.hpp"

namespace racecraft::RC_ISA {
namespace {

constexpr int kLaneCount = FloatLanes::kCount;
constexpr float kNothing = 1e-30f;  // smaller moments move no weight

// One vector of channels over all positions; `slope` gives the gradient before the activation.
template <typename Slope>
[[gnu::always_inline]] inline void activation_lanes(const float* out, size_t positions, size_t channels,
                                                    float* grad, float* bias_gradient, const Slope& slope) {
    FloatLanes sum = load(bias_gradient);
    for (size_t i = 0; i < positions * channels; i += channels) {
        const FloatLanes g = slope(load(out + i), load(grad + i));
        store(grad + i, g);
        sum = sum + g;
    }
    store(bias_gradient, sum);
}

template <int kBlock>
void fold_row(const uint8_t* pixels, size_t columns, size_t channels, uint8_t* out) {
    for (size_t c = 0; c < columns; ++c) std::memcpy(out + c * channels, pixels + c * kBlock, kBlock);
}

}  // namespace

void apply_tanh(float* values, size_t count) {
    for (size_t i = 0; i < count; ++i) values[i] = tanh_of(values[i]);
}

void activation_gradient(Activation activation, const float* out, size_t positions, int channels, float* grad,
                         float* bias_gradient) {
    const size_t stride = static_cast<size_t>(channels);
    for (size_t c = 0; c < stride; c += kLaneCount) {
        const auto run = [&](const auto& slope) {
            activation_lanes(out + c, positions, stride, grad + c, bias_gradient + c, slope);
        };
        switch (activation) {
            case Activation::relu:
                run([](FloatLanes y, FloatLanes g) { return where_positive(y, g); });
                break;
            case Activation::tanh:
                run([](FloatLanes y, FloatLanes g) { return g * (splat(1.0f) - y * y); });
                break;
            case Activation::identity:
                run([](FloatLanes, FloatLanes g) { return g; });
                break;
        }
    }
}

void transpose_weights(const LayerShape& shape, int run, size_t first_lane, const float* weights,
                       float* transposed) {
    const size_t channels = static_cast<size_t>(shape.out_channels);
    const size_t length = static_cast<size_t>(shape.run_length);
    const size_t first = static_cast<size_t>(run) * length + first_lane;
    const size_t width = std::min<size_t>(kPanel, length - first_lane);
    float* to = transposed + first * channels;
    for (size_t panel = 0; panel < channels; panel += kPanel) {
        const size_t panel_channels = std::min<size_t>(kPanel, channels - panel);
        const float* from = weights + panel * shape.num_inputs() + first * panel_channels;
        for (size_t c = 0; c < panel_channels; ++c) {
            for (size_t lane = 0; lane < width; ++lane) {
                to[(panel + c) * width + lane] = from[lane * panel_channels + c];
            }
        }
    }
}

void bytes_to_unit(const uint8_t* bytes, size_t count, float* out) {
    for (size_t i = 0; i < count; ++i) out[i] = static_cast<float>(bytes[i]) * (1.0f / 255.0f);
}

void fold_frame(const NetworkSpec& spec, const uint8_t* frame, int lens, uint8_t* out) {
    const size_t width = static_cast<size_t>(spec.width), columns = static_cast<size_t>(spec.columns());
    const size_t block = static_cast<size_t>(spec.block), channels = static_cast<size_t>(spec.channels());
    const size_t line_width = width / static_cast<size_t>(spec.pool);
    frame += static_cast<size_t>(spec.top) * width;
    out += static_cast<size_t>(lens) * block * block;
    uint8_t line[4096];
    for (size_t row = 0; row < static_cast<size_t>(spec.rows()); ++row) {
        for (size_t y = 0; y < block; ++y) {
            const uint8_t* pixels = frame + (row * block + y) * static_cast<size_t>(spec.pool) * width;
            if (spec.pool == 2) {
                const uint8_t* below = pixels + width;
                for (size_t x = 0; x < line_width; ++x) {
                    line[x] = static_cast<uint8_t>(
                        (pixels[2 * x] + pixels[2 * x + 1] + below[2 * x] + below[2 * x + 1] + 2) >> 2);
                }
                pixels = line;
            }
            uint8_t* to = out + row * columns * channels + y * block;
            if (block == 4) {
                fold_row<4>(pixels, columns, channels, to);
            } else {
                for (size_t c = 0; c < columns; ++c)
                    std::memcpy(to + c * channels, pixels + c * block, block);
            }
        }
    }
}

void sum_gradients(const float* parts, size_t num_parts, size_t stride, size_t count, float* out) {
    std::copy_n(parts, count, out);
    for (size_t part = 1; part < num_parts; ++part) {
        const float* from = parts + part * stride;
        for (size_t i = 0; i < count; ++i) out[i] += from[i];
    }
}

double sum_of_squares(const float* values, size_t count) {
    double sums[kNormLanes] = {};
    for (size_t i = 0; i < count; i += kNormLanes) {
        for (size_t lane = 0; lane < kNormLanes; ++lane) {
            const double value = static_cast<double>(values[i + lane]);
            sums[lane] += value * value;
        }
    }
    double total = 0.0;
    for (const double sum : sums) total += sum;
    return total;
}

void adam(const AdamStep& step, const float* gradient, size_t count, float* moment1, float* moment2,
          float* weights) {
    for (size_t i = 0; i < count; ++i) {
        const float g = gradient[i] * step.gradient_scale;
        float m = moment1[i] + (g - moment1[i]) * step.decay1;
        float v = moment2[i] * step.beta2 + g * g * step.decay2;
        // the moments of a unit that died would fade into subnormal numbers, which are slow
        m = abs_of(m) < kNothing ? 0.0f : m;
        v = v < kNothing ? 0.0f : v;
        moment1[i] = m;
        moment2[i] = v;
        weights[i] -= step.step_size * m / (std::sqrt(v * step.correction2) + step.epsilon);
    }
}

}  // namespace racecraft::RC_ISA
