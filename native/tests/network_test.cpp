// The learner against a slow reference in double: outputs, and gradients by finite differences, for networks
// of odd sizes; the same bits for any number of threads and every instruction set. Run under ASan, UBSan and
// TSan as well.
#include <algorithm>
#include <bit>
#include <functional>
#include <random>
#include <stdexcept>
#include <utility>

#include "../src/learner.hpp"
#include "../src/network_math.hpp"
#include "check.hpp"

namespace racecraft {
namespace {

using Values = std::vector<double>;

// One minibatch with what it points to.
struct Samples {
    std::vector<uint8_t> observations;
    std::vector<float> states, actions, log_probs, advantages, returns;
    std::vector<int64_t> indices;
    size_t size;

    Samples(const NetworkSpec& spec, size_t count, unsigned seed) : size(count) {
        std::mt19937 rng(seed);
        const auto number = [&] { return static_cast<float>(rng() >> 8) * (2.0f / 16777216.0f) - 1.0f; };
        const auto fill = [&](std::vector<float>& values, size_t length) {
            values.resize(length);
            for (float& value : values) value = number();
        };
        observations.resize(size * spec.observation_size());
        for (uint8_t& byte : observations) byte = static_cast<uint8_t>(rng() >> 24);
        fill(states, size * static_cast<size_t>(spec.state_size));
        fill(actions, size * static_cast<size_t>(spec.num_actions));
        fill(advantages, size);
        fill(returns, size);
        for (float& value : returns) value *= 3.0f;  // both sides of Huber's corner
        log_probs.assign(size, spec.is_discrete ? -1.2f : -2.0f);
        for (float& value : log_probs) value += 0.4f * number();
        for (size_t i = 0; i < size; ++i) indices.push_back(rng() % static_cast<unsigned>(spec.num_actions));
    }

