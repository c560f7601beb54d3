#include "ppo.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace racecraft {
namespace {

constexpr int64_t kUnlimited = std::numeric_limits<int64_t>::max();

size_t rows_for(const PpoConfig& config) {
    if (config.episodes_per_iteration == 0) return config.num_steps;
    const size_t driving = std::min(config.num_envs, config.episodes_per_iteration);
    return (config.max_steps_per_iteration + driving - 1) / driving;
}

}  // namespace

Ppo::Ppo(const PpoConfig& config, ActorCritic& learner)
    : config_(config),
      learner_(learner),
      shape_(learner.shape()),
      capacity_(rows_for(config)),
      quota_(config.num_envs),
      begins_(std::make_unique<bool[]>(config.num_envs)),
      looks_(config.num_envs),
      totals_(config.num_envs),
      lengths_(config.num_envs),
      outputs_(config.num_envs * shape_.policy_size()),
      commands_(shape_.is_discrete ? 0 : config.num_envs * shape_.num_actions),
      chosen_(shape_.is_discrete ? config.num_envs : 0),
      carried_(config.num_envs) {
    rollout_.num_envs = config.num_envs;
}

// ---- collect: drive until the rollout is full

void Ppo::begin(uint64_t seed, uint64_t iteration, int64_t total_steps) {
    const uint64_t seeds[] = {seed, iteration};
    random_ = NumpyRandom(seeds);
    iteration_ = iteration;
    total_steps_ = total_steps;
    rollout_.num_steps = 0;
    num_cuts_ = 0;
    ended_.clear();
    any_begins_ = false;
    is_full_ = false;
    const size_t n = config_.num_envs, episodes = config_.episodes_per_iteration;
    if (episodes == 0) {
        budget_ = static_cast<int64_t>(config_.num_steps * n);
        std::fill(quota_.begin(), quota_.end(), kUnlimited);
        return;
    }
    budget_ = static_cast<int64_t>(config_.max_steps_per_iteration);
    for (size_t car = 0; car < n; ++car) {
        quota_[car] = static_cast<int64_t>(episodes / n + (car < episodes % n ? 1 : 0));
    }
    std::fill(totals_.begin(), totals_.end(), 0.0);
    std::fill(lengths_.begin(), lengths_.end(), int64_t{0});
}

// Memory grows with what is driven: iterations of whole episodes seldom take all the rows they may.
void Ppo::make_row() {
    Rollout& r = rollout_;
    const size_t size = ++r.num_steps * r.num_envs;
    if (r.rewards.size() >= size) return;
    const size_t rows =
        config_.episodes_per_iteration == 0 ? capacity_ : std::min(capacity_, 2 * r.num_steps);
    const size_t most = rows * r.num_envs;
    r.observations.resize(most * shape_.observation_size);
    r.states.resize(most * shape_.state_size);
    if (shape_.is_discrete) {
        r.action_indices.resize(most);
    } else {
        r.actions.resize(most * shape_.num_actions);
    }
    for (auto* column : {&r.log_probs, &r.rewards, &r.values, &r.next_values, &r.advantages, &r.returns}) {
        column->resize(most);
    }
    for (auto* column : {&r.terminated, &r.truncated, &r.is_valid}) column->resize(most);
}

bool Ppo::act(const uint8_t* sight, const float* states, size_t state_width) {
    make_row();
    Rollout& r = rollout_;
    const size_t n = r.num_envs, first = (r.num_steps - 1) * n;
    uint8_t* observations = r.observations.data() + first * shape_.observation_size;
    float* seen = r.states.data() + first * shape_.state_size;
    learner_.encode(sight, n, observations);
    for (size_t car = 0; car < n; ++car) {
        std::copy_n(states + car * state_width, shape_.state_size, seen + car * shape_.state_size);
        r.is_valid[first + car] = quota_[car] > 0 ? 1 : 0;
        r.next_values[first + car] = 0.0f;
    }
    learner_.policy(observations, seen, n, outputs_.data());
    if (!std::all_of(outputs_.begin(), outputs_.end(), [](float x) { return std::isfinite(x); }))
        return false;
    draw(first);
    return true;
}

