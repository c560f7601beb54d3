// A gradient step's way through a wide layer: all samples of a portion at once, a panel of its weights a
// task.
#include <algorithm>
#include <tuple>

#include "learner.hpp"

namespace racecraft {

// Calls body(worker, group, tower, at, inputs, samples) for every few samples of each group, tower by tower,
// at the layers before a wide one.
template <typename Body>
void Learner::for_each_group_before_wide(const Minibatch& minibatch, const Groups& groups, const Body& body) {
    for_each_task(groups.last - groups.first, [&](Worker& worker, size_t task) {
        const size_t group = groups.first + task, end = groups.begin(group + 1);
        for (size_t first = groups.begin(group); first < end; first += kChunk) {
            const size_t samples = std::min(kChunk, end - first);
            read_samples(worker, minibatch, first, samples);
            for (const auto& [tower, scratch, kept, at] :
                 {std::tie(network_.policy, worker.policy, kept_policy_, worker.policy_at),
                  std::tie(network_.critic, worker.critic, kept_critic_, worker.critic_at)}) {
                if (tower.wide == 0) continue;
                point(tower, scratch, &kept, first, groups.begin(groups.first), at);
                body(group, tower, inputs_of(worker, first), samples, at);
            }
        }
    });
}

void Learner::forward_to_wide(const Minibatch& minibatch, const Groups& groups) {
    if (wide_forward_tasks_.empty()) return;
    const size_t first = groups.begin(groups.first), samples = groups.begin(groups.last) - first;
    for_each_group_before_wide(
        minibatch, groups,
        [&](size_t, const Tower& tower, const Inputs& in, size_t group_samples, const TowerPointers& at) {
            forward(tower, in, group_samples, at, 0, tower.wide);
        });
    for_each_task(wide_forward_tasks_.size(), [&](Worker&, size_t task) {
        const auto& [tower, panel] = wide_forward_tasks_[task];
        const Layer& layer = tower->layers[tower->wide];
        TowerBuffers& kept = tower == &network_.policy ? kept_policy_ : kept_critic_;
        RC_DISPATCH(dense_forward, layer.shape, layer.activation, static_cast<int>(panel),
                    weights_.data() + layer.weights, weights_.data() + layer.bias,
                    kept.out[tower->wide - 1].data() + first * layer.shape.in_size, samples,
                    kept.out[tower->wide].data() + first * layer.shape.out_size());
    });
}

void Learner::backward_from_wide(const Minibatch& minibatch, const Groups& groups) {
    if (wide_backward_tasks_.empty()) return;
    const size_t first = groups.begin(groups.first), samples = groups.begin(groups.last) - first;
    for_each_task(wide_backward_tasks_.size(), [&](Worker&, size_t task) {
        const auto& [tower, panel] = wide_backward_tasks_[task];
        const Layer& layer = tower->layers[tower->wide];
        TowerBuffers& kept = tower == &network_.policy ? kept_policy_ : kept_critic_;
        RC_DISPATCH(dense_input_gradient, layer.shape, panel * kPanel, transposed_.data() + layer.transposed,
                    kept.grad[tower->wide].data() + first * layer.shape.out_size(), samples,
                    kept.grad[tower->wide - 1].data());
    });
    for_each_group_before_wide(minibatch, groups,
                               [&](size_t group, const Tower& tower, const Inputs& in, size_t group_samples,
                                   const TowerPointers& at) {
                                   float* gradient = group_gradients_.data() + group * network_.num_grouped;
                                   backward(tower, in, group_samples, at, gradient, 0, tower.wide);
                               });
}

}  // namespace racecraft