    Minibatch minibatch() const {
        return {size,           nullptr,          observations.data(), states.data(), indices.data(),
                actions.data(), log_probs.data(), advantages.data(),   returns.data()};
    }
};

std::vector<float> random_parameters(size_t count, unsigned seed) {
    std::mt19937 rng(seed);
    std::vector<float> values(count);
    for (float& value : values) value = (static_cast<float>(rng() >> 8) * (2.0f / 16777216.0f) - 1.0f) * 0.5f;
    return values;
}

// A tower of the network as it is published, one number after the other.
Values reference_tower(const Tower& tower, const NetworkSpec& spec, const double*& p, Values x,
                       const Values& lidar, bool is_camera) {
    int height = spec.rows(), width = spec.columns(), channels = spec.channels();
    if (is_camera && spec.block > 1) {  // unfold the blocks of pixels again
        const int block = spec.block, lenses = spec.lenses;
        Values image(x.size());
        for (int row = 0; row < height; ++row) {
            for (int column = 0; column < width; ++column) {
                for (int c = 0; c < channels; ++c) {
                    const int lens = c / (block * block), pixel = c % (block * block);
                    const int y = row * block + pixel / block, at = column * block + pixel % block;
                    image[(y * width * block + at) * lenses + lens] =
                        x[(row * width + column) * channels + c];
                }
            }
        }
        x = image;
        height *= block;
        width *= block;
        channels = lenses;
    }
    Values camera;
    const size_t num_convs = is_camera ? spec.convs.size() : 0;
    for (size_t l = 0; l < tower.layers.size(); ++l) {
        const Layer& layer = tower.layers[l];
        const int outputs = layer.num_outputs;
        Values y;
        if (layer.source == Source::lidar) camera = std::exchange(x, lidar);
        if (layer.is_join()) {
            camera.insert(camera.end(), x.begin(), x.end());
            x = camera;
            continue;
        }
        if (l < num_convs) {
            const int kernel = spec.convs[l].kernel, stride = spec.convs[l].stride;
            const int rows = (height - kernel) / stride + 1, columns = (width - kernel) / stride + 1;
            const double* bias = p + outputs * channels * kernel * kernel;
            for (int row = 0; row < rows; ++row) {
                for (int column = 0; column < columns; ++column) {
                    for (int out = 0; out < outputs; ++out) {
                        double sum = bias[out];
                        for (int c = 0; c < channels; ++c) {
                            for (int ky = 0; ky < kernel; ++ky) {
                                for (int kx = 0; kx < kernel; ++kx) {
                                    const int from = (row * stride + ky) * width + column * stride + kx;
                                    sum += x[from * channels + c] *
                                           p[((out * channels + c) * kernel + ky) * kernel + kx];
                                }
                            }
                        }
                        y.push_back(sum);
                    }
                }
            }
            p = bias + outputs;
            height = rows;
            width = columns;
            channels = outputs;
        } else {
            const double* bias = p + outputs * x.size();
            for (int out = 0; out < outputs; ++out) {
                double sum = bias[out];
                for (size_t i = 0; i < x.size(); ++i)
                    sum += x[i] * p[static_cast<size_t>(out) * x.size() + i];
                y.push_back(sum);
            }
            p = bias + outputs;
        }
        for (double& value : y) {
            if (layer.activation == Activation::relu) value = std::max(value, 0.0);
            if (layer.activation == Activation::tanh) value = std::tanh(value);
        }
        x = y;
    }
    return x;
}

struct Outputs {
    Values policy;
    double value;
};

Outputs reference_outputs(const Network& network, const Values& parameters, const Samples& samples,
                          size_t row) {
    const NetworkSpec& spec = network.spec;
    const double* p = parameters.data();
    const uint8_t* bytes = samples.observations.data() + row * spec.observation_size();
    Values image, lidar;
    for (size_t i = 0; i < spec.observation_size(); ++i) {
        (i < spec.image_size() ? image : lidar).push_back(bytes[i] / 255.0);
    }
    const size_t columns = static_cast<size_t>(spec.state_size);
    const float* floats = samples.states.data() + row * columns;
    const Values state(floats, floats + columns);
    const bool is_blind = !spec.policy_units.empty();
    Outputs outputs{reference_tower(network.policy, spec, p, is_blind ? state : image, lidar, !is_blind),
                    0.0};
    if (!spec.is_discrete) {
        outputs.policy.insert(outputs.policy.end(), p, p + spec.num_actions);
        p += spec.num_actions;
    }
    const Values critic_input = columns > 0 ? state : image;
    outputs.value = reference_tower(network.critic, spec, p, critic_input, lidar, columns == 0)[0];
    return outputs;
}

double reference_loss(const Network& network, const Values& parameters, const Samples& samples,
                      const Objective& objective) {
    const size_t num_actions = static_cast<size_t>(network.spec.num_actions);
    double total = 0.0;
    for (size_t row = 0; row < samples.size; ++row) {
        const auto [policy, value] = reference_outputs(network, parameters, samples, row);
        double log_prob = 0.0, entropy = 0.0;
        if (network.spec.is_discrete) {
            double sum = 0.0;
            for (const double logit : policy) sum += std::exp(logit);
            for (const double logit : policy) entropy -= std::exp(logit) / sum * (logit - std::log(sum));
            log_prob = policy[static_cast<size_t>(samples.indices[row])] - std::log(sum);
        } else {
            for (size_t i = 0; i < num_actions; ++i) {
                const double log_std = policy[num_actions + i];
                const double z = (samples.actions[row * num_actions + i] - policy[i]) / std::exp(log_std);
                log_prob += -0.5 * z * z - log_std - 0.9189385332046727;
                entropy += log_std + 1.4189385332046727;
            }
        }
        const double ratio = std::exp(log_prob - samples.log_probs[row]), advantage = samples.advantages[row];
        const double clipped = std::clamp(ratio, 1.0 - objective.clip_coef, 1.0 + objective.clip_coef);
        const double error = std::abs(value - samples.returns[row]);
        const double value_loss = objective.is_huber && error > 1.0 ? error - 0.5 : 0.5 * error * error;
        total += std::max(-advantage * ratio, -advantage * clipped) + objective.vf_coef * value_loss -
                 objective.ent_coef * entropy;
    }
    return total / static_cast<double>(samples.size);
}

constexpr Objective kObjective{0.0, 0.2, 0.05, 0.5, true, 0.0, 1e-5};

// Small, and no size a multiple of anything.
std::vector<NetworkSpec> odd_networks() {
    return {
        // height, width, pool, block, convs, dense, actions, discrete, state, critic
        {24, 40, 2, 4, {{5, 8, 4}, {3, 2, 1}}, {7}, 3, true, 5, {6, 3}},
        {20, 12, 1, 4, {{17, 8, 4}, {2, 2, 2}}, {}, 2, false, 0, {}},
        {9, 11, 1, 1, {{3, 3, 2}, {33, 2, 1}, {4, 2, 2}}, {9, 5}, 1, false, 1, {}},
        {7, 7, 1, 1, {{18, 7, 3}}, {34}, 19, true, 0, {}},  // a kernel as large as the image
        {6, 13, 1, 1, {{2, 3, 3}, {1, 1, 2}}, {1}, 2, true, 35, {33}},
        {20, 24, 1, 4, {{3, 8, 4}, {17, 1, 1}, {5, 1, 1}}, {6}, 3, true, 0, {}, 0, 1, 4, {3}},  // kernels of
                                                                                                // one pixel
        {26, 16, 2, 4, {{6, 4, 4}}, {5}, 3, true, 2, {4}, 10},                  // its upper rows are not seen
        {12, 16, 1, 4, {{5, 8, 4}}, {7, 6}, 3, true, 5, {6}, 0, 2, 9, {5, 3}},  // two lenses and a LIDAR
        {9, 11, 1, 1, {{3, 3, 2}, {4, 2, 1}}, {}, 2, false, 0, {}, 0, 2, 4, {18}},  // the head joins them
        {8, 8, 2, 1, {{3, 3, 1}}, {35}, 2, true, 0, {}, 0, 1, 33, {2}},
        {0, 0, 1, 1, {}, {}, 3, true, 17, {33, 5}, 0, 1, 0, {}, {34, 7}},  // teachers, which see the state
        {0, 0, 1, 1, {}, {}, 2, false, 5, {16}, 0, 1, 0, {}, {64, 64, 3}},
    };
}

// The bits of everything a learner holds and says after two steps.
std::vector<float> after_two_steps(const NetworkSpec& spec, int num_threads) {
    Learner learner(spec, num_threads);
    learner.write(Learner::Part::weights, random_parameters(learner.network().num_public, 1).data());
    const Objective objective{1e-2, 0.2, 0.05, 0.5, false, 0.1, 1e-5};
    for (const unsigned seed : {2u, 3u}) {
        const Samples samples(spec, 70 + seed, seed);
        learner.update(samples.minibatch(), objective);
    }
    std::vector<float> bits(learner.network().num_public);
    learner.read(Learner::Part::weights, bits.data());
    const Samples samples(spec, 21, 4);
    std::vector<float> outputs(21 * spec.policy_size()), values(21);
    learner.policy(samples.observations.data(), samples.states.data(), 21, outputs.data());
    learner.values(samples.observations.data(), samples.states.data(), 21, values.data());
    bits.insert(bits.end(), outputs.begin(), outputs.end());
    bits.insert(bits.end(), values.begin(), values.end());
    return bits;
}

bool same_floats(const std::vector<float>& a, const std::vector<float>& b) {
    return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(float)) == 0;
}

}  // namespace

