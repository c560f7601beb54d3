// The border between Python and the learner: shapes are checked in racecraft.learn.native_learner, arrays are
// read in place.
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <numeric>
#include <stdexcept>
#include <string>
#include <tuple>

#include "distributions.hpp"
#include "learner.hpp"
#include "learner_profile.hpp"
#include "numpy_random.hpp"

namespace nb = nanobind;
using namespace nb::literals;

namespace racecraft {
namespace {

template <typename T, int Dimensions>
using In = nb::ndarray<const T, nb::ndim<Dimensions>, nb::c_contig, nb::device::cpu>;
template <typename T, int Dimensions>
using Out = nb::ndarray<nb::numpy, T, nb::ndim<Dimensions>, nb::c_contig>;

// A new array, (rows, columns) or (rows,) for Dimensions = 1, that Python owns.
template <typename T, int Dimensions>
Out<T, Dimensions> new_array(std::initializer_list<size_t> shape) {
    size_t size = 1;
    for (const size_t side : shape) size *= side;
    T* data = new T[size];
    const nb::capsule owner(data, [](void* p) noexcept { delete[] static_cast<T*>(p); });
    return Out<T, Dimensions>(data, shape, owner);
}

void require(bool is_met, const char* message) {
    if (!is_met) throw std::invalid_argument(message);
}

size_t checked_count(const Network& network, const In<uint8_t, 2>& observations) {
    require(observations.shape(1) == network.spec.observation_size(),
            "The observations are not of this network's shape.");
    return observations.shape(0);
}

void check_states(const Network& network, const In<float, 2>& states, size_t count) {
    require(network.spec.state_size == 0 ||
                (states.shape(0) == count && states.shape(1) == static_cast<size_t>(network.spec.state_size)),
            "The privileged states are not of this network's shape.");
}

std::tuple<double, double, double, double, double, double> update(
    Learner& self, const In<uint8_t, 2>& observations, const In<float, 2>& states,
    const In<int64_t, 1>& action_indices, const In<float, 2>& actions, const In<float, 1>& log_probs,
    const In<float, 1>& advantages, const In<float, 1>& returns, const In<int64_t, 1>& rows,
    const Objective& objective) {
    const Network& network = self.network();
    const size_t num_actions = static_cast<size_t>(network.spec.num_actions);
    const size_t count = checked_count(network, observations);
    check_states(network, states, count);
    require(rows.shape(0) > 0, "A minibatch needs at least one sample.");
    require(log_probs.shape(0) == count && advantages.shape(0) == count && returns.shape(0) == count,
            "The arrays of a minibatch differ in length.");
    for (size_t i = 0; i < rows.shape(0); ++i) {
        require(rows(i) >= 0 && static_cast<size_t>(rows(i)) < count,
                "A row of the minibatch is not one of its arrays'.");
    }
    if (network.spec.is_discrete) {
        require(action_indices.shape(0) == count, "The arrays of a minibatch differ in length.");
        for (size_t i = 0; i < rows.shape(0); ++i) {
            const int64_t action = action_indices(static_cast<size_t>(rows(i)));
            require(action >= 0 && static_cast<size_t>(action) < num_actions,
                    "An action of the minibatch is not one of this network's.");
        }
    } else {
        require(actions.shape(0) == count && actions.shape(1) == num_actions,
                "The actions of a minibatch are not of this network's shape.");
    }
    const Minibatch minibatch{rows.shape(0),    rows.data(),           observations.data(),
                              states.data(),    action_indices.data(), actions.data(),
                              log_probs.data(), advantages.data(),     returns.data()};
    nb::gil_scoped_release release;
    const UpdateStats s = self.update(minibatch, objective);
    return {s.policy_loss, s.value_loss, s.entropy, s.approx_kl, s.clip_fraction, s.grad_norm};
}

double descend(Learner& self, const In<uint8_t, 2>& observations, const In<float, 2>& slopes,
               const Objective& objective) {
    const Network& network = self.network();
    const size_t count = checked_count(network, observations);
    require(count > 0, "A minibatch needs at least one sample.");
    require(!network.spec.is_blind(), "A network that sees states alone learns by PPO alone.");
    require(slopes.shape(0) == count && slopes.shape(1) == static_cast<size_t>(network.spec.num_actions),
            "The slopes are not of this network's outputs.");
    const std::vector<float> states(count * static_cast<size_t>(network.spec.state_size));
    Minibatch minibatch{};
    minibatch.size = count;
    minibatch.observations = observations.data();
    minibatch.states = states.data();
    minibatch.slopes = slopes.data();
    nb::gil_scoped_release release;
    return self.update(minibatch, objective).grad_norm;
}

Learner::Part part_of(const std::string& name) {
    if (name == "weights") return Learner::Part::weights;
    if (name == "moment1") return Learner::Part::moment1;
    if (name == "moment2") return Learner::Part::moment2;
    throw std::invalid_argument("A learner has no part '" + name +
                                "'; choose 'weights', 'moment1' or 'moment2'.");
}

}  // namespace

void bind_learner(nb::module_& m) {
    nb::class_<Objective>(m, "Objective", "The loss and the step taken on it; see racecraft.learn.Objective.")
        .def(
            "__init__",
            [](Objective* self, double learning_rate, double clip_coef, double ent_coef, double vf_coef,
               bool is_huber, double max_grad_norm, double adam_eps, bool is_eps_hat) {
                new (self) Objective{learning_rate, clip_coef,     ent_coef, vf_coef,
                                     is_huber,      max_grad_norm, adam_eps, is_eps_hat};
            },
            nb::kw_only(), "learning_rate"_a, "clip_coef"_a, "ent_coef"_a, "vf_coef"_a, "is_huber"_a,
            "max_grad_norm"_a, "adam_eps"_a, "is_eps_hat"_a);

    nb::class_<Learner>(m, "Learner", "A network that learns; see racecraft.learn.native_learner.")
        .def(
            "__init__",
            [](Learner* self, int height, int width, int top, int pool, int block,
               const std::vector<std::tuple<int, int, int>>& convs, const std::vector<int>& dense,
               int num_actions, bool is_discrete, int state_size, const std::vector<int>& critic_units,
               int lenses, int lidar_size, const std::vector<int>& lidar_units,
               const std::vector<int>& policy_units, int num_threads) {
                NetworkSpec spec{height, width,       pool,        block,       {},
                                 dense,  num_actions, is_discrete, state_size,  critic_units,
                                 top,    lenses,      lidar_size,  lidar_units, policy_units};
                for (const auto& [filters, kernel, stride] : convs) {
                    spec.convs.push_back({filters, kernel, stride});
                }
                new (self) Learner(spec, num_threads);
            },
            nb::kw_only(), "height"_a, "width"_a, "top"_a, "pool"_a, "block"_a, "convs"_a, "dense"_a,
            "num_actions"_a, "is_discrete"_a, "state_size"_a, "critic_units"_a, "lenses"_a, "lidar_size"_a,
            "lidar_units"_a, "policy_units"_a, "num_threads"_a)
        .def(
            "encode",
            [](Learner& self, In<uint8_t, 2> sight) {
                const NetworkSpec& spec = self.network().spec;
                require(sight.shape(1) == spec.sight_size(), "The frames are not of this network's size.");
                const size_t count = sight.shape(0);
                auto out = new_array<uint8_t, 2>({count, spec.observation_size()});
                uint8_t* data = out.data();
                const uint8_t* bytes = sight.data();
                nb::gil_scoped_release release;
                self.encode(bytes, count, data);
                return out;
            },
            "sight"_a)
        .def(
            "policy",
            [](Learner& self, In<uint8_t, 2> observations, In<float, 2> states) {
                const size_t count = checked_count(self.network(), observations);
                if (self.network().spec.is_blind()) check_states(self.network(), states, count);
                auto out = new_array<float, 2>({count, self.network().spec.policy_size()});
                float* data = out.data();
                const uint8_t* bytes = observations.data();
                const float* columns = states.data();
                nb::gil_scoped_release release;
                self.policy(bytes, columns, count, data);
                return out;
            },
            "observations"_a, "states"_a)
        .def(
            "values",
            [](Learner& self, In<uint8_t, 2> observations, In<float, 2> states) {
                const size_t count = checked_count(self.network(), observations);
                check_states(self.network(), states, count);
                auto out = new_array<float, 1>({count});
                float* data = out.data();
                const uint8_t* bytes = observations.data();
                const float* columns = states.data();
                nb::gil_scoped_release release;
                self.values(bytes, columns, count, data);
                return out;
            },
            "observations"_a, "states"_a)
        .def("update", &update, "observations"_a, "states"_a, "action_indices"_a, "actions"_a, "log_probs"_a,
             "advantages"_a, "returns"_a, "rows"_a, "objective"_a)
        .def("descend", &descend, "observations"_a, "slopes"_a, "objective"_a,
             "One gradient step on another loss, given by its slopes at the policy's outputs; the gradient's "
             "norm.")
        .def(
            "read",
            [](Learner& self, const std::string& part) {
                auto out = new_array<float, 1>({self.network().num_public});
                self.read(part_of(part), out.data());
                return out;
            },
            "part"_a, "A copy of 'weights', 'moment1' or 'moment2', flat.")
        .def(
            "write",
            [](Learner& self, const std::string& part, In<float, 1> values) {
                require(values.shape(0) == self.network().num_public,
                        "The parameters are not of this network's number.");
                self.write(part_of(part), values.data());
            },
            "part"_a, "values"_a)
        .def_prop_rw("num_updates", &Learner::num_updates, &Learner::set_num_updates)
        .def(
            "profile_layers",
            [](const Learner& self, size_t samples, int repeats) {
                require(samples > 0 && repeats > 0, "Profiling needs at least one sample and one repeat.");
                return profile_layers(self.network().spec, samples, repeats);
            },
            "samples"_a = 8, "repeats"_a = 200)
        .def_prop_ro("num_parameters", [](const Learner& self) { return self.network().num_public; });

    nb::class_<LayerTime>(m, "LayerTime", "Speed of one pass of one layer, for one sample on one thread.")
        .def_ro("tower", &LayerTime::tower)
        .def_ro("shape", &LayerTime::shape)
        .def_ro("pass_name", &LayerTime::pass)
        .def_ro("operations", &LayerTime::operations)
        .def_ro("seconds", &LayerTime::seconds);
    m.def("peak_operations_per_second", &peak_operations_per_second,
          "Fused multiply-adds on registers alone, counted as two operations each, on one thread.");

    nb::class_<NumpyRandom>(m, "NumpyRandom",
                            "The core's own numpy.random.default_rng(seeds), at most four of them.")
        .def(
            "__init__",
            [](NumpyRandom* self, const std::vector<uint64_t>& seeds) {
                require(seeds.size() <= NumpyRandom::kMostSeeds, "There may be at most four seeds.");
                new (self) NumpyRandom(seeds);
            },
            "seeds"_a)
        .def(
            "random",
            [](NumpyRandom& self, size_t count) {
                auto out = new_array<double, 1>({count});
                std::generate_n(out.data(), count, [&self] { return self.random(); });
                return out;
            },
            "count"_a, "Uniform in [0, 1).")
        .def(
            "integers",
            [](NumpyRandom& self, uint32_t bound, size_t count) {
                require(bound > 0, "No whole number is below a bound of 0.");
                auto out = new_array<int64_t, 1>({count});
                std::generate_n(out.data(), count, [&self, bound] { return self.integer(bound); });
                return out;
            },
            "bound"_a, "count"_a, "Uniform from 0 to bound - 1.")
        .def(
            "permutation",
            [](NumpyRandom& self, size_t count) {
                auto out = new_array<int64_t, 1>({count});
                std::iota(out.data(), out.data() + count, int64_t{0});
                self.shuffle(out.data(), count);
                return out;
            },
            "count"_a, "The whole numbers below count in any order.");

    m.def(
        "sample_categorical",
        [](In<float, 2> logits, In<double, 1> uniforms) {
            require(logits.shape(1) > 0 && uniforms.shape(0) == logits.shape(0),
                    "Sampling needs one uniform number for each row of logits.");
            auto actions = new_array<int64_t, 1>({logits.shape(0)});
            sample_categorical(logits.data(), uniforms.data(), logits.shape(0), logits.shape(1),
                               actions.data());
            return actions;
        },
        "logits"_a, "uniforms"_a, "Indices drawn from a categorical policy.");
    m.def(
        "categorical_log_probs",
        [](In<float, 2> logits, In<int64_t, 1> actions) {
            require(actions.shape(0) == logits.shape(0), "Each row of logits needs one action.");
            for (size_t i = 0; i < actions.shape(0); ++i) {
                require(actions(i) >= 0 && static_cast<size_t>(actions(i)) < logits.shape(1),
                        "An action is not one of the policy's.");
            }
            auto log_probs = new_array<float, 1>({logits.shape(0)});
            categorical_log_probs(logits.data(), actions.data(), logits.shape(0), logits.shape(1),
                                  log_probs.data());
            return log_probs;
        },
        "logits"_a, "actions"_a, "Log-probability of each action.");
    m.def(
        "sample_gaussian",
        [](In<float, 2> outputs, In<double, 2> normals) {
            const size_t rows = outputs.shape(0), num_actions = normals.shape(1);
            require(outputs.shape(1) == 2 * num_actions && normals.shape(0) == rows,
                    "Sampling needs one normal number for each mean.");
            auto actions = new_array<float, 2>({rows, num_actions});
            sample_gaussian(outputs.data(), normals.data(), rows, num_actions, actions.data());
            return actions;
        },
        "outputs"_a, "normals"_a, "Actions drawn from a Gaussian policy, not clipped.");
    m.def(
        "gaussian_log_probs",
        [](In<float, 2> outputs, In<float, 2> actions) {
            const size_t rows = outputs.shape(0), num_actions = actions.shape(1);
            require(outputs.shape(1) == 2 * num_actions && actions.shape(0) == rows,
                    "Each mean needs one action.");
            auto log_probs = new_array<float, 1>({rows});
            gaussian_log_probs(outputs.data(), actions.data(), rows, num_actions, log_probs.data());
            return log_probs;
        },
        "outputs"_a, "actions"_a, "Log-density of each action.");
    m.def(
        "standard_normals",
        [](In<double, 1> uniforms) {
            require(uniforms.shape(0) % 2 == 0, "Normal numbers are made in pairs.");
            auto normals = new_array<double, 1>({uniforms.shape(0)});
            standard_normals(uniforms.data(), uniforms.shape(0) / 2, normals.data());
            return normals;
        },
        "uniforms"_a, "Standard normal numbers from as many uniform ones in [0, 1).");
    m.def(
        "moments",
        [](In<float, 1> values) {
            require(values.shape(0) > 0, "No numbers have no mean.");
            const Moments moments = moments_of(values.data(), values.shape(0));
            return std::make_tuple(moments.mean, moments.spread);
        },
        "values"_a, "Mean and standard deviation, summed up from first to last.");

    m.def(
        "orthonormalize",
        [](nb::ndarray<double, nb::ndim<2>, nb::c_contig, nb::device::cpu> vectors) {
            require(vectors.shape(0) <= vectors.shape(1), "There are more vectors than dimensions.");
            double* data = vectors.data();
            const size_t count = vectors.shape(0), length = vectors.shape(1);
            nb::gil_scoped_release release;
            RC_DISPATCH(orthonormalize, data, count, length);
        },
        "vectors"_a, "Make the rows orthonormal in place, each from itself and those before it.");
}

}  // namespace racecraft
