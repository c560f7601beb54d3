#include "learner.hpp"

#include <algorithm>
#include <cmath>
#include <tuple>

namespace racecraft {
namespace {

constexpr size_t kMaxGroups = 16;         // of samples, each with a gradient of its own; decides the bits
constexpr size_t kMinGroupSize = 8;       // likewise
constexpr size_t kTaskParameters = 4096;  // parameters of a task that works on them one by one
constexpr size_t kDenseRows = 128;        // inputs of a task that sums up a dense layer's gradient
constexpr double kBeta1 = 0.9, kBeta2 = 0.999;

size_t num_blocks(size_t count) {
    return (count + kTaskParameters - 1) / kTaskParameters;
}

// What a layer reads; `before` is the output of the layer before it.
const float* input_of(const Layer& layer, const float* image, const float* lidar, const float* state,
                      const float* before) {
    switch (layer.source) {
        case Source::image:
            return image;
        case Source::lidar:
            return lidar;
        case Source::state:
            return state;
        default:
            return before;
    }
}

// Rows of `first` and of `second` side by side, and apart again.
void join_rows(const float* first, size_t first_width, const float* second, size_t second_width, size_t rows,
               float* out) {
    for (size_t row = 0; row < rows; ++row) {
        out = std::copy_n(first + row * first_width, first_width, out);
        out = std::copy_n(second + row * second_width, second_width, out);
    }
}

void split_rows(const float* in, size_t rows, float* first, size_t first_width, float* second,
                size_t second_width) {
    for (size_t row = 0; row < rows; ++row) {
        std::copy_n(in, first_width, first + row * first_width);
        std::copy_n(in + first_width, second_width, second + row * second_width);
        in += first_width + second_width;
    }
}

// Whether a layer's outputs are needed for the whole minibatch: a dense layer's weights are summed up over
// it.
bool is_kept_whole(const Tower& tower, size_t l) {
    const bool feeds_dense =
        l + 1 < tower.layers.size() && tower.layers[l + 1].is_dense && !tower.layers[l + 1].is_first();
    return feeds_dense || tower.layers[l].is_dense;
}

// base to the power of a whole number, by squaring: the same bits everywhere, unlike pow().
double power(double base, int64_t exponent) {
    double result = 1.0;
    for (; exponent > 0; exponent >>= 1) {
        if ((exponent & 1) != 0) result *= base;
        base *= base;
    }
    return result;
}

}  // namespace

Learner::Learner(const NetworkSpec& spec, int num_threads)
    : network_(spec),
      pool_(num_threads),
      weights_(network_.num_packed),
      moment1_(network_.num_packed),
      moment2_(network_.num_packed),
      workers_(static_cast<size_t>(pool_.num_threads())) {
    for (const Tower* tower : {&network_.policy, &network_.critic}) {
        for (size_t l = 0; l < tower->layers.size(); ++l) {
            const Layer& layer = tower->layers[l];
            for (int panel = 0; layer.is_dense && panel * kPanel < layer.shape.out_channels; ++panel) {
                for (size_t i = 0; i < layer.shape.num_inputs(); i += kDenseRows) {
                    dense_tasks_.push_back(
                        {tower, l, panel, i, std::min(layer.shape.num_inputs(), i + kDenseRows)});
                }
            }
            for (int run = 0; !layer.is_first() && run < layer.shape.num_runs; ++run) {
                for (size_t lane = 0; lane < static_cast<size_t>(layer.shape.run_length); lane += kPanel) {
                    transpose_tasks_.push_back({&layer, run, lane});
                }
            }
        }
    }
    for (const Tower* tower : {&network_.policy, &network_.critic}) {
        if (tower->wide == 0) continue;
        const LayerShape& shape = tower->layers[tower->wide].shape;
        for (size_t i = 0; i < static_cast<size_t>(shape.out_channels); i += kPanel)
            wide_forward_tasks_.push_back({tower, i / kPanel});
        for (size_t i = 0; i < shape.num_inputs(); i += kPanel)
            wide_backward_tasks_.push_back({tower, i / kPanel});
    }
    squares_.resize(num_blocks(network_.num_grouped) + dense_tasks_.size());
    for (Worker& worker : workers_) {
        worker.input = FloatBuffer(kChunk * spec.image_size());
        worker.lidar = FloatBuffer(kChunk * static_cast<size_t>(spec.lidar_size));
        for (const auto& [tower, buffers, at] :
             {std::tie(network_.policy, worker.policy, worker.policy_at),
              std::tie(network_.critic, worker.critic, worker.critic_at)}) {
            for (const Layer& layer : tower.layers) {
                buffers.out.emplace_back(kChunk * layer.shape.out_size());
            }
            at.out.resize(tower.layers.size());
            at.grad.resize(tower.layers.size());
        }
    }
}

ActorCriticShape Learner::shape() const {
    const NetworkSpec& spec = network_.spec;
    return {spec.sight_size(), spec.observation_size(), static_cast<size_t>(spec.state_size),
            static_cast<size_t>(spec.num_actions), spec.is_discrete};
}

void Learner::encode(const uint8_t* sight, size_t count, uint8_t* out) {
    const Lock lock(mutex_);
    const NetworkSpec& spec = network_.spec;
    pool_.for_each(count, [&](size_t i) {
        const uint8_t* from = sight + i * spec.sight_size();
        uint8_t* to = out + i * spec.observation_size();
        for (int lens = 0; lens < spec.lenses; ++lens) {
            RC_DISPATCH(fold_frame, spec, from + static_cast<size_t>(lens) * spec.lens_size(), lens, to);
        }
        std::copy_n(from + spec.lens_size() * static_cast<size_t>(spec.lenses), spec.lidar_size,
                    to + spec.image_size());
    });
}

// Bytes of one observation as numbers from 0 to 1, at the sample's place in the worker's inputs.
void Learner::read_sample(Worker& worker, const uint8_t* observation, size_t sample) const {
    const NetworkSpec& spec = network_.spec;
    const size_t image = spec.image_size(), lidar = static_cast<size_t>(spec.lidar_size);
    RC_DISPATCH(bytes_to_unit, observation, image, worker.input.data() + sample * image);
    if (lidar > 0) {
        RC_DISPATCH(bytes_to_unit, observation + image, lidar, worker.lidar.data() + sample * lidar);
    }
}

void Learner::policy(const uint8_t* observations, const float* states, size_t count, float* out) {
    const Lock lock(mutex_);
    const NetworkSpec& spec = network_.spec;
    const size_t chunk = std::clamp((count + workers_.size() - 1) / workers_.size(), size_t{1}, kChunk);
    const size_t num_actions = static_cast<size_t>(spec.num_actions);
    const size_t stride = static_cast<size_t>(network_.policy.layers.back().shape.out_channels);
    for_each_task((count + chunk - 1) / chunk, [&](Worker& worker, size_t task) {
        const size_t first = task * chunk, samples = std::min(chunk, count - first);
        for (size_t i = 0; network_.policy.sees_camera && i < samples; ++i) {
            read_sample(worker, observations + (first + i) * spec.observation_size(), i);
        }
        const Inputs in{worker.input.data(), worker.lidar.data(),
                        states + first * static_cast<size_t>(spec.is_blind() ? spec.state_size : 0)};
        point(network_.policy, worker.policy, nullptr, 0, 0, worker.policy_at);
        forward(network_.policy, in, samples, worker.policy_at, 0, network_.policy.layers.size());
        for (size_t i = 0; i < samples; ++i) {
            float* outputs = out + (first + i) * spec.policy_size();
            std::copy_n(worker.policy_at.out.back() + i * stride, num_actions, outputs);
            if (!spec.is_discrete) {
                std::copy_n(weights_.data() + network_.log_std, num_actions, outputs + num_actions);
            }
        }
    });
}

void Learner::values(const uint8_t* observations, const float* states, size_t count, float* out) {
    const Lock lock(mutex_);
    const NetworkSpec& spec = network_.spec;
    const size_t chunk = std::clamp((count + workers_.size() - 1) / workers_.size(), size_t{1}, kChunk);
    const size_t stride = static_cast<size_t>(network_.critic.layers.back().shape.out_channels);
    for_each_task((count + chunk - 1) / chunk, [&](Worker& worker, size_t task) {
        const size_t first = task * chunk, samples = std::min(chunk, count - first);
        for (size_t i = 0; network_.critic.sees_camera && i < samples; ++i) {
            read_sample(worker, observations + (first + i) * spec.observation_size(), i);
        }
        const Inputs in{worker.input.data(), worker.lidar.data(),
                        states + first * static_cast<size_t>(spec.state_size)};
        point(network_.critic, worker.critic, nullptr, 0, 0, worker.critic_at);
        forward(network_.critic, in, samples, worker.critic_at, 0, network_.critic.layers.size());
        for (size_t i = 0; i < samples; ++i) out[first + i] = worker.critic_at.out.back()[i * stride];
    });
}

UpdateStats Learner::update(const Minibatch& minibatch, const Objective& objective) {
    const Lock lock(mutex_);
    const size_t size = minibatch.size;
    const size_t num_groups = std::clamp((size + kMinGroupSize - 1) / kMinGroupSize, size_t{1}, kMaxGroups);
    prepare_training(size, num_groups);
    gather(minibatch);
    transpose();
    const size_t portion = groups_of_portion(size, num_groups);
    for (size_t first = 0; first < num_groups; first += portion) {
        const Groups groups{first, std::min(num_groups, first + portion), num_groups, size};
        forward_to_wide(minibatch, groups);
        for_each_task(groups.last - groups.first, [&](Worker& worker, size_t task) {
            run_group(worker, minibatch, objective, groups, groups.first + task);
        });
        backward_from_wide(minibatch, groups);
    }
    // as a float, so that a norm whose squares Adam could not hold counts as infinite
    const double norm = std::sqrt(static_cast<double>(static_cast<float>(sum_over_tasks(num_groups, size))));

    LossTerms sum;
    for (size_t i = 0; i < size; ++i) {
        sum.policy += terms_[i].policy;
        sum.value += terms_[i].value;
        sum.entropy += terms_[i].entropy;
        sum.kl += terms_[i].kl;
        sum.clipped += terms_[i].clipped;
    }
    const double weight = 1.0 / static_cast<double>(size);
    const UpdateStats stats{sum.policy * weight, sum.value * weight,   sum.entropy * weight,
                            sum.kl * weight,     sum.clipped * weight, norm};
    if (std::isfinite(stats.policy_loss + stats.value_loss + stats.entropy + norm)) step(objective, norm);
    return stats;
}

void Learner::read(Part part, float* published) {
    const Lock lock(mutex_);
    const FloatBuffer& from = part == Part::weights ? weights_ : part == Part::moment1 ? moment1_ : moment2_;
    network_.publish(from.data(), published);
}

void Learner::write(Part part, const float* published) {
    const Lock lock(mutex_);
    FloatBuffer& to = part == Part::weights ? weights_ : part == Part::moment1 ? moment1_ : moment2_;
    network_.pack(published, to.data());
    if (part == Part::weights) is_transposed_ = false;
}

// Groups that go through a wide layer together.
size_t Learner::groups_of_portion(size_t size, size_t num_groups) const {
    if (wide_forward_tasks_.empty()) return num_groups;
    return std::clamp(kPortion * num_groups / size, std::min(workers_.size(), num_groups), num_groups);
}

void Learner::prepare_training(size_t size, size_t num_groups) {
    if (gradient_.size() == 0) {
        gradient_ = FloatBuffer(network_.num_packed);
        transposed_ = FloatBuffer(network_.num_transposed);
        group_gradients_ = FloatBuffer(kMaxGroups * network_.num_grouped);
        for (Worker& worker : workers_) {
            for (const auto& [tower, buffers] :
                 {std::tie(network_.policy, worker.policy), std::tie(network_.critic, worker.critic)}) {
                for (const Layer& layer : tower.layers) {
                    buffers.grad.emplace_back(layer.is_dense ? 0 : kChunk * layer.shape.out_size());
                }
            }
        }
    }
    const size_t most = groups_of_portion(size, num_groups) * ((size + num_groups - 1) / num_groups);
    if (size <= kept_size_ && most <= kept_portion_) return;
    kept_size_ = std::max(kept_size_, size);
    kept_portion_ = std::max(kept_portion_, most);
    terms_.resize(kept_size_);
    for (const auto& [tower, kept] :
         {std::tie(network_.policy, kept_policy_), std::tie(network_.critic, kept_critic_)}) {
        kept = {};
        for (size_t l = 0; l < tower.layers.size(); ++l) {
            const Layer& layer = tower.layers[l];
            const size_t of_portion = l < tower.wide ? kept_portion_ : 0;
            kept.out.emplace_back((is_kept_whole(tower, l) ? kept_size_ : of_portion) *
                                  layer.shape.out_size());
            const size_t rows = layer.is_dense ? kept_size_ : l + 1 == tower.wide ? kept_portion_ : 0;
            kept.grad.emplace_back(rows * layer.shape.out_size());
        }
    }
}

// Scratch for what only the samples at hand need; `kept` for what outlives them, where there is such: of all
// samples, or of the portion that begins with sample `portion`.
void Learner::point(const Tower& tower, TowerBuffers& scratch, TowerBuffers* kept, size_t first,
                    size_t portion, TowerPointers& at) {
    for (size_t l = 0; l < tower.layers.size(); ++l) {
        const size_t size = tower.layers[l].shape.out_size();
        const auto place = [&](FloatBuffer& buffer, bool is_whole) {
            return buffer.data() + (is_whole ? first : first - portion) * size;
        };
        const bool is_kept = kept != nullptr && kept->out[l].size() > 0;
        at.out[l] = is_kept ? place(kept->out[l], is_kept_whole(tower, l)) : scratch.out[l].data();
        if (kept == nullptr) continue;
        at.grad[l] = kept->grad[l].size() > 0 ? place(kept->grad[l], tower.layers[l].is_dense)
                                              : scratch.grad[l].data();
    }
}

// Layers [from_layer, to_layer).
void Learner::forward(const Tower& tower, const Inputs& in, size_t samples, const TowerPointers& at,
                      size_t from_layer, size_t to_layer) const {
    for (size_t l = from_layer; l < to_layer; ++l) {
        const Layer& layer = tower.layers[l];
        if (layer.is_join()) {
            const size_t camera = tower.camera_end - 1;
            join_rows(at.out[camera], tower.layers[camera].shape.out_size(), at.out[l - 1],
                      tower.layers[l - 1].shape.out_size(), samples, at.out[l]);
            continue;
        }
        const float* input = input_of(layer, in.image, in.lidar, in.state, l == 0 ? nullptr : at.out[l - 1]);
        RC_DISPATCH(layer_forward, layer.shape, layer.activation, weights_.data() + layer.weights,
                    weights_.data() + layer.bias, input, samples, at.out[l]);
    }
}

// Layers [from_layer, to_layer) from behind: from the gradient at the last one's outputs to those of all
// biases and of the convolutions' weights, which are added to `gradient`; the dense layers' gradients stay
// behind in `at`, and a wide layer hands on none.
void Learner::backward(const Tower& tower, const Inputs& in, size_t samples, const TowerPointers& at,
                       float* gradient, size_t from_layer, size_t to_layer) const {
    for (size_t l = to_layer; l-- > from_layer;) {
        const Layer& layer = tower.layers[l];
        if (layer.is_join()) {
            const size_t camera = tower.camera_end - 1;
            split_rows(at.grad[l], samples, at.grad[camera], tower.layers[camera].shape.out_size(),
                       at.grad[l - 1], tower.layers[l - 1].shape.out_size());
            continue;
        }
        const float* input = input_of(layer, in.image, in.lidar, in.state, l == 0 ? nullptr : at.out[l - 1]);
        RC_DISPATCH(activation_gradient, layer.activation, at.out[l], samples * layer.shape.num_positions(),
                    layer.shape.out_channels, at.grad[l], gradient + layer.bias);
        for (int panel = 0; !layer.is_dense && panel * kPanel < layer.shape.out_channels; ++panel) {
            RC_DISPATCH(layer_weight_gradient, layer.shape, panel, 0, layer.shape.num_inputs(), input,
                        at.grad[l], samples, gradient + layer.weights);
        }
        if (!layer.is_first() && (l == 0 || l != tower.wide)) {
            RC_DISPATCH(layer_input_gradient, layer.shape, transposed_.data() + layer.transposed, at.grad[l],
                        samples, at.grad[l - 1]);
        }
    }
}

// Dense layers sum up over the whole minibatch, so what the first of them read must lie side by side.
void Learner::gather(const Minibatch& minibatch) {
    const NetworkSpec& spec = network_.spec;
    const size_t width = static_cast<size_t>(spec.state_size), lidar = static_cast<size_t>(spec.lidar_size);
    kept_states_.resize(minibatch.size * width);
    kept_lidar_.resize(minibatch.size * lidar);
    for (size_t i = 0; i < minibatch.size && width + lidar > 0; ++i) {
        const size_t row = minibatch.row(i);
        std::copy_n(minibatch.states + row * width, width, kept_states_.data() + i * width);
        RC_DISPATCH(bytes_to_unit, minibatch.observations + row * spec.observation_size() + spec.image_size(),
                    lidar, kept_lidar_.data() + i * lidar);
    }
}

void Learner::read_samples(Worker& worker, const Minibatch& minibatch, size_t first, size_t samples) const {
    const size_t image_size = network_.spec.image_size();
    for (size_t i = 0; image_size > 0 && i < samples; ++i) {
        RC_DISPATCH(bytes_to_unit,
                    minibatch.observations + minibatch.row(first + i) * network_.spec.observation_size(),
                    image_size, worker.input.data() + i * image_size);
    }
}

Learner::Inputs Learner::inputs_of(const Worker& worker, size_t first) const {
    return {worker.input.data(), kept_lidar_.data() + first * static_cast<size_t>(network_.spec.lidar_size),
            kept_states_.data() + first * static_cast<size_t>(network_.spec.state_size)};
}

// Everything but what lies before a wide layer, and such a layer itself.
void Learner::run_group(Worker& worker, const Minibatch& minibatch, const Objective& objective,
                        const Groups& groups, size_t group) {
    const NetworkSpec& spec = network_.spec;
    const size_t num_actions = static_cast<size_t>(spec.num_actions);
    const auto reads_camera = [](const Tower& tower) { return tower.sees_camera && tower.wide == 0; };
    const bool is_camera_needed = reads_camera(network_.policy) || reads_camera(network_.critic);
    const auto behind_wide = [](const Tower& tower) { return tower.wide == 0 ? 0 : tower.wide + 1; };
    const size_t policy_end = network_.policy.layers.size(), critic_end = network_.critic.layers.size();
    const size_t policy_stride = static_cast<size_t>(network_.policy.layers.back().shape.out_channels);
    const size_t critic_stride = static_cast<size_t>(network_.critic.layers.back().shape.out_channels);
    const double weight = 1.0 / static_cast<double>(minibatch.size);
    float* gradient = group_gradients_.data() + group * network_.num_grouped;
    std::fill_n(gradient, network_.num_grouped, 0.0f);

    const size_t end = groups.begin(group + 1);
    for (size_t first = groups.begin(group); first < end; first += kChunk) {
        const size_t samples = std::min(kChunk, end - first);
        if (is_camera_needed) read_samples(worker, minibatch, first, samples);
        const Inputs in = inputs_of(worker, first);
        TowerPointers &policy = worker.policy_at, &critic = worker.critic_at;
        point(network_.policy, worker.policy, &kept_policy_, first, groups.begin(groups.first), policy);
        point(network_.critic, worker.critic, &kept_critic_, first, groups.begin(groups.first), critic);
        forward(network_.policy, in, samples, policy, behind_wide(network_.policy), policy_end);
        forward(network_.critic, in, samples, critic, behind_wide(network_.critic), critic_end);

        std::fill_n(policy.grad.back(), samples * policy_stride, 0.0f);  // padding included
        std::fill_n(critic.grad.back(), samples * critic_stride, 0.0f);
        for (size_t i = 0; i < samples; ++i) {
            const size_t row = minibatch.row(first + i);
            LossTerms& terms = terms_[first + i];
            if (minibatch.slopes != nullptr) {
                const float* given = minibatch.slopes + row * num_actions;
                float* slope = policy.grad.back() + i * policy_stride;
                for (size_t k = 0; k < num_actions; ++k) slope[k] = static_cast<float>(weight) * given[k];
                terms = {};
                continue;
            }
            const PolicySample sample{minibatch.log_probs[row], minibatch.advantages[row], weight};
            const float* outputs = policy.out.back() + i * policy_stride;
            float* slope = policy.grad.back() + i * policy_stride;
            if (spec.is_discrete) {
                categorical_loss(outputs, num_actions, minibatch.action_indices[row], sample, objective,
                                 terms, slope);
            } else {
                gaussian_loss(outputs, weights_.data() + network_.log_std, num_actions,
                              minibatch.actions + row * num_actions, sample, objective, terms, slope,
                              gradient + network_.log_std);
            }
            critic.grad.back()[i * critic_stride] = critic_loss(
                critic.out.back()[i * critic_stride], minibatch.returns[row], weight, objective, terms);
        }
        backward(network_.policy, in, samples, policy, gradient, network_.policy.wide, policy_end);
        backward(network_.critic, in, samples, critic, gradient, network_.critic.wide, critic_end);
    }
}

void Learner::sum_dense(const DenseTask& task, size_t size) {
    const Layer& layer = task.tower->layers[task.layer];
    TowerBuffers& kept = task.tower == &network_.policy ? kept_policy_ : kept_critic_;
    const float* in = input_of(layer, nullptr, kept_lidar_.data(), kept_states_.data(),
                               task.layer == 0 ? nullptr : kept.out[task.layer - 1].data());
    const size_t width = std::min(kPanel, layer.shape.out_channels - task.panel * kPanel);
    float* rows = gradient_.data() + layer.weights +
                  static_cast<size_t>(task.panel) * kPanel * layer.shape.num_inputs() + task.first * width;
    std::fill_n(rows, (task.last - task.first) * width, 0.0f);
    RC_DISPATCH(layer_weight_gradient, layer.shape, task.panel, task.first, task.last, in,
                kept.grad[task.layer].data(), size, gradient_.data() + layer.weights);
    squares_[static_cast<size_t>(&task - dense_tasks_.data()) + num_blocks(network_.num_grouped)] =
        RC_DISPATCH(sum_of_squares, rows, (task.last - task.first) * width);
}

// Completes the gradient; returns the sum of its squares.
double Learner::sum_over_tasks(size_t num_groups, size_t size) {
    const size_t blocks = num_blocks(network_.num_grouped);
    for_each_task(dense_tasks_.size() + blocks, [&](Worker&, size_t task) {
        if (task < dense_tasks_.size()) return sum_dense(dense_tasks_[task], size);
        const size_t block = task - dense_tasks_.size();
        const size_t first = block * kTaskParameters,
                     count = std::min(kTaskParameters, network_.num_grouped - first);
        RC_DISPATCH(sum_gradients, group_gradients_.data() + first, num_groups, network_.num_grouped, count,
                    gradient_.data() + first);
        squares_[block] = RC_DISPATCH(sum_of_squares, gradient_.data() + first, count);
    });
    double total = 0.0;
    for (const double sum : squares_) total += sum;
    return total;
}

void Learner::step(const Objective& objective, double norm) {
    ++num_updates_;
    const double correction2 = 1.0 - power(kBeta2, num_updates_);
    const bool is_clipped = objective.max_grad_norm > 0.0 && norm > objective.max_grad_norm;
    const AdamStep adam_step{
        .gradient_scale = is_clipped ? static_cast<float>(objective.max_grad_norm / norm) : 1.0f,
        .decay1 = static_cast<float>(1.0 - kBeta1),
        .beta2 = static_cast<float>(kBeta2),
        .decay2 = static_cast<float>(1.0 - kBeta2),
        .correction2 = static_cast<float>(1.0 / correction2),
        .step_size = static_cast<float>(objective.learning_rate / (1.0 - power(kBeta1, num_updates_))),
        .epsilon = static_cast<float>(objective.is_eps_hat ? objective.adam_eps / std::sqrt(correction2)
                                                           : objective.adam_eps),
    };
    pool_.for_each(num_blocks(network_.num_packed), [&](size_t block) {
        const size_t first = block * kTaskParameters,
                     count = std::min(kTaskParameters, network_.num_packed - first);
        RC_DISPATCH(adam, adam_step, gradient_.data() + first, count, moment1_.data() + first,
                    moment2_.data() + first, weights_.data() + first);
    });
    is_transposed_ = false;
}

void Learner::transpose() {
    if (is_transposed_) return;
    pool_.for_each(transpose_tasks_.size(), [&](size_t i) {
        const auto& [layer, run, lane] = transpose_tasks_[i];
        RC_DISPATCH(transpose_weights, layer->shape, run, lane, weights_.data() + layer->weights,
                    transposed_.data() + layer->transposed);
    });
    is_transposed_ = true;
}

}  // namespace racecraft