TEST(exp_log_and_tanh_are_accurate) {
    for (double x = -80.0; x < 80.0; x += 0.0137) {
        CHECK_NEAR(exp_of(x) / std::exp(x), 1.0, 1e-14);
        CHECK_NEAR(log_of(std::exp(x)), x, 1e-14 * (1.0 + std::abs(x)));
        const float t = static_cast<float>(x) * 0.1f;
        CHECK_NEAR(tanh_of(t) / std::tanh(static_cast<double>(t)), 1.0, 4e-7);
    }
    CHECK_EQUAL(exp_of(0.0), 1.0);
    CHECK_EQUAL(log_of(1.0), 0.0);
    CHECK_EQUAL(tanh_of(100.0f), 1.0f);
    CHECK_EQUAL(tanh_of(-100.0f), -1.0f);
    CHECK_EQUAL(tanh_of(0.0f), 0.0f);
    const double nan = std::nan("");
    CHECK(std::isnan(exp_of(nan)));
    CHECK(std::isnan(log_of(nan)));
    CHECK(std::isnan(tanh_of(std::nanf(""))));
}

TEST(outputs_agree_with_the_reference) {
    for (const NetworkSpec& spec : odd_networks()) {
        Learner learner(spec, 2);
        const std::vector<float> parameters = random_parameters(learner.network().num_public, 5);
        learner.write(Learner::Part::weights, parameters.data());
        const Values exact(parameters.begin(), parameters.end());
        const Samples samples(spec, 19, 6);
        std::vector<float> policy(19 * spec.policy_size()), values(19);
        learner.policy(samples.observations.data(), samples.states.data(), 19, policy.data());
        learner.values(samples.observations.data(), samples.states.data(), 19, values.data());
        for (size_t row = 0; row < 19; ++row) {
            const Outputs expected = reference_outputs(learner.network(), exact, samples, row);
            for (size_t i = 0; i < spec.policy_size(); ++i) {
                CHECK_NEAR(policy[row * spec.policy_size() + i], expected.policy[i], 1e-5);
            }
            CHECK_NEAR(values[row], expected.value, 1e-5);
        }
    }
}

