from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from late_torch import TorchLearner
from scheduled_world import ScheduledWorld, ticking
from stripe_world import StripeWorld

from racecraft.errors import CheckpointError, ConfigError, TrainingError
from racecraft.learn import PPO, NetworkSpec, PPOConfig, make_learner


def ppo_for(config: PPOConfig, *, seed: int = 0, spec: NetworkSpec | None = None, **world) -> PPO:
    learner = TorchLearner(spec or NetworkSpec(num_actions=3, state_size=2), seed=seed, num_threads=2)
    return PPO(config, learner, StripeWorld(config.num_envs, seed=seed, **world), seed=seed)


def assert_equal(weights: dict[str, np.ndarray], others: dict[str, np.ndarray]) -> None:
    assert weights.keys() == others.keys()
    for name, array in weights.items():
        np.testing.assert_array_equal(array, others[name], err_msg=name)


def assert_same_weights(a: PPO, b: PPO) -> None:
    assert_equal(a.learner.weights(), b.learner.weights())
    assert_equal(dict(a.driving_weights), dict(b.driving_weights))


@pytest.mark.costly
@pytest.mark.parametrize("backend", ["native", "torch"])
@pytest.mark.parametrize("is_discrete", [True, False])
def test_learns_to_centre_the_stripe(is_discrete, backend):
    config = PPOConfig(num_envs=32, num_steps=16, minibatch_size=128, update_epochs=4, learning_rate=1e-3, ent_coef=0.0)
    spec = NetworkSpec(num_actions=3 if is_discrete else 1, is_discrete=is_discrete, state_size=2)
    learner = make_learner(spec, num_threads=2, backend=backend)
    ppo = PPO(config, learner, StripeWorld(config.num_envs))
    rewards = []
    for _ in range(12):
        ppo.iterate()
        rewards.append(ppo.column("rewards").mean())
    assert np.mean(rewards[:2]) < 0.65
    assert np.mean(rewards[-3:]) > 0.78


@pytest.mark.costly
def test_learns_from_rewards_of_any_scale():
    class LoudWorld(StripeWorld):
        def step(self, actions):
            rewards, terminated, truncated = super().step(actions)
            return 1e4 * rewards - 3e4, terminated, truncated

    config = PPOConfig(num_envs=32, num_steps=16, minibatch_size=128, update_epochs=4, learning_rate=1e-3)
    learner = TorchLearner(NetworkSpec(num_actions=3, state_size=2), num_threads=2)
    ppo = PPO(config, learner, LoudWorld(32), seed=0)
    stats = [ppo.iterate() for _ in range(12)]
    assert stats[-1].losses.value_loss < 10
    assert stats[-1].explained_variance > 0.5


@pytest.mark.costly
def test_the_step_size_falls_with_the_steps_driven(config):
    config = dataclasses.replace(config, rate_steps=2 * config.num_envs * config.num_steps)
    ppo = ppo_for(config)
    rates: list[float] = []
    update = ppo.learner.update
    ppo.learner.update = lambda minibatch, objective: (
        rates.append(objective.learning_rate),
        update(minibatch, objective),
    )[1]
    for _ in range(3):
        ppo.iterate()
    expected = [config.learning_rate / (1 + done / 2) for done in (1, 2, 3)]
    assert list(dict.fromkeys(rates)) == pytest.approx(expected)


def test_the_same_seed_gives_the_same_bits(config):
    first, second, other = (ppo_for(config, seed=seed) for seed in (3, 3, 4))
    for ppo in (first, second, other):
        for _ in range(3):
            ppo.iterate()
    assert_same_weights(first, second)
    assert not np.array_equal(
        first.learner.weights()["policy.head.weight"], other.learner.weights()["policy.head.weight"]
    )


def test_saved_and_loaded_training_continues_to_the_bit(config):
    straight, resumed = ppo_for(config, seed=3, time_limit=5), ppo_for(config, seed=8, time_limit=5)
    straight.prefers_average = resumed.prefers_average = True
    for _ in range(2):
        straight.iterate()
    resumed.load_state({name: array.copy() for name, array in straight.state().items()})
    world = straight.environment
    resumed.environment._offset, resumed.environment._age = world._offset.copy(), world._age.copy()
    resumed.environment._rng.bit_generator.state = world._rng.bit_generator.state
    a, b = straight.iterate(), resumed.iterate()
    clocks = dict.fromkeys(("environment_seconds", "policy_seconds", "update_seconds"), 0.0)
    assert dataclasses.replace(a, **clocks) == dataclasses.replace(b, **clocks)
    assert_same_weights(straight, resumed)


