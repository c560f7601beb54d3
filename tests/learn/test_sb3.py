"""Stable-Baselines3 on a toy world: every algorithm drives, publishes what it drives with, and resumes."""

from __future__ import annotations

from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from stripe_world import StripeWorld

from racecraft.errors import CheckpointError, ConfigError
from racecraft.learn import NetworkSpec, distributions, make_learner
from racecraft.learn.sb3 import CONTINUOUS_ONLY, DISCRETE_ONLY, SB3_ALGORITHMS, SB3Config

if TYPE_CHECKING:
    from racecraft.learn.torch_sb3 import SB3

pytestmark = pytest.mark.skipif(find_spec("stable_baselines3") is None, reason="stable-baselines3 is not installed")
CONFIG = SB3Config(num_envs=4, num_steps=16, buffer_size=400, learning_starts=16, batch_size=16)


def make(name: str, *, config: SB3Config = CONFIG, seed: int = 0, is_discrete: bool | None = None) -> SB3:
    from racecraft.learn.torch_sb3 import SB3

    discrete = name not in CONTINUOUS_ONLY if is_discrete is None else is_discrete
    spec = NetworkSpec(
        num_actions=3 if discrete else 1, is_discrete=discrete, state_size=2, is_squashed=name in CONTINUOUS_ONLY
    )
    learner = make_learner(spec, num_threads=1)
    return SB3(name, config, learner, StripeWorld(config.num_envs, time_limit=12), seed=seed, num_threads=1)


@pytest.mark.costly
@pytest.mark.parametrize("name", SB3_ALGORITHMS)
def test_what_is_published_is_what_the_library_would_drive(name: str) -> None:
    """Native forward passes against the library's own best action."""
    trained = make(name)
    stats = trained.iterate()
    assert (stats.num_steps, trained.total_steps, stats.iteration) == (64, 64, 1)
    assert stats.episodes > 0
    frames = StripeWorld(8, seed=3).observe()[0]
    observations = trained.learner.encode(frames)
    with trained.driving():
        outputs = trained.learner.policy(observations)
    spec = trained.spec
    ours = distributions.most_likely(outputs, is_discrete=spec.is_discrete, is_squashed=spec.is_squashed)
    theirs, _ = trained._model.predict(observations.reshape(8, -1), deterministic=True)
    np.testing.assert_allclose(ours, np.clip(theirs, -1, 3), atol=2e-5)


@pytest.mark.costly
@pytest.mark.parametrize("name", SB3_ALGORITHMS)
def test_it_resumes_with_its_weights_and_optimisers(name: str) -> None:
    first, second = make(name), make(name, seed=5)
    first.iterate()
    state = first.state()
    second.load_state(state)
    assert second.total_steps == first.total_steps
    for key, array in second.state().items():
        np.testing.assert_array_equal(array, state[key], err_msg=key)
    second.iterate()
    assert any(not np.array_equal(array, state[key]) for key, array in second.state().items())
    with pytest.raises(CheckpointError, match=f"not of sb3:{name}"):
        second.load_state({n: a for n, a in state.items() if not n.startswith("sb3/policy")})


@pytest.mark.slow
def test_its_ppo_learns_to_keep_the_stripe_in_the_middle() -> None:
    trained = make("ppo", config=SB3Config(num_envs=8, num_steps=64, batch_size=64, learning_rate=1e-3))
    returns = [stats.mean_return / stats.mean_length for stats in (trained.iterate() for _ in range(6))]
    assert returns[0] < 0.6 < 0.75 < returns[-1], returns


@pytest.mark.parametrize("name", [*DISCRETE_ONLY, *CONTINUOUS_ONLY])
def test_actions_of_the_other_kind_are_refused(name: str) -> None:
    with pytest.raises(ConfigError, match=f"sb3:{name} needs"):
        make(name, is_discrete=name in CONTINUOUS_ONLY)


@pytest.mark.parametrize(
    ("settings", "match"),
    [({"num_envs": 0}, "num_envs is 0"), ({"gamma": 2}, "gamma is 2"), ({"buffer_size": 1.5}, "buffer_size is 1.5")],
)
def test_settings_that_cannot_work_are_refused(settings: dict[str, Any], match: str) -> None:
    with pytest.raises(ConfigError, match=match):
        SB3Config(**settings)