TEST(gradients_agree_with_finite_differences) {
    for (const NetworkSpec& spec : odd_networks()) {
        for (const size_t size : {size_t{1}, size_t{11}}) {
            Learner learner(spec, 2);
            const size_t count = learner.network().num_public;
            const std::vector<float> parameters = random_parameters(count, 7);
            learner.write(Learner::Part::weights, parameters.data());
            const Samples samples(spec, size, 8);
            const UpdateStats stats = learner.update(samples.minibatch(), kObjective);
            std::vector<float> gradient(count);
            learner.read(Learner::Part::moment1, gradient.data());

            Values exact(parameters.begin(), parameters.end());
            double squares = 0.0;
            for (size_t i = 0; i < count; i += test::kStride * (count > 400 ? 7 : 1)) {
                constexpr double kStep = 1e-6;
                const double before = exact[i];
                exact[i] = before + kStep;
                const double above = reference_loss(learner.network(), exact, samples, kObjective);
                exact[i] = before - kStep;
                const double below = reference_loss(learner.network(), exact, samples, kObjective);
                exact[i] = before;
                const double slope = (above - below) / (2.0 * kStep);
                CHECK_NEAR(gradient[i] * 10.0, slope, 2e-5 * (1.0 + std::abs(slope)));
            }
            for (const float g : gradient) squares += 100.0 * static_cast<double>(g) * static_cast<double>(g);
            CHECK_NEAR(stats.grad_norm / std::sqrt(squares), 1.0, 1e-5);
            const double loss = reference_loss(learner.network(), exact, samples, kObjective);
            CHECK_NEAR(stats.policy_loss + kObjective.vf_coef * stats.value_loss -
                           kObjective.ent_coef * stats.entropy,
                       loss, 1e-5 * (1.0 + std::abs(loss)));
        }
    }
}