@pytest.mark.parametrize(
    "missing",
    [
        "ppo/counters",
        "weights/policy.head.bias",
        "learning/policy.head.bias",
        "average/policy.head.bias",
        "optimizer/step",
    ],
)
def test_damaged_state_is_refused(config, missing):
    ppo = ppo_for(config)
    ppo.iterate()
    state = ppo.state()
    del state[missing]
    with pytest.raises(CheckpointError):
        ppo.load_state(state)


def test_state_of_another_number_of_cars_is_refused(config):
    state = ppo_for(dataclasses.replace(config, num_envs=8)).state()
    with pytest.raises(CheckpointError, match="8 cars"):
        ppo_for(config).load_state(state)


def test_what_drives_is_the_mean_of_the_weights_once_that_is_preferred(config):
    ppo = ppo_for(dataclasses.replace(config, average_share=0.5))
    mean: dict[str, np.ndarray] = {}
    for iteration in range(1, 6):
        ppo.iterate()
        for name, array in ppo.learner.weights().items():
            part = 1 / (1 + 0.5 * (iteration - 1))
            mean[name] = array if iteration == 1 else mean[name] + part * (array.astype(float) - mean[name])
    own = ppo.learner.weights()
    with ppo.driving():
        assert_equal(ppo.learner.weights(), own)
    ppo.prefers_average = True
    with ppo.driving():
        inside = ppo.learner.weights()
    for name, array in mean.items():
        np.testing.assert_allclose(inside[name], array, atol=1e-6)
    assert_equal(ppo.learner.weights(), own)
    assert_equal({key.removeprefix("weights/"): a for key, a in ppo.state().items() if "weights/" in key}, inside)


def test_without_averaging_the_last_weights_drive(config):
    ppo = ppo_for(dataclasses.replace(config, average_share=0.0))
    ppo.prefers_average = True
    ppo.iterate()
    own = ppo.learner.weights()
    with ppo.driving():
        assert_equal(ppo.learner.weights(), own)
    assert not any(name.startswith(("average/", "learning/")) for name in ppo.state())


def test_learning_rate_zero_leaves_the_weights(config):
    ppo = ppo_for(dataclasses.replace(config, learning_rate=0.0))
    before = ppo.learner.weights()
    ppo.iterate()
    for name, array in ppo.learner.weights().items():
        np.testing.assert_array_equal(array, before[name])


def test_truncated_steps_bootstrap_the_last_frame_before_the_reset(config):
    ppo = ppo_for(dataclasses.replace(config, num_steps=9), time_limit=5)
    seen = []
    reset = ppo.environment.reset

    def spy(mask):
        _, states = ppo.environment.observe()
        seen.append((len(ppo.column("rewards")) - 1, mask.copy(), states.copy()))
        reset(mask)

    ppo.environment.reset = spy
    ppo.learner.values = lambda observations, states: states[:, 0] + 100.0  # a critic that repeats the offset
    ppo.iterate()
    terminated, truncated, next_values = (ppo.column(name) for name in ("terminated", "truncated", "next_values"))
    assert truncated[4].any()
    for row, mask, states in seen:
        for car in np.flatnonzero(mask & truncated[row]):
            assert next_values[row, car] == np.float32(states[car, 0] + 100)
    alive = ~truncated[8] & ~terminated[8]
    _, states = ppo.environment.observe()
    np.testing.assert_array_equal(next_values[8, alive], states[alive, 0] + 100)
    assert (next_values[terminated] == 0).all()


