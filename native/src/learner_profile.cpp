#include "learner_profile.hpp"

#include <algorithm>
#include <chrono>
#include <limits>

#include "network_kernel.hpp"

namespace racecraft {
namespace {

template <typename Body>
double best_seconds(int repeats, const Body& body) {
    double best = std::numeric_limits<double>::infinity();
    for (int i = 0; i < repeats; ++i) {
        const auto start = std::chrono::steady_clock::now();
        body();
        best =
            std::min(best, std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
    }
    return best;
}

std::string text_of(const LayerShape& shape) {
    return std::to_string(shape.out_height) + "x" + std::to_string(shape.out_width) + "x" +
           std::to_string(shape.out_channels);
}

}  // namespace

std::vector<LayerTime> profile_layers(const NetworkSpec& spec, size_t samples, int repeats) {
    const Network network(spec);
    FloatBuffer weights(network.num_packed), transposed(network.num_transposed), gradient(network.num_packed);
    // numbers whose products have all the bits that a product can have
    std::fill_n(weights.data(), weights.size(), 0.07f);
    std::fill_n(transposed.data(), transposed.size(), 0.07f);
    std::vector<LayerTime> times;
    for (const Tower* tower : {&network.policy, &network.critic}) {
        for (const Layer& layer : tower->layers) {
            if (layer.is_join()) continue;
            const LayerShape& shape = layer.shape;
            FloatBuffer in(samples * shape.in_size), grad_in(samples * shape.in_size);
            FloatBuffer out(samples * shape.out_size()), grad_out(samples * shape.out_size());
            std::fill_n(in.data(), in.size(), 0.3f);
            std::fill_n(grad_out.data(), grad_out.size(), 0.3f);
            const auto measure = [&](const char* pass, const auto& body) {
                const double operations = 2.0 * static_cast<double>(shape.num_positions()) *
                                          static_cast<double>(shape.num_weights());
                times.push_back({tower == &network.policy ? "policy" : "critic", text_of(shape), pass,
                                 operations, best_seconds(repeats, body) / static_cast<double>(samples)});
            };
            measure("forward", [&] {
                RC_DISPATCH(layer_forward, shape, layer.activation, weights.data() + layer.weights,
                            weights.data() + layer.bias, in.data(), samples, out.data());
            });
            measure("weight gradient", [&] {
                for (int panel = 0; panel * kPanel < shape.out_channels; ++panel) {
                    RC_DISPATCH(layer_weight_gradient, shape, panel, 0, shape.num_inputs(), in.data(),
                                grad_out.data(), samples, gradient.data() + layer.weights);
                }
            });
            if (layer.is_first()) continue;
            measure("input gradient", [&] {
                RC_DISPATCH(layer_input_gradient, shape, transposed.data() + layer.transposed,
                            grad_out.data(), samples, grad_in.data());
            });
        }
    }
    return times;
}

double peak_operations_per_second() {
    constexpr size_t kSteps = 20000;
    alignas(64) float out[kChannelMultiple] = {};
    double operations = 0.0;
    const double seconds = best_seconds(200, [&] {
        std::fill_n(out, kChannelMultiple, 0.3f);  // whose square has all the bits of a product
        operations = RC_DISPATCH(multiply_add_only, kSteps, out);
    });
    return operations / seconds;
}

}  // namespace racecraft