TEST(slopes_of_another_loss_reach_the_policy_alone) {
    for (const NetworkSpec& spec : odd_networks()) {
        if (spec.is_blind()) continue;
        constexpr size_t kSize = 11;
        Learner learner(spec, 2);
        const size_t count = learner.network().num_public;
        const std::vector<float> parameters = random_parameters(count, 9);
        learner.write(Learner::Part::weights, parameters.data());
        const Samples samples(spec, kSize, 10);
        Minibatch minibatch{};
        minibatch.size = kSize;
        minibatch.observations = samples.observations.data();
        minibatch.states = samples.states.data();
        minibatch.slopes = samples.actions.data();  // as many numbers of that size
        learner.update(minibatch, kObjective);
        std::vector<float> gradient(count);
        learner.read(Learner::Part::moment1, gradient.data());
        // the loss is linear: the mean over samples of slopes times outputs
        const auto loss = [&](const Values& exact) {
            double sum = 0.0;
            for (size_t row = 0; row < kSize; ++row) {
                const Outputs outputs = reference_outputs(learner.network(), exact, samples, row);
                for (size_t i = 0; i < static_cast<size_t>(spec.num_actions); ++i) {
                    sum +=
                        outputs.policy[i] * static_cast<double>(samples.actions[row * spec.num_actions + i]);
                }
            }
            return sum / kSize;
        };
        Values exact(parameters.begin(), parameters.end());
        const size_t stride = test::kStride * (count > 400 ? 7 : 1);
        for (size_t i = 0; i < count; i += stride) {
            constexpr double kStep = 1e-6;
            const double before = exact[i];
            exact[i] = before + kStep;
            const double above = loss(exact);
            exact[i] = before - kStep;
            const double slope = (above - loss(exact)) / (2.0 * kStep);
            exact[i] = before;
            CHECK_NEAR(gradient[i] * 10.0, slope, 2e-5 * (1.0 + std::abs(slope)));
        }
    }
}

TEST(adam_follows_its_formula) {
    const NetworkSpec spec = odd_networks()[2];
    Learner learner(spec, 2);
    const size_t count = learner.network().num_public;
    learner.write(Learner::Part::weights, random_parameters(count, 1).data());
    std::vector<float> before(count), after(count), m(count), v(count);
    const Objective objective{1e-2, 0.2, 0.05, 0.5, false, 0.1, 1e-5};
    for (int t = 1; t <= 4; ++t) {
        learner.read(Learner::Part::weights, before.data());
        learner.update(Samples(spec, 9, static_cast<unsigned>(t)).minibatch(), objective);
        learner.read(Learner::Part::weights, after.data());
        learner.read(Learner::Part::moment1, m.data());
        learner.read(Learner::Part::moment2, v.data());
        CHECK_EQUAL(learner.num_updates(), t);
        for (size_t i = 0; i < count; ++i) {
            const double scale = std::sqrt(v[i] / (1.0 - std::pow(0.999, t))) + 1e-5;
            CHECK_NEAR(after[i] - before[i], -1e-2 * m[i] / (1.0 - std::pow(0.9, t)) / scale, 1e-7);
        }
    }
}

TEST(parameters_survive_packing) {
    for (const NetworkSpec& spec : odd_networks()) {
        Learner learner(spec, 1);
        const size_t count = learner.network().num_public;
        for (const Learner::Part part :
             {Learner::Part::weights, Learner::Part::moment1, Learner::Part::moment2}) {
            const std::vector<float> written = random_parameters(count, static_cast<unsigned>(part));
            std::vector<float> read(count);
            learner.write(part, written.data());
            learner.read(part, read.data());
            CHECK(same_floats(written, read));
        }
    }
}

TEST(the_same_bits_for_any_number_of_threads) {
    for (const NetworkSpec& spec : odd_networks()) {
        const std::vector<float> expected = after_two_steps(spec, 1);
        for (const int threads : {2, 5}) CHECK(same_floats(after_two_steps(spec, threads), expected));
    }
}

TEST(the_same_bits_on_every_instruction_set) {
    const Isa before = current_isa();
    for (const NetworkSpec& spec : odd_networks()) {
        set_isa("portable");
        const std::vector<float> expected = after_two_steps(spec, 2);
        for (const Isa isa : available_isas()) {
            set_isa(isa_name(isa));
            CHECK(same_floats(after_two_steps(spec, 2), expected));
        }
    }
    set_isa(isa_name(before));
}

