"""Gradients against finite differences, and Adam against its formula."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from racecraft.classic.a2c import ActorCriticSettings, gradients
from racecraft.classic.distributions import Categorical, Distribution, Gaussian
from racecraft.classic.network import Adam, Network
from racecraft.classic.policy import ActorCritic
from racecraft.classic.ppo import clipped
from racecraft.classic.rollout import Rollout
from racecraft.classic.sac import SquashedActor, actor_gradient

STEP = 1e-6


def differences(function: Any, parameters: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
    """Of a scalar by each parameter, central."""
    found = np.zeros(parameters.size)
    for place in range(parameters.size):
        kept = parameters.flat[place]
        parameters.flat[place] = kept + STEP
        above = function()
        parameters.flat[place] = kept - STEP
        found[place] = (above - function()) / (2.0 * STEP)
        parameters.flat[place] = kept
    return found.reshape(parameters.shape)


@pytest.mark.parametrize("activation", ["tanh", "relu"])
@pytest.mark.parametrize("sizes", [(3, 2), (4, 5, 2), (3, 6, 5, 1)])
def test_the_gradient_of_a_network_is_that_of_finite_differences(sizes: tuple[int, ...], activation: Any) -> None:
    rng = np.random.default_rng(1)
    network = Network(sizes, rng, activation=activation, dtype=np.float64)
    network.parameters += 0.1 * rng.standard_normal(network.parameters.shape)  # biases, too
    x, weights = rng.standard_normal((7, sizes[0])), rng.standard_normal((7, sizes[-1]))

    def loss() -> float:
        return float((network(x) * weights).sum())

    loss()
    assert network.gradient(weights) == pytest.approx(differences(loss, network.parameters), abs=1e-6)
    assert network.input_gradient(weights) == pytest.approx(differences(loss, x), abs=1e-6)


@pytest.mark.parametrize("distribution", [Categorical(4), Gaussian(2)])
def test_the_gradients_of_a_distribution_are_those_of_finite_differences(distribution: Distribution) -> None:
    rng = np.random.default_rng(2)
    outputs = rng.standard_normal((5, distribution.outputs)) * 0.5
    actions = distribution.sample(outputs, rng)
    assert distribution.log_prob_gradient(outputs, actions) == pytest.approx(
        differences(lambda: distribution.log_prob(outputs, actions).sum(), outputs), abs=1e-6
    )
    assert distribution.entropy_gradient(outputs) == pytest.approx(
        differences(lambda: distribution.entropy(outputs).sum(), outputs), abs=1e-6
    )


def test_a_standard_deviation_at_its_bound_has_no_gradient() -> None:
    outputs = np.array([[0.0, 9.0], [0.0, -9.0]])
    gaussian = Gaussian(1)
    assert (gaussian.log_prob_gradient(outputs, np.array([[1.0], [1.0]]))[:, 1] == 0.0).all()
    assert (gaussian.entropy_gradient(outputs)[:, 1] == 0.0).all()


def test_samples_are_as_likely_as_they_are_said_to_be() -> None:
    rng = np.random.default_rng(3)
    outputs = np.tile(np.log([[0.7, 0.2, 0.1]]), (20_000, 1))
    shares = np.bincount(Categorical(3).sample(outputs, rng)) / len(outputs)
    assert shares == pytest.approx([0.7, 0.2, 0.1], abs=0.02)
    drawn = Gaussian(1).sample(np.tile([[0.5, np.log(0.3)]], (20_000, 1)), rng)
    assert (drawn.mean(), drawn.std()) == (pytest.approx(0.5, abs=0.01), pytest.approx(0.3, abs=0.01))


def actor_critic(rng: np.random.Generator) -> ActorCritic:
    from gymnasium.spaces import Discrete

    policy = ActorCritic(3, Discrete(3), (4,), rng)
    policy.actor = Network((3, 4, 3), rng, dtype=np.float64)
    policy.critic = Network((3, 4, 1), rng, dtype=np.float64)
    return policy


def test_the_gradients_of_actor_and_critic_are_those_of_their_losses() -> None:
    rng = np.random.default_rng(4)
    policy, settings = actor_critic(rng), ActorCriticSettings(entropy=0.3)
    rollout = Rollout(
        rng.standard_normal((6, 3)), rng.integers(3, size=6), rng.standard_normal(6), rng.standard_normal(6)
    )
    weights = (rollout.advantages - rollout.advantages.mean()) / (rollout.advantages.std() + 1e-8)

    def of_actor() -> float:
        outputs = policy.actor(rollout.observations)
        gain = weights * policy.distribution.log_prob(outputs, rollout.actions)
        return float(-(gain + 0.3 * policy.distribution.entropy(outputs)).mean())

    def of_critic() -> float:
        return float(0.5 * ((policy.critic(rollout.observations)[:, 0] - rollout.returns) ** 2).mean())

    actor, critic = gradients(policy, rollout, settings)
    assert actor == pytest.approx(differences(of_actor, policy.actor.parameters), abs=1e-6)
    assert critic == pytest.approx(differences(of_critic, policy.critic.parameters), abs=1e-6)


def test_the_clipped_ratio_of_ppo_has_the_derivative_of_its_minimum() -> None:
    ratio, advantages = np.array([0.5, 0.9, 1.1, 1.5, 0.5, 0.9, 1.1, 1.5]), np.array([2.0] * 4 + [-2.0] * 4)

    def gain() -> float:
        return float(np.minimum(ratio * advantages, np.clip(ratio, 0.8, 1.2) * advantages).sum())

    assert clipped(ratio, advantages, 0.2) == pytest.approx(differences(gain, ratio), abs=1e-6)


def test_the_gradient_of_sacs_actor_is_that_of_finite_differences() -> None:
    rng = np.random.default_rng(5)
    policy = SquashedActor(3, 2, (5,), rng)
    policy.actor = Network((3, 5, 4), rng, dtype=np.float64)
    policy.critics = [Network((5, 6, 1), rng, dtype=np.float64) for _ in range(2)]
    policy.log_alpha = np.array([-0.7])
    states, noise = rng.standard_normal((6, 3)), rng.standard_normal((6, 2))

    def loss() -> float:
        actions, logs, _, _ = policy.draw(states, noise)
        pairs = np.hstack([states, actions])
        modest = np.minimum(*(critic(pairs)[:, 0] for critic in policy.critics))
        return float((np.exp(-0.7) * logs - modest).mean())

    found, logs = actor_gradient(policy, states, noise)
    found = found.copy()
    assert found == pytest.approx(differences(loss, policy.actor.parameters), abs=1e-6)
    assert logs == pytest.approx(policy.draw(states, noise)[1])


def test_the_probability_of_a_squashed_action_sums_to_one() -> None:
    policy = SquashedActor(1, 1, (), np.random.default_rng(6))
    noise = np.linspace(-6.0, 6.0, 4001)[:, None]
    actions, logs, _, _ = policy.draw(np.zeros((4001, 1), np.float32), noise)
    assert np.trapezoid(np.exp(logs), actions[:, 0]) == pytest.approx(1.0, abs=1e-3)


def test_adam_goes_as_its_formula_says() -> None:
    rng = np.random.default_rng(7)
    parameters = rng.standard_normal(5)
    adam, expected = Adam(parameters, 0.1), parameters.copy()
    mean, square = np.zeros(5), np.zeros(5)
    for t in range(1, 6):
        gradient = rng.standard_normal(5)
        adam.step(gradient)
        mean, square = 0.9 * mean + 0.1 * gradient, 0.999 * square + 0.001 * gradient**2
        expected -= 0.1 * (mean / (1 - 0.9**t)) / (np.sqrt(square / (1 - 0.999**t)) + 1e-8)
    assert parameters == pytest.approx(expected, rel=1e-5)


def test_a_long_gradient_is_cut() -> None:
    far, near = np.zeros(2), np.zeros(2)
    cut, plain = Adam(far, 0.1, max_norm=1.0), Adam(near, 0.1)
    for gradient in (np.array([30.0, 40.0]), np.array([0.1, 0.0])):
        cut.step(gradient)
        plain.step(gradient if gradient[0] < 1.0 else np.array([0.6, 0.8]))
    assert far == pytest.approx(near)


def test_first_weights_keep_the_size_of_signals() -> None:
    network = Network((30, 64, 64, 2), np.random.default_rng(8), gain=0.01)
    for weights, bias in network.layers:
        assert not bias.any()
        narrow = weights if weights.shape[0] >= weights.shape[1] else weights.T
        product = narrow.T.astype(float) @ narrow
        assert product == pytest.approx(product[0, 0] * np.eye(len(product)), abs=1e-5)
    assert np.abs(network(np.random.default_rng(9).standard_normal((5, 30)).astype(np.float32))).max() < 0.1