// Explore: actions as the policy drew them, and their log-probabilities under it.
void Ppo::draw(size_t first) {
    Rollout& r = rollout_;
    const size_t n = r.num_envs, num_actions = shape_.num_actions;
    const auto uniforms = [this](size_t count) {
        noise_.resize(count);
        for (double& uniform : noise_) uniform = random_.random();
    };
    if (!shape_.is_discrete) {
        const size_t count = n * num_actions, pairs = (count + 1) / 2;
        uniforms(2 * pairs);
        normals_.resize(2 * pairs);
        standard_normals(noise_.data(), pairs, normals_.data());
        float* drawn = r.actions.data() + first * num_actions;
        sample_gaussian(outputs_.data(), normals_.data(), n, num_actions, drawn);
        gaussian_log_probs(outputs_.data(), drawn, n, num_actions, r.log_probs.data() + first);
        for (size_t i = 0; i < count; ++i) commands_[i] = std::clamp(drawn[i], -1.0f, 1.0f);
        return;
    }
    uniforms(n);
    if (config_.is_greedy) {
        const double steps = static_cast<double>(config_.epsilon_steps);
        const double done =
            config_.epsilon_steps > 0 ? std::min(static_cast<double>(total_steps_) / steps, 1.0) : 1.0;
        const double epsilon = config_.epsilon_start + (config_.epsilon_end - config_.epsilon_start) * done;
        for (size_t car = 0; car < n; ++car) {
            const float* logits = outputs_.data() + car * num_actions;
            const int64_t any = random_.integer(static_cast<uint32_t>(num_actions));
            const int64_t best = std::max_element(logits, logits + num_actions) - logits;
            chosen_[car] = noise_[car] < epsilon ? any : best;
        }
    } else {
        sample_categorical(outputs_.data(), noise_.data(), n, num_actions, chosen_.data());
    }
    std::copy_n(chosen_.begin(), n, r.action_indices.begin() + static_cast<ptrdiff_t>(first));
    categorical_log_probs(outputs_.data(), chosen_.data(), n, num_actions, r.log_probs.data() + first);
}

bool Ppo::pay(const double* rewards, const bool* terminated, const bool* truncated) {
    Rollout& r = rollout_;
    const size_t n = r.num_envs, first = (r.num_steps - 1) * n;
    const bool is_of_episodes = config_.episodes_per_iteration > 0;
    bool any_quota = false;
    any_begins_ = false;
    for (size_t car = 0; car < n; ++car) {
        const size_t i = first + car;
        const bool is_driving = r.is_valid[i] != 0, is_over = terminated[car] || truncated[car];
        r.rewards[i] = static_cast<float>(rewards[car]);
        r.terminated[i] = terminated[car] ? 1 : 0;
        r.truncated[i] = truncated[car] && !terminated[car] ? 1 : 0;
        budget_ -= is_driving ? 1 : 0;
        total_steps_ += is_driving ? 1 : 0;
        totals_[car] += rewards[car];
        ++lengths_[car];
        if (is_over) {
            if (is_driving) ended_.push_back({car, totals_[car], lengths_[car]});
            if (is_driving && is_of_episodes) --quota_[car];
            totals_[car] = 0.0;
            lengths_[car] = 0;
        }
        begins_[car] = is_over && quota_[car] > 0;
        any_begins_ |= begins_[car];
        any_quota |= quota_[car] > 0;
    }
    is_full_ = budget_ <= 0 || !any_quota || r.num_steps >= capacity_;

    // The last frame of a truncated episode is gone after the reset: keep it for its value. And every car
    // still under way continues after the last row: its value stands in for what follows.
    bool any_looks = false;
    for (size_t car = 0; car < n; ++car) {
        const size_t i = first + car;
        const bool goes_on = r.truncated[i] != 0 || (is_full_ && r.terminated[i] == 0);
        looks_[car] = r.is_valid[i] != 0 && goes_on ? 1 : 0;
        any_looks |= looks_[car] != 0;
    }
    return any_looks;
}

void Ppo::look(const uint8_t* sight, const float* states, size_t state_width) {
    const size_t n = rollout_.num_envs, first = (rollout_.num_steps - 1) * n;
    if (num_cuts_ == cuts_.size()) cuts_.emplace_back();
    Cut& cut = cuts_[num_cuts_++];
    cut.places.clear();
    cut.states.clear();
    sights_.clear();
    for (size_t car = 0; car < n; ++car) {
        if (looks_[car] == 0) continue;
        const uint8_t* seen = sight + car * shape_.sight_size;
        const float* state = states + car * state_width;
        cut.places.push_back(first + car);
        sights_.insert(sights_.end(), seen, seen + shape_.sight_size);
        cut.states.insert(cut.states.end(), state, state + shape_.state_size);
    }
    cut.observations.resize(cut.places.size() * shape_.observation_size);
    learner_.encode(sights_.data(), cut.places.size(), cut.observations.data());
}

