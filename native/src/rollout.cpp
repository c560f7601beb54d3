#include "rollout.hpp"

#include <algorithm>

namespace racecraft {

void generalized_advantages(const AdvantageColumns& columns, double gamma, double gae_lambda,
                            float* carried) {
    const size_t n = columns.num_envs;
    const float discount = static_cast<float>(gamma), decay = static_cast<float>(gamma * gae_lambda);
    std::fill_n(carried, n, 0.0f);
    for (size_t t = columns.num_steps; t-- > 0;) {
        const bool is_last = t + 1 == columns.num_steps;
        for (size_t car = 0; car < n; ++car) {
            const size_t i = t * n + car;
            const bool is_terminated = columns.terminated[i] != 0, is_truncated = columns.truncated[i] != 0;
            const float following = is_last || is_truncated ? columns.next_values[i] : columns.values[i + n];
            const float delta =
                columns.rewards[i] + discount * (is_terminated ? 0.0f : following) - columns.values[i];
            carried[car] = delta + decay * (is_terminated || is_truncated ? 0.0f : carried[car]);
            columns.advantages[i] = carried[car];
            columns.returns[i] = carried[car] + columns.values[i];
        }
    }
}

}  // namespace racecraft