def test_whole_episodes_are_shared_between_the_cars(config):
    config = dataclasses.replace(config, num_envs=4, episodes_per_iteration=6, minibatch_size=16)
    ppo = ppo_for(config, time_limit=7)
    for _ in range(2):
        stats = ppo.iterate()
        is_valid = ppo.column("is_valid")
        ends = (ppo.column("terminated") | ppo.column("truncated")) & is_valid
        assert stats.episodes == 6
        assert ends.sum(0).tolist() == [2, 2, 1, 1]
        assert stats.num_steps == is_valid.sum()
        for car in range(4):  # nothing counts after a car's last episode
            assert ends[np.flatnonzero(is_valid[:, car]).max(), car]


def scheduled(config: PPOConfig, world: ScheduledWorld) -> PPO:
    spec = NetworkSpec(num_actions=3, state_size=2)
    return PPO(dataclasses.replace(config, num_envs=world.num_envs), TorchLearner(spec, num_threads=1), world)


def test_returns_and_lengths_are_those_of_the_episodes_that_ended(config):
    world = ScheduledWorld([[3, 4], [6, 9]], [1.0, 0.5])  # by turns; a rollout is 8 steps
    ppo = scheduled(dataclasses.replace(config, minibatch_size=8), world)
    world.reset(np.ones(2, bool))
    first, second = ppo.iterate(), ppo.iterate()
    # car 0 ends after steps 3, 7, 10, 14, car 1 after steps 6, 15: episodes go on from one rollout into the next
    assert (first.episodes, first.mean_return, first.mean_length) == (3, (3 + 4 + 3) / 3, (3 + 4 + 6) / 3)
    assert (second.episodes, second.mean_return, second.mean_length) == (3, (3 + 4 + 4.5) / 3, (3 + 4 + 9) / 3)
    assert (first.total_steps, second.total_steps, second.num_steps) == (16, 32, 16)


def test_the_seconds_of_an_iteration_are_its_own(config, monkeypatch):
    world = ScheduledWorld([[3, 4], [6, 9]], [1.0, 0.5])
    world.reset(np.ones(2, bool))
    ppo = scheduled(dataclasses.replace(config, minibatch_size=8), world)
    monkeypatch.setattr("racecraft.learn.ppo.time.perf_counter", ticking())
    for _ in range(2):  # 8 steps of a second each of policy and environment, and an update
        stats = ppo.iterate()
        assert (stats.policy_seconds, stats.environment_seconds, stats.update_seconds) == (8.0, 8.0, 1.0)


def test_values_are_in_units_of_reward(config):
    ppo = ppo_for(dataclasses.replace(config, learning_rate=0.0))
    ppo.return_scale = np.array([5.0, 2.0])
    ppo.iterate()
    observations = ppo.column("observations").reshape(-1, *ppo.learner.observation_shape)
    states = ppo.column("states").reshape(len(observations), 2)
    expected = 2.0 * ppo.learner.values(observations, states) + 5.0
    np.testing.assert_allclose(ppo.column("values").ravel(), expected, rtol=1e-6)
    assert np.ptp(expected) > 0
    assert ppo.spec == ppo.learner.spec


def test_where_no_episode_ended_there_is_no_mean(config):
    world = ScheduledWorld([[100], [100]], [1.0, 1.0])
    stats = scheduled(dataclasses.replace(config, minibatch_size=8), world).iterate()
    assert stats.episodes == 0
    assert np.isnan([stats.mean_return, stats.mean_length]).all()


def test_cars_without_episodes_left_wait_unpaid_at_no_cost_and_do_not_begin_again(config):
    world = ScheduledWorld([[5], [2, 25]], [1.0, 2.0])
    config = dataclasses.replace(config, episodes_per_iteration=3, max_steps_per_iteration=60, minibatch_size=8)
    ppo = scheduled(config, world)
    for iteration in (1, 2):  # car 0 owes two episodes, car 1 one: of 2 steps, then of 25
        stats = ppo.iterate()
        begun = 2 * iteration, iteration
        assert tuple(world.begun) == begun
        assert stats.episodes == 3
    assert (stats.num_steps, stats.total_steps) == (10 + 25, 10 + 2 + 35)
    assert stats.mean_return == (5 + 5 + 50) / 3
    assert stats.mean_length == (5 + 5 + 25) / 3
    assert len(ppo.column("rewards")) == 25


