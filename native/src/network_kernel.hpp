// The arithmetic of a network's layers, compiled once per instruction set.
//
// Every sum is one chain of fused multiply-adds in a fixed order: over the inputs of a position (forward),
// over the outputs that a position has (input gradient, then positions in order), over positions in order
// (weight gradient). Neither vector width nor tile size nor the number of threads changes that order, hence
// no result. Nor does it matter that products with a gradient of 0 may be left out (network_sparse.hpp).
#pragma once

#include "dispatch.hpp"
#include "network.hpp"

namespace racecraft {

constexpr size_t kNormLanes = 16;  // partial sums of squares kept side by side

// One step of Adam with the corrections of this step already worked out.
struct AdamStep {
    float gradient_scale;  // 1, or less where the norm is clipped
    float decay1;          // 1 - beta1
    float beta2, decay2;   // decay2 = 1 - beta2
    float correction2;     // 1 / (1 - beta2^t)
    float step_size;       // learning rate / (1 - beta1^t)
    float epsilon;
};

// layer_forward: out (samples, out_size) = activation(in * weights + bias).
// layer_input_gradient: writes grad_in (samples, in_size); `transposed` as transpose_weights() makes it.
// dense_forward, dense_input_gradient: the same for one panel of a dense layer's outputs (without tanh), and
// for one panel of its inputs, which begins with `first`. layer_weight_gradient: adds to rows [first, last)
// of one panel of `gradient`; rows are the layer's inputs. activation_gradient: multiplies grad by the
// activation's slope at `out`, and adds the positions' sum to bias_gradient. transpose_weights: one panel of
// one run; panels of run_length lanes, (out_channels, lanes of the panel) within each, run by run.
// fold_frame: pools the rows of one lens's image that are seen and folds blocks of pixels into channels.
// sum_gradients: out = parts[0] + parts[1] + ..., each `stride` apart.
// sum_of_squares: in double.
// orthonormalize: makes `count` independent vectors orthonormal, each from itself and those before it (Gram
// and Schmidt). All pointers to floats but `in` of a first layer are on a border of 16 floats.
#define RC_DECLARE(isa)                                                                                  \
    namespace isa {                                                                                      \
    void layer_forward(const LayerShape& shape, Activation activation, const float* weights,             \
                       const float* bias, const float* in, size_t samples, float* out);                  \
    void layer_input_gradient(const LayerShape& shape, const float* transposed, const float* grad_out,   \
                              size_t samples, float* grad_in);                                           \
    void dense_forward(const LayerShape& shape, Activation activation, int panel, const float* weights,  \
                       const float* bias, const float* in, size_t samples, float* out);                  \
    void dense_input_gradient(const LayerShape& shape, size_t first, const float* transposed,            \
                              const float* grad_out, size_t samples, float* grad_in);                    \
    void layer_weight_gradient(const LayerShape& shape, int panel, size_t first, size_t last,            \
                               const float* in, const float* grad_out, size_t samples, float* gradient); \
    void activation_gradient(Activation activation, const float* out, size_t positions, int channels,    \
                             float* grad, float* bias_gradient);                                         \
    void apply_tanh(float* values, size_t count);                                                        \
    void transpose_weights(const LayerShape& shape, int run, size_t first_lane, const float* weights,    \
                           float* transposed);                                                           \
    void bytes_to_unit(const uint8_t* bytes, size_t count, float* out);                                  \
    void fold_frame(const NetworkSpec& spec, const uint8_t* frame, int lens, uint8_t* out);              \
    void sum_gradients(const float* parts, size_t num_parts, size_t stride, size_t count, float* out);   \
    double sum_of_squares(const float* values, size_t count);                                            \
    void adam(const AdamStep& step, const float* gradient, size_t count, float* moment1, float* moment2, \
              float* weights);                                                                           \
    void orthonormalize(double* vectors, size_t count, size_t length);                                   \
    double multiply_add_only(size_t steps, float* out);                                                  \
    }
RC_FOR_EACH_ISA(RC_DECLARE)
#undef RC_DECLARE

}  // namespace racecraft