// ---- estimate: values, advantages, returns

// The critic's values, in units of reward.
void Ppo::judge(const uint8_t* observations, const float* states, size_t count, float* values) {
    learner_.values(observations, states, count, values);
    for (size_t i = 0; i < count; ++i) {
        values[i] = static_cast<float>(static_cast<double>(values[i]) * return_scale_[1] + return_scale_[0]);
    }
}

void Ppo::estimate() {
    Rollout& r = rollout_;
    for (size_t k = 0; k < num_cuts_; ++k) {
        const Cut& cut = cuts_[k];
        picked_.resize(cut.places.size());
        judge(cut.observations.data(), cut.states.data(), cut.places.size(), picked_.data());
        for (size_t i = 0; i < cut.places.size(); ++i) r.next_values[cut.places[i]] = picked_[i];
    }
    judge(r.observations.data(), r.states.data(), r.num_samples(), r.values.data());
    generalized_advantages({r.num_steps, r.num_envs, r.rewards.data(), r.values.data(), r.next_values.data(),
                            r.terminated.data(), r.truncated.data(), r.advantages.data(), r.returns.data()},
                           config_.gamma, config_.gae_lambda, carried_.data());
}

// Moves the critic's unit towards the returns seen lately; the first rollout sets it.
void Ppo::follow_returns(const Moments& seen) {
    if (!config_.normalize_returns) return;
    const double found[] = {seen.mean, std::max(seen.spread, 1e-6)};
    for (int i = 0; i < 2; ++i) {
        return_scale_[i] = iteration_ == 0 ? found[i] : 0.9 * return_scale_[i] + 0.1 * found[i];
    }
}

// ---- learn: gradient steps on shuffled minibatches

bool Ppo::learn() {
    Rollout& r = rollout_;
    updates_.clear();
    estimate();

    used_.clear();
    for (size_t i = 0; i < r.num_samples(); ++i) {
        if (r.is_valid[i] != 0) used_.push_back(static_cast<int64_t>(i));
    }
    const auto moments_of_used = [&](const std::vector<float>& column) {
        picked_.resize(used_.size());
        for (size_t k = 0; k < used_.size(); ++k) picked_[k] = column[static_cast<size_t>(used_[k])];
        return moments_of(picked_.data(), picked_.size());
    };
    const Moments returns = moments_of_used(r.returns), advantages = moments_of_used(r.advantages);
    const double unexplained = advantages.spread / returns.spread;
    explained_variance_ =
        returns.spread > 0.0 ? 1.0 - unexplained * unexplained : std::numeric_limits<double>::quiet_NaN();

    follow_returns(returns);
    const float centre = static_cast<float>(advantages.mean);
    const float scale = static_cast<float>(advantages.spread + 1e-8);
    for (size_t i = 0; i < r.num_samples(); ++i) {
        r.returns[i] =
            static_cast<float>((static_cast<double>(r.returns[i]) - return_scale_[0]) / return_scale_[1]);
        r.advantages[i] = (r.advantages[i] - centre) / scale;
    }

    double rate = config_.objective.learning_rate;
    if (config_.rate_steps > 0) {
        rate /= 1.0 + static_cast<double>(total_steps_) / static_cast<double>(config_.rate_steps);
    }
    return improve(rate);
}

bool Ppo::improve(double rate) {
    const Rollout& r = rollout_;
    Objective objective = config_.objective;
    objective.learning_rate = rate;
    const size_t size = std::min(config_.minibatch_size, used_.size());
    for (size_t epoch = 0; epoch < config_.update_epochs; ++epoch) {
        order_ = used_;
        random_.shuffle(order_.data(), order_.size());
        for (size_t start = 0; start + size <= order_.size();
             start += size) {  // a last partial one is dropped
            updates_.push_back(learner_.update(
                {size, order_.data() + start, r.observations.data(), r.states.data(), r.action_indices.data(),
                 r.actions.data(), r.log_probs.data(), r.advantages.data(), r.returns.data()},
                objective));
            if (!updates_.back().is_finite()) return false;
        }
    }
    return true;
}

}  // namespace racecraft
