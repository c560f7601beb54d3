"""SAC and Stable-Baselines3's algorithms on a toy world: do they learn, resume, and publish what they drive with?"""

from __future__ import annotations

from dataclasses import replace
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from scheduled_world import ticking
from stripe_world import StripeWorld

from racecraft.errors import CheckpointError, ConfigError, TrainingError
from racecraft.learn import SAC, Learner, NetworkSpec, SACConfig, distributions, make_learner
from racecraft.learn.replay_buffer import ReplayBuffer

if TYPE_CHECKING:
    from racecraft.learn.torch_sac import TorchSAC

pytestmark = pytest.mark.skipif(find_spec("torch") is None, reason="torch is not installed")
SPEC = NetworkSpec(num_actions=1, is_discrete=False, state_size=2, is_squashed=True)
CONFIG = SACConfig(
    num_envs=8, num_steps=8, minibatch_size=64, buffer_size=4096, learning_starts=256, updates_per_step=0.5
)


def torch_sac(config: SACConfig = CONFIG, *, spec: NetworkSpec = SPEC, seed: int = 0) -> TorchSAC:
    from racecraft.learn.torch_sac import TorchSAC

    return TorchSAC(spec, config, state_size=spec.state_size, seed=seed, num_threads=1)


def make(config: SACConfig = CONFIG, *, spec: NetworkSpec = SPEC, seed: int = 0) -> SAC:
    backend = torch_sac(config, spec=spec, seed=seed)
    learner = make_learner(spec, num_threads=1)
    return SAC(config, backend, learner, StripeWorld(config.num_envs), seed=seed)


def mean_reward(learner: Learner, *, steps: int = 30) -> float:
    """Of a step that the learner's best actions lead to, in a world of its own."""
    world = StripeWorld(32, seed=9, time_limit=10**6)
    rewards = []
    for _ in range(steps):
        outputs = learner.policy(learner.encode(world.observe()[0]))
        spec = learner.spec
        actions = distributions.most_likely(outputs, is_discrete=spec.is_discrete, is_squashed=spec.is_squashed)
        reward, terminated, _ = world.step(actions)
        rewards.append(reward.mean())
        if terminated.any():
            world.reset(terminated)
    return float(np.mean(rewards[10:]))


@pytest.mark.slow
def test_sac_learns_to_keep_the_stripe_in_the_middle() -> None:
    sac = make()
    with sac.driving():
        before = mean_reward(sac.learner)
    for _ in range(20):
        sac.iterate()
    with sac.driving():
        after = mean_reward(sac.learner)
    assert before < 0.7 < 0.8 < after


@pytest.mark.slow
def test_sac_learns_nothing_without_steps_of_adam() -> None:
    sac = make(replace(CONFIG, learning_rate=0.0))
    for _ in range(24):
        sac.iterate()
    with sac.driving():
        assert mean_reward(sac.learner) < 0.7


@pytest.mark.costly
def test_the_same_seed_gives_the_same_weights_and_a_resumed_run_has_them() -> None:
    config = replace(CONFIG, learning_starts=64)
    first, second = make(config), make(config)
    for _ in range(3):
        stats = first.iterate()
        second.iterate()
    assert stats.total_steps == first.total_steps == 192
    state = first.state()
    for name, array in second.state().items():
        np.testing.assert_array_equal(array, state[name], err_msg=name)
    third = make(config, seed=7)
    third.load_state(state)
    for name, array in third.state().items():
        np.testing.assert_array_equal(array, state[name], err_msg=name)
    third.iterate()
    with pytest.raises(CheckpointError, match="no entry"):
        third.load_state({})
    with pytest.raises(CheckpointError, match="of 4 cars"):
        third.load_state({**state, "sac/returns": np.zeros((3, 4))})
    with pytest.raises(CheckpointError, match=r"actor/policy\.conv1"):
        third.load_state({n: a for n, a in state.items() if "conv1" not in n})


@pytest.mark.costly
def test_what_drives_is_the_actors_mean_squashed() -> None:
    sac = make()
    frames = StripeWorld(8).observe()[0]
    observations = sac.learner.encode(frames)
    with sac.driving():
        outputs = sac.learner.policy(observations)
    driven = distributions.most_likely(outputs, is_discrete=False, is_squashed=True)
    still = sac.backend.act(observations, np.zeros((8, 1)))
    np.testing.assert_allclose(driven, still, atol=1e-5)
    assert np.abs(driven).max() <= 1


def test_the_log_density_is_that_of_the_squashed_gaussian() -> None:
    """Against the density's definition, by a slow sum: it integrates to one over (-1, 1)."""
    import torch

    backend = torch_sac()
    observation = torch.zeros((1, *make_learner(SPEC).observation_shape), dtype=torch.uint8)
    noise = torch.linspace(-6, 6, 4001)[:, None]
    actions, log_density = backend._draw(observation.expand(len(noise), *observation.shape[1:]), noise)
    x = actions[:, 0].detach().double().numpy()
    total = np.trapezoid(log_density.detach().double().exp().numpy(), x)
    assert total == pytest.approx(1.0, abs=1e-3)


def test_a_critic_may_see_the_camera() -> None:
    spec = replace(SPEC, state_size=0)
    sac = make(replace(CONFIG, learning_starts=32, minibatch_size=8), spec=spec)
    assert np.isfinite(sac.iterate().losses.value_loss)


