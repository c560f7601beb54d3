// The border between Python and PPO's loop: arrays are read in place, and a learner that is not the core's
// own is called back, see racecraft.learn.native_loop.
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <stdexcept>
#include <string>
#include <tuple>

#include "learner.hpp"
#include "ppo.hpp"

namespace nb = nanobind;
using namespace nb::literals;

namespace racecraft {
namespace {

void require(bool is_met, const char* message) {
    if (!is_met) throw std::invalid_argument(message);
}

template <typename T>
using Shown = nb::ndarray<nb::numpy, T, nb::ndim<1>, nb::c_contig>;

// An array that lies where it is: `owner` keeps it there, or nothing does while somebody is called.
template <typename T>
nb::object view(const T* data, std::initializer_list<size_t> shape, nb::handle owner = nb::handle()) {
    return nb::cast(nb::ndarray<nb::numpy, T>(const_cast<T*>(data), shape, owner), nb::rv_policy::reference);
}

// A learner of Python's, called with flat arrays that live as long as the call.
class OutsideLearner final : public ActorCritic {
  public:
    OutsideLearner(nb::object learner, const ActorCriticShape& shape)
        : learner_(std::move(learner)), shape_(shape) {}

    ActorCriticShape shape() const override { return shape_; }

    void encode(const uint8_t* sight, size_t count, uint8_t* out) override {
        const nb::gil_scoped_acquire acquire;
        fill(learner_.attr("encode")(view(sight, {count, shape_.sight_size})), out,
             count * shape_.observation_size);
    }

    void policy(const uint8_t* observations, const float*, size_t count, float* out) override {
        const nb::gil_scoped_acquire acquire;
        fill(learner_.attr("policy")(view(observations, {count, shape_.observation_size})), out,
             count * shape_.policy_size());
    }

    void values(const uint8_t* observations, const float* states, size_t count, float* out) override {
        const nb::gil_scoped_acquire acquire;
        fill(learner_.attr("values")(view(observations, {count, shape_.observation_size}),
                                     view(states, {count, shape_.state_size})),
             out, count);
    }

    UpdateStats update(const Minibatch& m, const Objective& objective) override {
        const nb::gil_scoped_acquire acquire;
        const size_t count = num_samples;
        const nb::object actions = shape_.is_discrete ? view(m.action_indices, {count})
                                                      : view(m.actions, {count, shape_.num_actions});
        const nb::object terms = learner_.attr("update")(
            view(m.observations, {count, shape_.observation_size}),
            view(m.states, {count, shape_.state_size}), actions, view(m.log_probs, {count}),
            view(m.advantages, {count}), view(m.returns, {count}), view(m.rows, {m.size}),
            objective.learning_rate);
        const auto [policy, value, entropy, kl, clipped, norm] =
            nb::cast<std::tuple<double, double, double, double, double, double>>(terms);
        return {policy, value, entropy, kl, clipped, norm};
    }

    size_t num_samples = 0;  // of the arrays that minibatches are rows of

  private:
    template <typename T>
    static void fill(const nb::object& from, T* out, size_t count) {
        const auto array = nb::cast<nb::ndarray<const T, nb::c_contig, nb::device::cpu>>(from);
        require(array.size() == count, "A learner gave an array of another size.");
        std::copy_n(array.data(), count, out);
    }

    nb::object learner_;
    ActorCriticShape shape_;
};

// The loop, and what it learns with.
class BoundPpo {
  public:
    BoundPpo(const PpoConfig& config, nb::object learner, const ActorCriticShape& shape)
        : owner_(learner),
          outside_(learner, shape),
          own_(nb::isinstance<Learner>(learner) ? nb::cast<Learner*>(learner) : nullptr),
          ppo(config, own_ != nullptr ? static_cast<ActorCritic&>(*own_) : outside_),
          shape_(own_ != nullptr ? own_->shape() : shape),
          num_envs_(config.num_envs) {}

