"""The teacher's native learner against a slow one in NumPy, which is checked by finite differences."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from slow_perceptrons import forward, loss_and_gradient

from racecraft import _native
from racecraft.errors import CheckpointError, ConfigError, ShapeError
from racecraft.learn import Minibatch, NetworkSpec, Objective, distributions, networks
from racecraft.learn.native_state_learner import NativeStateLearner

OBJECTIVE = Objective(
    learning_rate=1e-3, clip_coef=0.2, ent_coef=0.05, vf_coef=0.5, value_loss="huber", max_grad_norm=0.5
)


def spec_of(*, is_discrete: bool) -> NetworkSpec:
    return NetworkSpec(num_actions=3 if is_discrete else 2, is_discrete=is_discrete, state_size=16)


def make(*, is_discrete: bool, seed: int = 1, num_threads: int = 1) -> NativeStateLearner:
    """With weights of the size that trained ones have."""
    learner = NativeStateLearner(spec_of(is_discrete=is_discrete), seed=seed, num_threads=num_threads)
    rng = np.random.default_rng(seed)
    learner.load_weights(
        {name: array + rng.normal(0, 0.2, array.shape).astype(np.float32) for name, array in learner.weights().items()}
    )
    return learner


def minibatch_for(learner: NativeStateLearner, size: int = 300, *, seed: int = 2) -> Minibatch:
    rng, spec = np.random.default_rng(seed), learner.spec
    states = rng.normal(size=(size, spec.state_size)).astype(np.float32)
    outputs = learner.policy(states)
    noise = distributions.noise_for(size, num_actions=spec.num_actions, is_discrete=spec.is_discrete, rng=rng)
    actions = distributions.sample(outputs, noise, is_discrete=spec.is_discrete)
    log_probs = distributions.log_prob(outputs, actions, is_discrete=spec.is_discrete)
    observations: Any = states
    return Minibatch(
        observations=observations,
        states=np.zeros((size, 0), np.float32),
        actions=actions,
        log_probs=log_probs + rng.normal(0, 0.1, size).astype(np.float32),
        advantages=rng.normal(size=size).astype(np.float32),
        returns=rng.normal(0, 2, size).astype(np.float32),
        rows=rng.permutation(size)[: size - 9],
    )


def in_double(learner: NativeStateLearner) -> dict[str, np.ndarray]:
    return {name: array.astype(float) for name, array in learner.weights().items()}


@pytest.mark.parametrize("is_discrete", [True, False])
def test_outputs_and_gradient_are_those_of_the_slow_reference(is_discrete: bool) -> None:
    learner = make(is_discrete=is_discrete, num_threads=2)
    minibatch, weights = minibatch_for(learner), in_double(learner)
    states: Any = minibatch.observations
    policy = forward(weights, "policy", states)[-1]
    np.testing.assert_allclose(learner.policy(states)[:, : policy.shape[1]], policy, rtol=1e-4, atol=2e-6)
    np.testing.assert_allclose(
        learner.values(states, states), forward(weights, "critic", states)[-1][:, 0], rtol=1e-4, atol=2e-6
    )
    for value_loss in ("huber", "mse"):
        objective = replace(OBJECTIVE, value_loss=value_loss, learning_rate=0.0, max_grad_norm=0.0)
        terms, gradient = loss_and_gradient(learner.spec, weights, minibatch, objective)
        learner.load_optimizer_state({name: 0 * array for name, array in learner.optimizer_state().items()})
        stats = learner.update(minibatch, objective)
        for name in ("policy_loss", "value_loss", "entropy", "approx_kl", "clip_fraction", "grad_norm"):
            assert getattr(stats, name) == pytest.approx(terms[name], rel=1e-5, abs=1e-6), name
        moments = learner.optimizer_state()
        assert {f"moment1/{name}" for name in gradient} | {f"moment2/{name}" for name in gradient} | {"step"} == set(
            moments
        )
        for name, slope in gradient.items():
            scale = np.abs(slope).max()
            np.testing.assert_allclose(moments[f"moment1/{name}"] / 0.1, slope, atol=1e-5 * scale, err_msg=name)


@pytest.mark.parametrize("is_discrete", [True, False])
def test_the_references_gradient_is_that_of_its_loss(is_discrete: bool) -> None:
    """Central differences of the whole loss along a random direction."""
    learner = make(is_discrete=is_discrete)
    weights, minibatch, rng = in_double(learner), minibatch_for(learner), np.random.default_rng(3)
    _, gradient = loss_and_gradient(learner.spec, weights, minibatch, OBJECTIVE)
    assert gradient.keys() == weights.keys()
    for name, slope in gradient.items():
        direction = rng.normal(size=slope.shape)
        sides = [
            loss_and_gradient(learner.spec, {**weights, name: weights[name] + step * direction}, minibatch, OBJECTIVE)[
                0
            ]["total"]
            for step in (1e-6, -1e-6)
        ]
        assert (sides[0] - sides[1]) / 2e-6 == pytest.approx(float((slope * direction).sum()), rel=1e-4, abs=1e-7), name


def after_steps(*, is_discrete: bool, num_threads: int) -> bytes:
    learner = make(is_discrete=is_discrete, num_threads=num_threads)
    for seed in range(3):
        learner.update(minibatch_for(learner, 205, seed=seed), OBJECTIVE)
    states: Any = minibatch_for(learner, 77).observations
    parts = [*learner.weights().values(), *learner.optimizer_state().values(), learner.policy(states)]
    return b"".join(part.tobytes() for part in (*parts, learner.values(states, states)))


@pytest.mark.parametrize("is_discrete", [True, False])
def test_the_bits_do_not_depend_on_threads_or_instruction_set(is_discrete: bool) -> None:
    before, results = _native.isa(), set()
    try:
        for isa in _native.available_isas():
            _native.set_isa(isa)
            results |= {after_steps(is_discrete=is_discrete, num_threads=count) for count in (1, 2, 5)}
    finally:
        _native.set_isa(before)
    assert len(results) == 1


def test_a_loss_that_is_not_finite_changes_nothing() -> None:
    learner = make(is_discrete=False)
    minibatch = minibatch_for(learner)
    before, moments = learner.weights(), learner.optimizer_state()
    minibatch.returns[int(minibatch.rows[0])] = np.nan
    assert not learner.update(minibatch, OBJECTIVE).is_finite
    for ours, theirs in ((before, learner.weights()), (moments, learner.optimizer_state())):
        for name, array in ours.items():
            np.testing.assert_array_equal(array, theirs[name], err_msg=name)


def test_what_does_not_fit_is_refused() -> None:
    learner = make(is_discrete=False)
    with pytest.raises(ShapeError, match="observations"):
        learner.policy(np.zeros((4, 15), np.float32))
    with pytest.raises(ShapeError, match="observations"):
        learner.update(replace(minibatch_for(learner), observations=np.zeros((300, 3), np.uint8)), OBJECTIVE)
    with pytest.raises(CheckpointError, match="do not fit"):
        learner.load_weights(make(is_discrete=True).weights())
    with pytest.raises(ConfigError, match="at least one column"):
        NativeStateLearner(replace(spec_of(is_discrete=True), state_size=0))


def test_a_teacher_is_no_network_to_choose() -> None:
    assert networks.TEACHER not in networks.network_names()
    with pytest.raises(ConfigError, match="allowed are RACECRAFT_SMALL"):
        networks.architecture(networks.TEACHER)