def test_a_loss_that_is_not_finite_stops_it() -> None:
    sac = make(replace(CONFIG, learning_starts=8, normalize_rewards=False))
    before = sac.backend.driving_weights()
    sac.environment.step = lambda actions: (  # type: ignore[method-assign]
        np.full(8, 1e25),
        np.zeros(8, bool),
        np.zeros(8, bool),
    )
    with pytest.raises(TrainingError, match="its step was not taken"):
        sac.iterate()
    for name, array in sac.backend.driving_weights().items():
        np.testing.assert_array_equal(array, before[name])


@pytest.mark.parametrize(
    ("settings", "match"),
    [
        ({"num_envs": 0}, "num_envs is 0"),
        ({"tau": 1.5}, "tau is 1.5"),
        ({"learning_rate": float("nan")}, "learning_rate is nan"),
        ({"updates_per_step": 0}, "updates_per_step is 0"),
        ({"buffer_size": 16}, "at least two steps of every car"),
        ({"learns_alpha": 1}, "learns_alpha is 1"),
        ({"minibatch_size": True}, "minibatch_size is True"),
    ],
)
def test_settings_that_cannot_work_are_refused(settings: dict[str, Any], match: str) -> None:
    with pytest.raises(ConfigError, match=match):
        SACConfig(**settings)


def test_one_action_that_is_not_finite_stops_it(monkeypatch: pytest.MonkeyPatch) -> None:
    sac = make(replace(CONFIG, learning_starts=8))
    broken = np.where(np.arange(8)[:, None] == 3, np.nan, 0.5)
    monkeypatch.setattr(sac.backend, "act", lambda observations, noise: broken)
    with pytest.raises(TrainingError, match="not finite"):
        sac.iterate()


def test_the_seconds_of_an_iteration_are_its_own(monkeypatch: pytest.MonkeyPatch) -> None:
    sac = make()
    monkeypatch.setattr("racecraft.learn.sac.time.perf_counter", ticking())
    for _ in range(2):
        stats = sac.iterate()
        assert (stats.policy_seconds, stats.environment_seconds, stats.update_seconds) == (8.0, 8.0, 8.0)


def test_a_reward_of_one_is_the_spread_of_the_returns_from_the_second_on() -> None:
    sac = make()
    for count, unit in ((0.0, 1.0), (1.0, 1.0), (2.0, 3.0), (8.0, 1.5)):
        sac._moments = np.array([count, 0.0, 18.0])
        assert sac._unit() == unit
    sac._moments = np.array([2.0, 0.0, 0.0])
    assert sac._unit() == np.float32(1e-6)


def test_discrete_actions_are_refused() -> None:
    spec = NetworkSpec(num_actions=3)
    learner = make_learner(spec, num_threads=1)
    with pytest.raises(ConfigError, match="continuous"):
        SAC(CONFIG, torch_sac(), learner, StripeWorld(8))


def test_the_buffer_gives_back_what_was_put_in_and_never_joins_two_episodes() -> None:
    buffer = ReplayBuffer(40, num_envs=2, observation_shape=(1,), state_size=1, action_size=1)
    for step in range(55):  # goes round more than twice
        buffer.add(
            observations=np.array([[step], [100 + step]], np.uint8),
            states=np.array([[step], [100 + step]], np.float32),
            actions=np.full((2, 1), step / 100, np.float32),
            rewards=np.array([step, 100 + step]),
            terminated=np.array([step % 7 == 0, False]),
            truncated=np.array([False, step % 5 == 0]),
        )
    assert len(buffer) == 38
    found = buffer.sample(2000, np.random.default_rng(0))
    steps = found.states[:, 0] % 100
    assert steps.min() == 35
    assert steps.max() == 53  # the newest has no frame after it
    np.testing.assert_array_equal(found.next_states, found.states + 1)
    np.testing.assert_array_equal(found.next_observations[:, 0], found.observations[:, 0] + 1)
    np.testing.assert_array_equal(found.rewards, found.states[:, 0])
    np.testing.assert_allclose(found.actions[:, 0], steps / 100)
    is_first = found.states[:, 0] < 100
    np.testing.assert_array_equal(found.terminated, is_first & (steps % 7 == 0))
    assert not (~is_first & (steps % 5 == 0)).any()


def test_a_sample_is_whole_however_few_steps_can_be_drawn_and_none_where_there_is_none() -> None:
    for num_good, size in ((1, 64), (0, 0)):
        buffer = ReplayBuffer(200, num_envs=1, observation_shape=(1,), state_size=1, action_size=1)
        for step in range(200):
            buffer.add(
                observations=np.zeros((1, 1), np.uint8),
                states=np.zeros((1, 1), np.float32),
                actions=np.zeros((1, 1), np.float32),
                rewards=np.array([step]),
                terminated=np.array([False]),
                truncated=np.array([step >= num_good]),
            )
        found = buffer.sample(64, np.random.default_rng(0))
        assert len(found.rewards) == size
        assert (found.rewards == 0).all()


@pytest.mark.costly
def test_gradient_steps_flush_subnormals_and_nothing_else_does() -> None:
    from racecraft.learn.torch_subnormals import subnormals_flushed

    def least() -> float:
        return float(np.float64(5e-324) * np.float64(1.0))

    with subnormals_flushed():
        assert least() == 0
        with subnormals_flushed():
            assert least() == 0
        assert least() == 0
    assert least() > 0
    trained = make(replace(CONFIG, learning_starts=64))
    trained.iterate()
    trained.iterate()
    assert least() > 0