// Shaped like the default network: whole panels of inputs, and more positions of eight samples than a list
// holds.
TEST(the_same_bits_with_and_without_products_with_zero) {
    const NetworkSpec spec{40, 48, 1, 4, {{10, 8, 4}, {20, 4, 2}, {32, 2, 1}}, {40}, 3, true, 5, {33}};
    const Isa before = current_isa();
    set_isa("portable");
    const std::vector<float> expected = after_two_steps(spec, 1);
    for (const Isa isa : available_isas()) {
        set_isa(isa_name(isa));
        CHECK(same_floats(after_two_steps(spec, 1), expected));
    }
    set_isa(isa_name(before));
}

// Equal for every compiler, optimisation level and CPU. A change here changes what every training ends in.
constexpr uint64_t kGoldenHash = 11652473390277607315u;

TEST(the_golden_hash_of_learners_on_every_instruction_set) {
    const Isa before = current_isa();
    const std::vector<NetworkSpec> specs = odd_networks();
    for (const Isa isa : available_isas()) {
        set_isa(isa_name(isa));
        uint64_t hash = 14695981039346656037u;  // FNV-1a
        for (size_t i = 0; i < specs.size(); i += 3) {
            for (const float value : after_two_steps(specs[i], 1))
                hash = (hash ^ std::bit_cast<uint32_t>(value)) * 1099511628211u;
        }
        CHECK_EQUAL(hash, kGoldenHash);
    }
    set_isa(isa_name(before));
}

TEST(frames_are_pooled_and_folded) {
    const NetworkSpec spec = odd_networks()[0];
    Learner learner(spec, 1);
    std::vector<uint8_t> frame(24 * 40), out(spec.observation_size());
    for (size_t i = 0; i < frame.size(); ++i) frame[i] = static_cast<uint8_t>(i * 37);
    learner.encode(frame.data(), 1, out.data());
    for (int y = 0; y < 12; ++y) {
        for (int x = 0; x < 20; ++x) {
            const int at = 2 * y * 40 + 2 * x;
            const int mean = (frame[at] + frame[at + 1] + frame[at + 40] + frame[at + 41] + 2) / 4;
            const int channel = y % 4 * 4 + x % 4;
            CHECK_EQUAL(static_cast<int>(out[(y / 4 * 5 + x / 4) * 16 + channel]), mean);
        }
    }
}

TEST(impossible_networks_are_refused) {
    const NetworkSpec good = odd_networks()[0];
    const std::vector<std::function<void(NetworkSpec&)>> faults = {
        [](NetworkSpec& s) { s.height = 0; },
        [](NetworkSpec& s) { s.width = 8000; },
        [](NetworkSpec& s) { s.pool = 3; },
        [](NetworkSpec& s) { s.block = 0; },
        [](NetworkSpec& s) { s.height = 25; },
        [](NetworkSpec& s) { s.num_actions = 0; },
        [](NetworkSpec& s) { s.state_size = -1; },
        [](NetworkSpec& s) { s.dense = {0}; },
        [](NetworkSpec& s) { s.critic_units = {-3}; },
        [](NetworkSpec& s) { s.convs[1].kernel = 9; },
        [](NetworkSpec& s) { s.convs[0].stride = 2; },
        [](NetworkSpec& s) { s.convs[0].filters = 0; },
        [](NetworkSpec& s) { s.convs.clear(); },
        [](NetworkSpec& s) { s.lenses = 3; },
        [](NetworkSpec& s) { s.lidar_size = -1; },
        [](NetworkSpec& s) { s.lidar_size = 4; },  // without a branch
        [](NetworkSpec& s) { s.lidar_units = {0}; },
    };
    Learner accepted(good, 1);
    for (const auto& fault : faults) {
        NetworkSpec spec = good;
        fault(spec);
        CHECK_THROWS(Learner(spec, 1), std::invalid_argument);
    }
}

}  // namespace racecraft