def test_only_the_steps_of_driving_cars_use_up_an_iteration(config):
    world = ScheduledWorld([[50], [50], [50]], [1.0, 1.0, 1.0])
    config = dataclasses.replace(config, episodes_per_iteration=2, max_steps_per_iteration=20, minibatch_size=8)
    ppo = scheduled(config, world)
    stats = ppo.iterate()
    assert len(ppo.column("rewards")) == 10  # of two cars; the third one waits
    assert (stats.num_steps, stats.total_steps, stats.episodes) == (20, 20, 0)


def test_what_a_cut_iteration_left_unfinished_is_not_counted_in_the_next(config):
    world = ScheduledWorld([[8], [8]], [1.0, 1.0])
    config = dataclasses.replace(config, episodes_per_iteration=2, max_steps_per_iteration=10, minibatch_size=4)
    ppo = scheduled(config, world)
    assert ppo.iterate().episodes == 0
    longer = scheduled(dataclasses.replace(config, max_steps_per_iteration=16), world)
    longer.load_state(ppo.state())
    stats = longer.iterate()
    assert (stats.episodes, stats.mean_return, stats.mean_length) == (2, 8, 8)


def test_the_critics_unit_is_the_first_rollouts_and_then_follows_slowly(config):
    ppo = ppo_for(dataclasses.replace(config, gamma=0.0, learning_rate=0.0))  # returns are the rewards
    ppo.iterate()
    first = ppo.column("rewards")
    np.testing.assert_allclose(ppo.return_scale, [first.mean(), first.std()], rtol=1e-5)
    ppo.iterate()
    second = ppo.column("rewards")
    expected = 0.9 * np.array([first.mean(), first.std()]) + 0.1 * np.array([second.mean(), second.std()])
    np.testing.assert_allclose(ppo.return_scale, expected, rtol=1e-5)


def test_without_normalization_the_critics_unit_is_the_rewards(config):
    ppo = ppo_for(dataclasses.replace(config, normalize_returns=False))
    ppo.iterate()
    assert ppo.return_scale.tolist() == [0.0, 1.0]


def test_fewer_episodes_than_cars(config):
    ppo = ppo_for(dataclasses.replace(config, episodes_per_iteration=3, minibatch_size=8), time_limit=6)
    stats = ppo.iterate()
    assert stats.episodes == 3
    assert not ppo.column("is_valid")[:, 3:].any()


def test_whole_episodes_stop_at_the_limit_of_steps(config):
    config = dataclasses.replace(config, num_envs=4, episodes_per_iteration=4, max_steps_per_iteration=50)
    ppo = ppo_for(config, time_limit=10**6)
    stats = ppo.iterate()
    assert 50 <= stats.num_steps < 54
    alive = ppo.column("is_valid")[-1] & ~ppo.column("terminated")[-1]
    assert (ppo.column("next_values")[-1, alive] != 0).all()


def test_an_iteration_smaller_than_a_minibatch_still_learns(config):
    config = dataclasses.replace(config, episodes_per_iteration=1, minibatch_size=512)
    ppo = ppo_for(config, time_limit=3)
    before = ppo.learner.weights()["policy.head.bias"]
    ppo.iterate()
    assert not np.array_equal(before, ppo.learner.weights()["policy.head.bias"])


def test_a_partial_minibatch_is_dropped(config):
    ppo = ppo_for(dataclasses.replace(config, minibatch_size=50, update_epochs=3))
    sizes = []
    update = ppo.learner.update
    ppo.learner.update = lambda minibatch, objective: (
        sizes.append(len(minibatch.rows)),
        update(minibatch, objective),
    )[1]
    ppo.iterate()
    assert sizes == [50] * 6  # 128 samples: two of 50 in each of three passes


def test_advantages_are_normalized_over_the_rollout(config):
    ppo = ppo_for(dataclasses.replace(config, update_epochs=1))
    seen = []
    update = ppo.learner.update
    ppo.learner.update = lambda minibatch, objective: (
        seen.append(minibatch.advantages[minibatch.rows]),
        update(minibatch, objective),
    )[1]
    ppo.iterate()
    everything = np.concatenate(seen)
    assert everything.mean() == pytest.approx(0, abs=1e-5)
    assert everything.std() == pytest.approx(1, abs=1e-4)


