#include "network.hpp"

#include <algorithm>
#include <stdexcept>
#include <utility>

namespace racecraft {
namespace {

constexpr size_t kAlignment = 64;

int padded(int channels) {
    return (channels + kChannelMultiple - 1) / kChannelMultiple * kChannelMultiple;
}

void require(bool is_met, const std::string& message) {
    if (!is_met) throw std::invalid_argument(message);
}

LayerShape shape_of(int in_width, int channels, int kernel_height, int kernel_width, int stride,
                    int out_height, int out_width, int outputs, size_t in_size) {
    const size_t row = static_cast<size_t>(in_width) * channels;
    LayerShape shape{};
    shape.out_height = out_height;
    shape.out_width = out_width;
    shape.out_channels = padded(outputs);
    shape.in_size = in_size;
    shape.row_step = row * stride;
    shape.column_step = static_cast<size_t>(channels) * stride;
    const bool is_one_run = kernel_width == in_width;
    shape.num_runs = is_one_run ? 1 : kernel_height;
    shape.run_stride = row;
    shape.run_length = kernel_width * channels * (is_one_run ? kernel_height : 1);
    return shape;
}

// Calls visit(offset among the layer's packed weights, offset among its published ones) for each weight.
template <typename Visit>
void for_each_weight(const Layer& layer, const Visit& visit) {
    const size_t inputs = layer.shape.num_inputs();
    const size_t fold = static_cast<size_t>(layer.fold);
    const size_t channels = static_cast<size_t>(layer.in_channels);
    const size_t kernel = static_cast<size_t>(layer.kernel_width) * fold;  // as published
    const size_t per_output = static_cast<size_t>(layer.kernel_height) * layer.kernel_width * channels;
    for (size_t out = 0; out < static_cast<size_t>(layer.num_outputs); ++out) {
        const size_t panel = out / kPanel * kPanel;
        const size_t width = std::min<size_t>(kPanel, static_cast<size_t>(layer.shape.out_channels) - panel);
        const size_t first = panel * inputs + (out - panel);
        for (size_t y = 0; y < static_cast<size_t>(layer.kernel_height); ++y) {
            for (size_t x = 0; x < static_cast<size_t>(layer.kernel_width); ++x) {
                const size_t tap = y * layer.kernel_width + x;
                for (size_t c = 0; c < channels; ++c) {
                    size_t published = out * per_output;
                    if (layer.is_dense) {
                        published += tap * channels + c;
                    } else if (fold > 1) {
                        published += (y * fold + c / fold) * kernel + x * fold + c % fold;
                    } else {
                        published += (c * layer.kernel_height + y) * kernel + x;
                    }
                    visit(first + (tap * layer.padded_in_channels + c) * width, published);
                }
            }
        }
    }
}

// Calls visit(offset among the packed parameters, offset among the published ones) for each parameter.
template <typename Visit>
void for_each_parameter(const Network& network, const Visit& visit) {
    size_t published = 0;
    for (const Tower* tower : {&network.policy, &network.critic}) {
        for (const Layer& layer : tower->layers) {
            for_each_weight(layer,
                            [&](size_t from, size_t to) { visit(layer.weights + from, published + to); });
            published += static_cast<size_t>(layer.num_outputs) * layer.kernel_height * layer.kernel_width *
                         layer.in_channels;
            for (size_t i = 0; i < static_cast<size_t>(layer.num_outputs); ++i)
                visit(layer.bias + i, published++);
        }
        if (tower == &network.policy && !network.spec.is_discrete) {
            for (size_t i = 0; i < static_cast<size_t>(network.spec.num_actions); ++i) {
                visit(network.log_std + i, published++);
            }
        }
    }
}

}  // namespace

Network::Network(const NetworkSpec& description) : spec(description) {
    require(spec.height > 0 && spec.width > 0 && spec.width <= 4096 && spec.pool > 0 && spec.block > 0,
            "The network's image needs 1 to 4096 columns and at least one row, its pool and block at least 1 "
            "pixel.");
    require(spec.pool <= 2, "The network's pool is " + std::to_string(spec.pool) + ", expected 1 or 2.");
    require(spec.top >= 0 && spec.top < spec.height, "The network sees no row of its image.");
    require((spec.height - spec.top) % (spec.pool * spec.block) == 0 &&
                spec.width % (spec.pool * spec.block) == 0,
            "The network's image does not divide into squares of " + std::to_string(spec.pool * spec.block) +
                " pixels.");
    require(spec.num_actions > 0 && spec.state_size >= 0,
            "The network needs at least one action, and a state of 0 or more columns.");
    for (const int units : spec.dense) require(units > 0, "A dense layer needs at least one unit.");
    for (const int units : spec.critic_units) require(units > 0, "A dense layer needs at least one unit.");
    add_camera_tower(policy, spec.num_actions);
    if (spec.state_size > 0) {
        add_state_tower(critic);
    } else {
        add_camera_tower(critic, 1);
    }
    place();
}

void Network::add_camera_tower(Tower& tower, int num_outputs) {
    tower.sees_camera = true;
    int height = spec.rows(), width = spec.columns(), channels = spec.channels();
    int padded_channels = channels;  // the observation itself has no padding
    int fold = spec.block;
    for (const ConvSpec& conv : spec.convs) {
        require(conv.filters > 0 && conv.kernel > 0 && conv.stride > 0,
                "A convolution needs at least one filter, and kernel and stride of at least one pixel.");
        require(fold == 1 || (conv.stride == fold && conv.kernel % fold == 0),
                "A first convolution over blocks of pixels needs their side as stride, and a multiple as "
                "kernel.");
        const int kernel = conv.kernel / fold, stride = conv.stride / fold;
        require(kernel <= height && kernel <= width,
                "The image is too small for the network's convolutions.");
        const int out_height = (height - kernel) / stride + 1, out_width = (width - kernel) / stride + 1;
        const size_t in_size = static_cast<size_t>(height) * width * padded_channels;
        Layer layer{};
        layer.shape = shape_of(width, padded_channels, kernel, kernel, stride, out_height, out_width,
                               conv.filters, in_size);
        layer.activation = Activation::relu;
        layer.num_outputs = conv.filters;
        layer.kernel_height = layer.kernel_width = kernel;
        layer.in_channels = channels;
        layer.padded_in_channels = padded_channels;
        layer.fold = fold;
        tower.layers.push_back(layer);
        height = out_height;
        width = out_width;
        channels = conv.filters;
        padded_channels = padded(channels);
        fold = 1;
    }
    require(!spec.convs.empty(), "The network needs at least one convolution.");
    add_dense_layers(tower, spec.dense, Activation::relu, num_outputs, height, width, channels);
}

void Network::add_state_tower(Tower& tower) {
    tower.sees_camera = false;
    add_dense_layers(tower, spec.critic_units, Activation::tanh, 1, 1, 1, spec.state_size);
}

void Network::add_dense_layers(Tower& tower, const std::vector<int>& units, Activation activation,
                               int num_outputs, int height, int width, int channels) {
    for (size_t i = 0; i <= units.size(); ++i) {
        const bool is_head = i == units.size();
        const int outputs = is_head ? num_outputs : units[i];
        const int padded_channels = tower.layers.empty() ? channels : padded(channels);
        const size_t in_size = static_cast<size_t>(height) * width * padded_channels;
        Layer layer{};
        layer.shape = shape_of(width, padded_channels, height, width, 1, 1, 1, outputs, in_size);
        layer.activation = is_head ? Activation::identity : activation;
        layer.is_dense = true;
        layer.num_outputs = outputs;
        layer.kernel_height = height;
        layer.kernel_width = width;
        layer.in_channels = channels;
        layer.padded_in_channels = padded_channels;
        layer.fold = 1;
        tower.layers.push_back(layer);
        height = width = 1;
        channels = outputs;
    }
}

void Network::place() {
    for (Tower* tower : {&policy, &critic}) {
        for (Layer& layer : tower->layers) {
            if (!layer.is_dense) {
                layer.weights = num_grouped;
                num_grouped += layer.shape.num_weights();
            }
            layer.bias = num_grouped;
            num_grouped += static_cast<size_t>(layer.shape.out_channels);
            if (&layer != &tower->layers.front()) {
                layer.transposed = num_transposed;
                num_transposed += layer.shape.num_weights();
            }
            num_public +=
                static_cast<size_t>(layer.num_outputs) *
                (1 + static_cast<size_t>(layer.kernel_height) * layer.kernel_width * layer.in_channels);
        }
    }
    if (!spec.is_discrete) {
        log_std = num_grouped;
        num_grouped += static_cast<size_t>(padded(spec.num_actions));
        num_public += static_cast<size_t>(spec.num_actions);
    }
    num_packed = num_grouped;
    for (Tower* tower : {&policy, &critic}) {
        for (Layer& layer : tower->layers) {
            if (!layer.is_dense) continue;
            layer.weights = num_packed;
            num_packed += layer.shape.num_weights();
        }
    }
}

void Network::pack(const float* published, float* packed) const {
    for_each_parameter(*this, [&](size_t inside, size_t outside) { packed[inside] = published[outside]; });
}

void Network::publish(const float* packed, float* published) const {
    for_each_parameter(*this, [&](size_t inside, size_t outside) { published[outside] = packed[inside]; });
}

FloatBuffer::FloatBuffer(size_t size) : size_(size) {
    if (size == 0) return;
    data_ = static_cast<float*>(::operator new(size * sizeof(float), std::align_val_t{kAlignment}));
    std::fill_n(data_, size, 0.0f);
}

FloatBuffer::~FloatBuffer() {
    ::operator delete(data_, std::align_val_t{kAlignment});
}

FloatBuffer::FloatBuffer(FloatBuffer&& other) noexcept
    : data_(std::exchange(other.data_, nullptr)), size_(std::exchange(other.size_, 0)) {}

FloatBuffer& FloatBuffer::operator=(FloatBuffer&& other) noexcept {
    std::swap(data_, other.data_);
    std::swap(size_, other.size_);
    return *this;
}

}  // namespace racecraft
