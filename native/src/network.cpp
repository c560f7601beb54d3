#include "network.hpp"

#include <algorithm>
#include <utility>

#include "refuse.hpp"

namespace racecraft {
namespace {

constexpr size_t kAlignment = 64;

int padded(int channels) {
    return (channels + kChannelMultiple - 1) / kChannelMultiple * kChannelMultiple;
}

void require(bool is_met, const std::string& message) {
    if (!is_met) refuse(message);
}

constexpr size_t kWideWeights = size_t{1} << 18;  // 1 MB: what an L2 cache holds

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
    const size_t per_output = layer.inputs_published();
    const size_t num_taps = static_cast<size_t>(layer.kernel_height) * layer.kernel_width;
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
                        const size_t lens = c / (fold * fold), pixel = c % (fold * fold);
                        const size_t line = (lens * layer.kernel_height + y) * fold + pixel / fold;
                        published += line * kernel + x * fold + pixel % fold;
                    } else {
                        published += (c * layer.kernel_height + y) * kernel + x;
                    }
                    visit(first + (tap * layer.padded_in_channels + c) * width, published);
                }
            }
        }
        for (size_t i = 0; i < static_cast<size_t>(layer.joined_inputs); ++i) {
            visit(first + (num_taps * layer.padded_in_channels + i) * width,
                  out * per_output + num_taps * channels + i);
        }
    }
}