@pytest.mark.costly
def test_e_greedy_falls_from_all_random_to_its_end(config):
    config = dataclasses.replace(
        config,
        num_envs=200,
        num_steps=2,
        exploration="e-greedy",
        epsilon_steps=1600,
        epsilon_end=0.1,
        learning_rate=0.0,
    )
    ppo = ppo_for(config)
    shares = []
    for _ in range(7):
        ppo.iterate()
        outputs = ppo.learner.policy(ppo.column("observations").reshape(-1, *ppo.learner.observation_shape))
        shares.append((ppo.column("actions").ravel() == outputs.argmax(1)).mean())
    assert shares[0] == pytest.approx(1 / 3 + 0.1 * 2 / 3, abs=0.12)  # epsilon about 0.9 in the first iteration
    assert shares[-1] == pytest.approx(0.9 + 0.1 / 3, abs=0.04)


def test_nan_reward_stops_training_and_keeps_the_weights(config):
    class BrokenWorld(StripeWorld):
        def step(self, actions):
            rewards, terminated, truncated = super().step(actions)
            return np.where(np.arange(len(rewards)) == 3, np.nan, rewards), terminated, truncated

    learner = TorchLearner(NetworkSpec(num_actions=3, state_size=2))
    ppo = PPO(config, learner, BrokenWorld(config.num_envs))
    before = learner.weights()
    with pytest.raises(TrainingError, match="iteration 1"):
        ppo.iterate()
    for name, array in learner.weights().items():
        np.testing.assert_array_equal(array, before[name])


def test_continuous_commands_stay_within_bounds(config):
    commands = []

    class Recorder(StripeWorld):
        def step(self, actions):
            commands.append(actions.copy())
            return super().step(actions)

    learner = TorchLearner(NetworkSpec(num_actions=1, is_discrete=False, state_size=2))
    ppo = PPO(config, learner, Recorder(config.num_envs))
    ppo.iterate()
    assert abs(np.concatenate(commands)).max() == 1.0
    assert abs(ppo.column("actions")).max() > 1.0  # the density is that of the unclipped action


def test_without_a_seed_it_is_that_of_seed_0(config):
    seeded = ppo_for(config)
    plain = ppo_for(config)
    plain = PPO(config, plain.learner, plain.environment)
    seeded.iterate()
    plain.iterate()
    assert_same_weights(seeded, plain)


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("num_envs", 0),
        ("gamma", 1.1),
        ("gamma", float("nan")),
        ("learning_rate", float("inf")),
        ("learning_rate", -1e-4),
        ("clip_coef", 0.0),
        ("clip_coef", 1.0),
        ("value_loss", "mae"),
        ("exploration", "boltzmann"),
        ("update_epochs", 0),
        ("epsilon_end", -0.1),
        ("max_grad_norm", -1.0),
        ("max_grad_norm", float("inf")),
        ("num_envs", 64.0),
        ("num_steps", 7.5),
        ("minibatch_size", True),
        ("update_epochs", "3"),
        ("episodes_per_iteration", 0.5),
        ("epsilon_steps", -1),
        ("gamma", "0.9"),
        ("clip_coef", None),
        ("average_share", 1.5),
        ("num_steps", 10**9 + 1),
    ],
)
def test_impossible_settings_name_themselves(field, value):
    with pytest.raises(ConfigError, match=f"^{field} is"):
        PPOConfig(**{field: value})


def test_the_largest_settings_there_may_be():
    assert PPOConfig(num_steps=10**9, gamma=1.0, gae_lambda=0.0, average_share=1.0).num_steps == 10**9


def test_settings_must_fit_environment_and_learner(config, learner):
    with pytest.raises(ConfigError, match="num_envs"):
        PPO(config, learner, StripeWorld(4))
    with pytest.raises(ConfigError, match="minibatch_size"):
        PPO(dataclasses.replace(config, minibatch_size=129), learner, StripeWorld(16))
    continuous = TorchLearner(NetworkSpec(num_actions=1, is_discrete=False))
    with pytest.raises(ConfigError, match="exploration"):
        PPO(dataclasses.replace(config, exploration="e-greedy"), continuous, StripeWorld(16))