    using Sight = nb::ndarray<nb::ro, nb::c_contig, nb::device::cpu>;
    using States = nb::ndarray<const float, nb::ndim<2>, nb::c_contig, nb::device::cpu>;
    template <typename T>
    using Column = nb::ndarray<const T, nb::ndim<1>, nb::c_contig, nb::device::cpu>;

    bool act(const Sight& sight, const States& states) {
        check(sight, states);
        require(!ppo.is_full(), "The rollout is full.");
        is_paid_ = false;
        const nb::gil_scoped_release release;
        return ppo.act(static_cast<const uint8_t*>(sight.data()), states.data(), states.shape(1));
    }

    bool pay(const Column<double>& rewards, const Column<bool>& terminated, const Column<bool>& truncated) {
        require(!is_paid_, "Nothing was done that could be paid.");
        require(rewards.shape(0) == num_envs_ && terminated.shape(0) == num_envs_ &&
                    truncated.shape(0) == num_envs_,
                "Each car needs one reward and whether its episode is over.");
        is_paid_ = true;
        return ppo.pay(rewards.data(), terminated.data(), truncated.data());
    }

    void look(const Sight& sight, const States& states) {
        check(sight, states);
        require(is_paid_ && ppo.rollout().num_steps > 0, "Nothing was paid yet.");
        const nb::gil_scoped_release release;
        ppo.look(static_cast<const uint8_t*>(sight.data()), states.data(), states.shape(1));
    }

    bool learn() {
        require(is_paid_ && ppo.is_full() && ppo.rollout().num_steps > 0, "The rollout is not full yet.");
        outside_.num_samples = ppo.rollout().num_samples();
        const nb::gil_scoped_release release;
        return ppo.learn();
    }

    // A copy, as the next iteration overwrites the rollout, or moves it.
    nb::object column(const std::string& name) const {
        const Rollout& r = ppo.rollout();
        if (name == "observations") return copy(r.observations, shape_.observation_size);
        if (name == "states") return copy(r.states, shape_.state_size);
        if (name == "actions") {
            return shape_.is_discrete ? copy(r.action_indices) : copy(r.actions, shape_.num_actions);
        }
        const std::pair<const char*, const std::vector<float>*> numbers[] = {
            {"log_probs", &r.log_probs},     {"rewards", &r.rewards},       {"values", &r.values},
            {"next_values", &r.next_values}, {"advantages", &r.advantages}, {"returns", &r.returns}};
        for (const auto& [key, numbers_of] : numbers) {
            if (name == key) return copy(*numbers_of);
        }
        const std::pair<const char*, const std::vector<uint8_t>*> flags[] = {
            {"terminated", &r.terminated}, {"truncated", &r.truncated}, {"is_valid", &r.is_valid}};
        for (const auto& [key, flags_of] : flags) {
            if (name == key) return copy(*flags_of).attr("astype")("bool");
        }
        throw std::invalid_argument("A rollout has no column '" + name + "'.");
    }

    nb::object actions(nb::handle owner) const {
        if (shape_.is_discrete) return view(ppo.action_indices(), {num_envs_}, owner);
        return view(ppo.actions(), {num_envs_, shape_.num_actions}, owner);
    }

  private:
    void check(const Sight& sight, const States& states) const {
        require(states.shape(0) == num_envs_ && states.shape(1) >= shape_.state_size,
                "The privileged states are not of this network's shape.");
        if (shape_.sight_size == 0) return;  // of a learner without a camera
        require(sight.dtype() == nb::dtype<uint8_t>() && sight.size() == num_envs_ * shape_.sight_size,
                "The frames are not of this network's size, a byte to a pixel.");
    }

    template <typename T>
    nb::object copy(const std::vector<T>& column, size_t width = 0) const {
        const size_t steps = ppo.rollout().num_steps;
        const nb::object in_place = width > 0 ? view(column.data(), {steps, num_envs_, width})
                                              : view(column.data(), {steps, num_envs_});
        return in_place.attr("copy")();
    }

    nb::object owner_;
    OutsideLearner outside_;
    Learner* own_;

  public:
    Ppo ppo;