// Calls visit(offset among the packed parameters, offset among the published ones) for each parameter.
template <typename Visit>
void for_each_parameter(const Network& network, const Visit& visit) {
    size_t published = 0;
    for (const Tower* tower : {&network.policy, &network.critic}) {
        for (const Layer& layer : tower->layers) {
            if (layer.is_join()) continue;
            for_each_weight(layer,
                            [&](size_t from, size_t to) { visit(layer.weights + from, published + to); });
            published += static_cast<size_t>(layer.num_outputs) * layer.inputs_published();
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
    if (spec.is_blind()) {
        require(spec.state_size > 0, "A policy that sees the state needs one of at least one column.");
        require(spec.height == 0 && spec.width == 0 && spec.top == 0 && spec.lidar_size == 0 &&
                    spec.convs.empty() && spec.dense.empty() && spec.pool > 0 && spec.block > 0,
                "A policy that sees the state has neither image nor LIDAR.");
    }
    require(spec.is_blind() ||
                (spec.height > 0 && spec.width > 0 && spec.width <= 4096 && spec.pool > 0 && spec.block > 0),
            "The network's image needs 1 to 4096 columns and at least one row, its pool and block at least 1 "
            "pixel.");
    require(spec.pool <= 2, "The network's pool is " + std::to_string(spec.pool) + ", expected 1 or 2.");
    require(spec.is_blind() || (spec.top >= 0 && spec.top < spec.height),
            "The network sees no row of its image.");
    require((spec.height - spec.top) % (spec.pool * spec.block) == 0 &&
                spec.width % (spec.pool * spec.block) == 0,
            "The network's image does not divide into squares of " + std::to_string(spec.pool * spec.block) +
                " pixels.");
    require(spec.num_actions > 0 && spec.state_size >= 0,
            "The network needs at least one action, and a state of 0 or more columns.");
    for (const int units : spec.dense) require(units > 0, "A dense layer needs at least one unit.");
    for (const int units : spec.critic_units) require(units > 0, "A dense layer needs at least one unit.");
    for (const int units : spec.policy_units) require(units > 0, "A dense layer needs at least one unit.");
    for (const int units : spec.lidar_units) require(units > 0, "A dense layer needs at least one unit.");
    require(spec.lenses == 1 || spec.lenses == 2, "A camera has one lens or two.");
    require(spec.lidar_size >= 0 && (spec.lidar_size == 0 || !spec.lidar_units.empty()),
            "A LIDAR of 0 or more values needs a branch of at least one dense layer.");
    if (spec.is_blind()) {
        add_state_tower(policy, spec.policy_units, spec.num_actions);
    } else {
        add_camera_tower(policy, spec.num_actions);
    }
    if (spec.state_size > 0) {
        add_state_tower(critic, spec.critic_units, 1);
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
        layer.source = tower.layers.empty() ? Source::image : Source::layer;
        tower.layers.push_back(layer);
        height = out_height;
        width = out_width;
        channels = conv.filters;
        padded_channels = padded(channels);
        fold = 1;
    }
    require(!spec.convs.empty(), "The network needs at least one convolution.");
    int joined = add_lidar_branch(tower);
    const auto add = [&](int units, Activation activation) {
        add_dense_layer(tower, Source::layer, activation, units, height, width, channels, joined);
        height = width = 1;
        channels = units;
        joined = 0;
    };
    for (const int units : spec.dense) add(units, Activation::relu);
    add(num_outputs, Activation::identity);
}

// Returns the inputs that the next layer has from it.
int Network::add_lidar_branch(Tower& tower) {
    if (spec.lidar_size == 0) return 0;
    tower.camera_end = tower.layers.size();
    int inputs = spec.lidar_size;
    for (const int units : spec.lidar_units) {
        const Source source = tower.layers.size() == tower.camera_end ? Source::lidar : Source::layer;
        add_dense_layer(tower, source, Activation::relu, units, 1, 1, inputs, 0);
        inputs = units;
    }
    Layer join{};
    join.source = Source::join;
    join.activation = Activation::identity;
    join.fold = 1;
    join.shape.out_height = join.shape.out_width = 1;
    join.shape.out_channels = static_cast<int>(tower.layers[tower.camera_end - 1].shape.out_size() +
                                               tower.layers.back().shape.out_size());
    tower.layers.push_back(join);
    return inputs;
}

void Network::add_state_tower(Tower& tower, const std::vector<int>& all_units, int num_outputs) {
    tower.sees_camera = false;
    Source source = Source::state;
    int inputs = spec.state_size;
    for (const int units : all_units) {
        add_dense_layer(tower, source, Activation::tanh, units, 1, 1, inputs, 0);
        source = Source::layer;
        inputs = units;
    }
    add_dense_layer(tower, source, Activation::identity, num_outputs, 1, 1, inputs, 0);
}

void Network::add_dense_layer(Tower& tower, Source source, Activation activation, int outputs, int height,
                              int width, int channels, int joined_inputs) {
    const int padded_channels = source == Source::layer ? padded(channels) : channels;
    const int joined = padded(joined_inputs);
    Layer layer{};
    layer.shape = shape_of(width, padded_channels, height, width, 1, 1, 1, outputs,
                           static_cast<size_t>(height) * width * padded_channels + joined);
    layer.shape.run_length += joined;
    layer.source = source;
    layer.activation = activation;
    layer.is_dense = true;
    layer.num_outputs = outputs;
    layer.kernel_height = height;
    layer.kernel_width = width;
    layer.in_channels = channels;
    layer.padded_in_channels = padded_channels;
    layer.fold = 1;
    layer.joined_inputs = joined_inputs;
    tower.layers.push_back(layer);
}

void Network::place() {
    for (Tower* tower : {&policy, &critic}) {
        for (Layer& layer : tower->layers) {
            if (layer.is_join()) continue;
            if (!layer.is_dense) {
                layer.weights = num_grouped;
                num_grouped += layer.shape.num_weights();
            }
            layer.bias = num_grouped;
            num_grouped += static_cast<size_t>(layer.shape.out_channels);
            if (!layer.is_first()) {
                layer.transposed = num_transposed;
                num_transposed += layer.shape.num_weights();
            }
            num_public += static_cast<size_t>(layer.num_outputs) * (1 + layer.inputs_published());
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
        const auto wide = std::find_if(tower->layers.begin(), tower->layers.end(), [](const Layer& layer) {
            return layer.is_dense && !layer.is_first() && layer.shape.num_weights() > kWideWeights;
        });
        if (wide != tower->layers.end()) tower->wide = static_cast<size_t>(wide - tower->layers.begin());
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
