// The networks that drive and judge, as plain tables: layers, where their parameters lie, and how those are
// packed.
//
// A network is two towers over one vector of parameters: the policy sees the sensors, the critic the
// privileged state or the sensors. A teacher's policy sees the state, too, and no sensors. Every layer is a
// convolution; a dense layer is one whose kernel covers its whole input. Where there is a LIDAR, a tower has
// a branch for it, and a layer without parameters that lays the ends of both branches side by side:
//
//     image ─▶ convolutions [─▶ dense layers] ─┐
//                                              join ─▶ dense layers ─▶ head
//     LIDAR ─▶ dense layers ───────────────────┘
//
//     packed parameters:  | convolutions' weights, all biases, log_std | dense layers' weights |
//                           summed up by groups of samples               summed up over all samples at once
//
// Activations are channels-last and channels are padded with zeros to a multiple of 16. A layer's weights are
// cut into panels of 32 output channels (the last may have 16); within a panel they are (inputs, channels of
// the panel), so that one input meets 32 channels in two vectors, and a tile of positions walks through
// memory from front to back.
#pragma once

#include <cstddef>
#include <cstdint>
#include <new>
#include <string>
#include <vector>

namespace racecraft {

constexpr int kPanel = 32;            // output channels of a panel
constexpr int kChannelMultiple = 16;  // channels are padded to this

enum class Activation { identity, relu, tanh };

struct ConvSpec {
    int filters;
    int kernel;  // side of the square kernel, pixels
    int stride;  // pixels
};

// As racecraft.learn.networks describes it.
struct NetworkSpec {
    int height, width;  // of a camera image, pixels
    int pool;           // side of the squares of pixels averaged before the first convolution
    int block;          // side of the squares of pixels folded into channels
    std::vector<ConvSpec> convs;
    std::vector<int> dense;
    int num_actions;
    bool is_discrete;
    int state_size;                   // 0: the critic sees the camera
    std::vector<int> critic_units;    // of the critic that sees the state
    int top = 0;                      // rows of the image, from its top, that the network does not see
    int lenses = 1;                   // images of one camera, 2 for a stereo pair
    int lidar_size = 0;               // values of the LIDAR sensor, a byte each; 0 without one
    std::vector<int> lidar_units{};   // of the LIDAR's branch
    std::vector<int> policy_units{};  // of a policy that sees the state; then there is no image and no LIDAR

    bool is_blind() const { return !policy_units.empty(); }  // sees the state only
    int rows() const { return (height - top) / (pool * block); }
    int columns() const { return width / (pool * block); }
    int channels() const { return lenses * block * block; }
    size_t lens_size() const { return static_cast<size_t>(height) * width; }
    size_t sight_size() const { return lens_size() * lenses + lidar_size; }  // of what encode() takes
    size_t image_size() const { return static_cast<size_t>(rows()) * columns() * channels(); }
    size_t observation_size() const { return image_size() + lidar_size; }
    size_t policy_size() const { return static_cast<size_t>(is_discrete ? num_actions : 2 * num_actions); }
};

// What a kernel needs to know of a layer. Sizes and steps in floats. Each position of the output sees
// `num_runs` runs of `run_length` neighbouring inputs, `run_stride` apart.
struct LayerShape {
    int out_height, out_width;
    int out_channels;  // padded
    size_t in_size;    // of one sample
    size_t row_step;   // between the inputs of two rows of positions
    size_t column_step;
    int num_runs;
    size_t run_stride;
    int run_length;

    size_t num_positions() const { return static_cast<size_t>(out_height) * out_width; }
    size_t out_size() const { return num_positions() * out_channels; }
    size_t num_inputs() const { return static_cast<size_t>(num_runs) * run_length; }
    size_t num_weights() const { return num_inputs() * out_channels; }
};

// Where a layer's inputs come from.
enum class Source { image, lidar, state, layer, join };

struct Layer {
    LayerShape shape;
    Source source;
    Activation activation;
    size_t weights;     // offset among the packed parameters
    size_t bias;        // likewise
    size_t transposed;  // offset among the transposed weights; unused in a tower's first layer
    bool is_dense;      // published as a matrix, and its weights lie behind the grouped ones
    // the layer as it is published
    int num_outputs;
    int kernel_height, kernel_width, in_channels, padded_in_channels;
    int fold;           // side of the blocks of pixels that the input's channels are; 1 where they are not
    int joined_inputs;  // more inputs behind those, of the LIDAR's branch

    bool is_join() const { return source == Source::join; }
    bool is_first() const { return source != Source::layer && source != Source::join; }
    size_t inputs_published() const {
        return static_cast<size_t>(kernel_height) * kernel_width * in_channels + joined_inputs;
    }
};

struct Tower {
    bool sees_camera;
    std::vector<Layer> layers;
    size_t camera_end =
        0;            // layers of the camera's branch, which come first; 0 where there is no other branch
    size_t wide = 0;  // the first dense layer whose weights fit no cache; 0 where there is none
};

class Network {
  public:
    // Throws std::invalid_argument for a network that cannot be built.
    explicit Network(const NetworkSpec& spec);

    NetworkSpec spec;
    Tower policy, critic;
    size_t log_std = 0;      // offset among the packed parameters, (padded num_actions,)
    size_t num_grouped = 0;  // packed parameters whose gradients groups of samples sum up
    size_t num_packed = 0;
    size_t num_transposed = 0;
    size_t num_public = 0;

    // Between the packed parameters and the published ones: (out, channels, kernel, kernel) and (out, in),
    // then the bias, policy first, layer by layer, log_std after its head. `packed` keeps its padding.
    void pack(const float* published, float* packed) const;
    void publish(const float* packed, float* published) const;

  private:
    void add_camera_tower(Tower& tower, int num_outputs);
    void add_state_tower(Tower& tower, const std::vector<int>& all_units, int num_outputs);
    void add_dense_layer(Tower& tower, Source source, Activation activation, int outputs, int height,
                         int width, int channels, int joined_inputs);
    int add_lidar_branch(Tower& tower);
    void place();
};

// Floats on a cache line's border, zero at first.
class FloatBuffer {
  public:
    FloatBuffer() = default;
    explicit FloatBuffer(size_t size);
    ~FloatBuffer();
    FloatBuffer(FloatBuffer&& other) noexcept;
    FloatBuffer& operator=(FloatBuffer&& other) noexcept;

    float* data() { return data_; }
    const float* data() const { return data_; }
    size_t size() const { return size_; }

  private:
    float* data_ = nullptr;
    size_t size_ = 0;
};

}  // namespace racecraft
