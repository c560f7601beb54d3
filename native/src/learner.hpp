// A network that drives, judges and improves: forward passes, the PPO gradient and Adam, on every core.
//
// A gradient step is four loops over all threads, each of a fixed number of tasks:
//
//     weights ─transpose─▶ groups of samples: forward, loss, backward ─▶ sums over samples and groups ─▶ Adam
//
// A dense layer whose weights fit no cache (Tower::wide) takes a portion of samples at once, a panel a task,
// so that its weights are read once for each. There, groups stop, forwards and backwards, and go on behind
// it.
//
// A group is a fixed share of the minibatch and sums up its own gradient of convolutions and biases, sample
// by sample; the groups are then added in order. Dense layers have many weights and few activations, so their
// inputs and gradients are kept for the whole minibatch and each part of their weight matrix is summed up by
// one task. Hence the same bits for any number of threads.
#pragma once

#include <atomic>
#include <cstdint>
#include <vector>

#include "actor_critic.hpp"
#include "lock.hpp"
#include "network.hpp"
#include "network_kernel.hpp"
#include "thread_pool.hpp"

namespace racecraft {

constexpr size_t kPortion = 64;  // samples that pass through a wide layer together
constexpr size_t kChunk = 8;     // samples that pass through a layer together, so that they fit an L2 cache

class Learner : public ActorCritic {
  public:
    // Weights are zero at first. num_threads counts the calling thread; 0 takes one per core.
    Learner(const NetworkSpec& spec, int num_threads);

    const Network& network() const { return network_; }

    ActorCriticShape shape() const override;
    // Of the sensors' images, one after the other, and then of the LIDAR.
    void encode(const uint8_t* sight, size_t count, uint8_t* out) override;
    void policy(const uint8_t* observations, const float* states, size_t count, float* out) override;
    void values(const uint8_t* observations, const float* states, size_t count, float* out) override;
    UpdateStats update(const Minibatch& minibatch, const Objective& objective) override;

    // Parameters, Adam's first and second moments, as published  (num_public,).
    enum class Part { weights, moment1, moment2 };
    void read(Part part, float* published);
    void write(Part part, const float* published);

    int64_t num_updates() const { return num_updates_; }
    void set_num_updates(int64_t count) { num_updates_ = count; }

  private:
    // What the layers of one tower hold for a few samples.
    struct TowerBuffers {
        std::vector<FloatBuffer> out, grad;
    };
    // Where they are for the samples at hand.
    struct TowerPointers {
        std::vector<float*> out, grad;
    };
    // What a tower's first layers read, of the samples at hand.
    struct Inputs {
        const float *image, *lidar, *state;
    };
    // One thread's scratch.
    struct Worker {
        FloatBuffer input, lidar;
        TowerBuffers policy, critic;
        TowerPointers policy_at, critic_at;
    };
    struct DenseTask {
        const Tower* tower;
        size_t layer;
        int panel;
        size_t first, last;  // inputs
    };
    // Groups [first, last) of all, and the sample that a group begins with.
    struct Groups {
        size_t first, last, count, size;
        size_t begin(size_t group) const { return group * size / count; }
    };
    struct WideTask {
        const Tower* tower;
        size_t panel;  // of outputs, or of inputs
    };
    struct TransposeTask {
        const Layer* layer;
        int run;
        size_t lane;
    };

    template <typename Body>
    void for_each_task(size_t count, const Body& body);  // body(worker, task)
    size_t groups_of_portion(size_t size, size_t num_groups) const;
    void prepare_training(size_t size, size_t num_groups);
    void point(const Tower& tower, TowerBuffers& scratch, TowerBuffers* kept, size_t first, size_t portion,
               TowerPointers& at);
    void read_sample(Worker& worker, const uint8_t* observation, size_t sample) const;
    void read_samples(Worker& worker, const Minibatch& minibatch, size_t first, size_t samples) const;
    Inputs inputs_of(const Worker& worker, size_t first) const;
    void forward(const Tower& tower, const Inputs& in, size_t samples, const TowerPointers& at,
                 size_t from_layer, size_t to_layer) const;
    void backward(const Tower& tower, const Inputs& in, size_t samples, const TowerPointers& at,
                  float* gradient, size_t from_layer, size_t to_layer) const;
    void run_group(Worker& worker, const Minibatch& minibatch, const Objective& objective,
                   const Groups& groups, size_t group);
    template <typename Body>
    void for_each_group_before_wide(const Minibatch& minibatch, const Groups& groups, const Body& body);
    void forward_to_wide(const Minibatch& minibatch, const Groups& groups);
    void backward_from_wide(const Minibatch& minibatch, const Groups& groups);
    void sum_dense(const DenseTask& task, size_t size);
    double sum_over_tasks(size_t num_groups, size_t size);
    void gather(const Minibatch& minibatch);
    void step(const Objective& objective, double norm);
    void transpose();

    Network network_;
    ThreadPool pool_;
    Mutex mutex_;  // one caller at a time
    FloatBuffer weights_, moment1_, moment2_, gradient_, transposed_;
    FloatBuffer group_gradients_;  // (groups, num_grouped)
    int64_t num_updates_ = 0;
    bool is_transposed_ = false;
    std::vector<Worker> workers_;
    TowerBuffers kept_policy_,
        kept_critic_;  // of the whole minibatch: what dense layers saw, and their gradients
    size_t kept_size_ = 0, kept_portion_ = 0;  // samples that there is room for
    std::vector<float> kept_states_;           // (B, state_size)
    std::vector<float> kept_lidar_;            // (B, lidar_size)
    std::vector<LossTerms> terms_;             // (B,)
    std::vector<double> squares_;              // of the gradient, one sum per task
    std::vector<DenseTask> dense_tasks_;
    std::vector<WideTask> wide_forward_tasks_, wide_backward_tasks_;
    std::vector<TransposeTask> transpose_tasks_;
};

template <typename Body>
void Learner::for_each_task(size_t count, const Body& body) {
    std::atomic<size_t> next{0};
    pool_.for_each(workers_.size(), [&](size_t worker) {
        for (size_t task = next++; task < count; task = next++) body(workers_[worker], task);
    });
}

}  // namespace racecraft