  private:
    ActorCriticShape shape_;
    size_t num_envs_;
    bool is_paid_ = true;
};

}  // namespace

void bind_ppo(nb::module_& m) {
    nb::class_<PpoConfig>(m, "PpoConfig", "See racecraft.learn.PPOConfig.")
        .def(
            "__init__",
            [](PpoConfig* self, size_t num_envs, size_t num_steps, size_t episodes_per_iteration,
               size_t max_steps_per_iteration, size_t rate_steps, double gamma, double gae_lambda,
               size_t minibatch_size, size_t update_epochs, bool normalize_returns, bool is_greedy,
               double epsilon_start, double epsilon_end, size_t epsilon_steps, const Objective& objective) {
                new (self) PpoConfig{num_envs,
                                     num_steps,
                                     episodes_per_iteration,
                                     max_steps_per_iteration,
                                     rate_steps,
                                     gamma,
                                     gae_lambda,
                                     minibatch_size,
                                     update_epochs,
                                     normalize_returns,
                                     is_greedy,
                                     epsilon_start,
                                     epsilon_end,
                                     epsilon_steps,
                                     objective};
            },
            nb::kw_only(), "num_envs"_a, "num_steps"_a, "episodes_per_iteration"_a,
            "max_steps_per_iteration"_a, "rate_steps"_a, "gamma"_a, "gae_lambda"_a, "minibatch_size"_a,
            "update_epochs"_a, "normalize_returns"_a, "is_greedy"_a, "epsilon_start"_a, "epsilon_end"_a,
            "epsilon_steps"_a, "objective"_a);

    nb::class_<BoundPpo>(m, "Ppo", "PPO's loop, native/src/ppo.hpp; see racecraft.learn.PPO, its face.")
        .def(
            "__init__",
            [](BoundPpo* self, const PpoConfig& config, nb::object learner, size_t sight_size,
               size_t observation_size, size_t state_size, size_t num_actions, bool is_discrete) {
                require(config.num_envs > 0 && config.minibatch_size > 0 && num_actions > 0,
                        "A loop needs cars, samples in a minibatch, and actions.");
                new (self) BoundPpo(config, std::move(learner),
                                    {sight_size, observation_size, state_size, num_actions, is_discrete});
            },
            nb::kw_only(), "config"_a, "learner"_a, "sight_size"_a, "observation_size"_a, "state_size"_a,
            "num_actions"_a, "is_discrete"_a)
        .def(
            "begin",
            [](BoundPpo& self, uint64_t seed, uint64_t iteration, int64_t total_steps) {
                self.ppo.begin(seed, iteration, total_steps);
            },
            "seed"_a, "iteration"_a, "total_steps"_a)
        .def("act", &BoundPpo::act, "sight"_a.noconvert(), "states"_a,
             "Store what the cars see and draw `actions`; False where the policy's outputs are not finite.")
        .def("pay", &BoundPpo::pay, "rewards"_a, "terminated"_a, "truncated"_a,
             "Store the outcome; True where look() is to come before any reset.")
        .def("look", &BoundPpo::look, "sight"_a.noconvert(), "states"_a)
        .def("learn", &BoundPpo::learn, "False where the last update was not finite, and not applied.")
        .def("column", &BoundPpo::column, "name"_a, "A copy of one column of the rollout  (T, N, ...).")
        .def_prop_ro("is_full", [](const BoundPpo& self) { return self.ppo.is_full(); })
        .def_prop_ro("any_begins", [](const BoundPpo& self) { return self.ppo.any_begins(); })
        .def_prop_ro("total_steps", [](const BoundPpo& self) { return self.ppo.total_steps(); })
        .def_prop_ro("num_driven", [](const BoundPpo& self) { return self.ppo.num_driven(); })
        .def_prop_ro("explained_variance", [](const BoundPpo& self) { return self.ppo.explained_variance(); })
        .def_prop_ro(
            "updates",
            [](const BoundPpo& self) {
                std::vector<std::tuple<double, double, double, double, double, double>> rows;
                for (const UpdateStats& s : self.ppo.updates()) {
                    rows.emplace_back(s.policy_loss, s.value_loss, s.entropy, s.approx_kl, s.clip_fraction,
                                      s.grad_norm);
                }
                return rows;
            },
            "What every gradient step of the last learn() saw.")
        .def_prop_ro(
            "ended",
            [](const BoundPpo& self) {
                std::vector<std::tuple<size_t, double, int64_t>> rows;
                for (const EndedEpisode& e : self.ppo.ended()) rows.emplace_back(e.car, e.total, e.length);
                return rows;
            },
            "Car, sum of rewards and steps of the episodes that ended since begin().")
        .def_prop_ro(
            "actions", [](nb::handle_t<BoundPpo> self) { return nb::cast<BoundPpo&>(self).actions(self); },
            "What the cars do, overwritten by every act().")
        .def_prop_ro(
            "begins",
            [](nb::handle_t<BoundPpo> self) {
                const Ppo& ppo = nb::cast<BoundPpo&>(self).ppo;
                return Shown<bool>(const_cast<bool*>(ppo.begins()), {ppo.rollout().num_envs}, self);
            },
            "Which cars are to be put at a new start, overwritten by every pay().")
        .def_prop_ro(
            "totals",
            [](nb::handle_t<BoundPpo> self) {
                Ppo& ppo = nb::cast<BoundPpo&>(self).ppo;
                return Shown<double>(ppo.totals(), {ppo.rollout().num_envs}, self);
            },
            "Sums of rewards of the episodes under way, to be read and written.")
        .def_prop_ro(
            "lengths",
            [](nb::handle_t<BoundPpo> self) {
                Ppo& ppo = nb::cast<BoundPpo&>(self).ppo;
                return Shown<int64_t>(ppo.lengths(), {ppo.rollout().num_envs}, self);
            },
            "Steps of the same.")
        .def_prop_ro(
            "return_scale",
            [](nb::handle_t<BoundPpo> self) {
                return Shown<double>(nb::cast<BoundPpo&>(self).ppo.return_scale(), {2}, self);
            },
            "Mean and spread of the returns, the critic's unit, to be read and written.");

    m.def(
        "generalized_advantages",
        [](const nb::ndarray<const float, nb::ndim<2>, nb::c_contig, nb::device::cpu>& rewards,
           const nb::ndarray<const float, nb::ndim<2>, nb::c_contig, nb::device::cpu>& values,
           const nb::ndarray<const float, nb::ndim<2>, nb::c_contig, nb::device::cpu>& next_values,
           const nb::ndarray<const bool, nb::ndim<2>, nb::c_contig, nb::device::cpu>& terminated,
           const nb::ndarray<const bool, nb::ndim<2>, nb::c_contig, nb::device::cpu>& truncated, double gamma,
           double gae_lambda) {
            const size_t steps = rewards.shape(0), cars = rewards.shape(1), count = steps * cars;
            require(values.size() == count && next_values.size() == count && terminated.size() == count &&
                        truncated.size() == count,
                    "The columns of a rollout differ in size.");
            const std::vector<uint8_t> ends(terminated.data(), terminated.data() + count);
            const std::vector<uint8_t> cuts(truncated.data(), truncated.data() + count);
            std::vector<float> advantages(count), returns(count), carried(cars);
            generalized_advantages({steps, cars, rewards.data(), values.data(), next_values.data(),
                                    ends.data(), cuts.data(), advantages.data(), returns.data()},
                                   gamma, gae_lambda, carried.data());
            return nb::make_tuple(view(advantages.data(), {steps, cars}).attr("copy")(),
                                  view(returns.data(), {steps, cars}).attr("copy")());
        },
        nb::kw_only(), "rewards"_a, "values"_a, "next_values"_a, "terminated"_a, "truncated"_a, "gamma"_a,
        "gae_lambda"_a,
        "Generalised advantages and returns of a rollout, each (T, N), as the loop computes them.");
}

}  // namespace racecraft
