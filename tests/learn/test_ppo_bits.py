"""The core's loop against the same one in NumPy: weights, optimiser and counters, to the bit."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import slow_ppo
from stripe_world import StripeWorld

from racecraft.errors import TrainingError
from racecraft.learn import PPO, NetworkSpec, PPOConfig, make_learner
from racecraft.learn.distill import StateWorld
from racecraft.learn.native_state_learner import NativeStateLearner

PLAIN = PPOConfig(num_envs=12, num_steps=6, minibatch_size=24, update_epochs=2)
GREEDY = replace(PLAIN, exploration="e-greedy", epsilon_steps=150, rate_steps=100, minibatch_size=25)
AWS = replace(
    GREEDY,
    episodes_per_iteration=17,
    max_steps_per_iteration=150,
    value_loss="huber",
    is_eps_hat=True,
    max_grad_norm=0.0,
    normalize_returns=False,
)
CASES = {
    "discrete": (PLAIN, NetworkSpec(num_actions=3, state_size=2)),
    "continuous": (replace(PLAIN, ent_coef=0.0), NetworkSpec(num_actions=3, is_discrete=False, state_size=2)),
    "critic with a camera": (PLAIN, NetworkSpec(num_actions=3, is_discrete=False)),
    "e-greedy": (GREEDY, NetworkSpec(num_actions=3, state_size=1)),
    "whole episodes": (AWS, NetworkSpec(num_actions=3, state_size=2)),
    "fewer episodes than cars": (replace(AWS, episodes_per_iteration=5), NetworkSpec(num_actions=3, state_size=2)),
}


def assert_same(ours: dict[str, np.ndarray], theirs: dict[str, np.ndarray]) -> None:
    assert ours.keys() == theirs.keys()
    for name, array in ours.items():
        np.testing.assert_array_equal(array, theirs[name], err_msg=name)


@pytest.mark.parametrize("seed", [0, 2**40 + 3])
@pytest.mark.parametrize("case", CASES)
def test_weights_are_those_of_the_loop_in_numpy(case, seed):
    config, spec = CASES[case]
    worlds = [StripeWorld(config.num_envs, seed=seed % 97, time_limit=9) for _ in range(2)]
    ours, theirs = (make_learner(spec, seed=3, num_threads=1) for _ in range(2))
    ppo, memory = PPO(config, ours, worlds[0], seed=seed), {"steps": 0}
    for iteration in range(3):
        driven = slow_ppo.iterate(config, theirs, worlds[1], seed=seed, iteration=iteration, memory=memory)
        assert ppo.iterate().num_steps == driven
    assert ppo.total_steps == memory["steps"]
    np.testing.assert_array_equal(ppo.return_scale, memory.get("scale", (0.0, 1.0)))
    assert_same(ours.weights(), theirs.weights())
    assert_same(ours.optimizer_state(), theirs.optimizer_state())


def test_teachers_without_a_camera_learn_in_the_same_loop():
    spec = NetworkSpec(num_actions=3, state_size=2)
    worlds = [StateWorld(StripeWorld(PLAIN.num_envs, time_limit=9)) for _ in range(2)]
    ours, theirs = (NativeStateLearner(spec, seed=3, num_threads=1) for _ in range(2))
    ppo, memory = PPO(PLAIN, ours, worlds[0], seed=5), {"steps": 0}
    for iteration in range(3):
        ppo.iterate()
        slow_ppo.iterate(PLAIN, theirs, worlds[1], seed=5, iteration=iteration, memory=memory)
    assert_same(ours.weights(), theirs.weights())


class AnotherLearner:
    """The core's learner as if it were somebody else's, which the loop calls back."""

    def __init__(self, spec: NetworkSpec) -> None:
        self.learner = make_learner(spec, seed=3, num_threads=1)
        shapes, does = ("sight_shape", "observation_shape"), ("encode", "policy", "values", "update")
        for name in ("spec", *shapes, *does, "weights", "optimizer_state"):
            setattr(self, name, getattr(self.learner, name))


@pytest.mark.parametrize("case", CASES)
def test_a_learner_that_is_called_back_gets_the_same_arrays(case):
    config, spec = CASES[case]
    own, other = make_learner(spec, seed=3, num_threads=1), AnotherLearner(spec)
    loops = [PPO(config, learner, StripeWorld(config.num_envs, time_limit=9), seed=1) for learner in (own, other)]
    for _ in range(2):
        first, second = (loop.iterate() for loop in loops)
        assert first.losses == second.losses
    assert_same(own.weights(), other.weights())
    assert_same(own.optimizer_state(), other.optimizer_state())


@pytest.mark.parametrize("case", ["discrete", "whole episodes"])
def test_a_training_resumed_in_its_middle_gives_the_same_bits(case):
    config, spec = CASES[case]
    straight, resumed = (
        PPO(config, make_learner(spec, seed=seed, num_threads=1), StripeWorld(config.num_envs, time_limit=9), seed=seed)
        for seed in (3, 8)
    )
    for _ in range(2):
        straight.iterate()
    resumed.load_state({name: array.copy() for name, array in straight.state().items()})
    world, other = straight.environment, resumed.environment
    other._offset, other._age = world._offset.copy(), world._age.copy()
    other._rng.bit_generator.state = world._rng.bit_generator.state
    for _ in range(2):
        assert straight.iterate().ended == resumed.iterate().ended
    assert_same(straight.state(), resumed.state())


def test_an_error_of_a_learner_that_is_called_back_arrives():
    learner = AnotherLearner(CASES["discrete"][1])
    learner.update = lambda minibatch, objective: 1 / 0
    ppo = PPO(PLAIN, learner, StripeWorld(PLAIN.num_envs))
    with pytest.raises(ZeroDivisionError):
        ppo.iterate()


def test_outputs_that_are_not_finite_stop_the_training():
    learner = make_learner(CASES["discrete"][1], num_threads=1)
    weights = learner.weights()
    weights["policy.head.bias"][1] = np.nan
    learner.load_weights(weights)
    with pytest.raises(TrainingError, match="outputs are not finite"):
        PPO(PLAIN, learner, StripeWorld(PLAIN.num_envs)).iterate()


@pytest.mark.parametrize(
    ("frames", "states", "message"),
    [
        (np.zeros((12, 120, 159), np.uint8), np.zeros((12, 2), np.float32), "frames"),
        (np.zeros((12, 120, 160), np.float32), np.zeros((12, 2), np.float32), "frames"),
        (np.zeros((12, 120, 160), np.uint8), np.zeros((11, 2), np.float32), "states"),
        (np.zeros((12, 120, 160), np.uint8), np.zeros((12, 1), np.float32), "states"),
    ],
)
def test_what_cars_see_must_fit_the_network(frames, states, message):
    world = StripeWorld(PLAIN.num_envs)
    world.observe = lambda: (frames, states)
    with pytest.raises(ValueError, match=message):
        PPO(PLAIN, make_learner(CASES["discrete"][1], num_threads=1), world).iterate()


def test_calls_in_another_order_are_refused():
    ppo = PPO(PLAIN, make_learner(CASES["discrete"][1], num_threads=1), StripeWorld(PLAIN.num_envs))
    loop, flags = ppo._loop, np.zeros(12, bool)
    with pytest.raises(ValueError, match="could be paid"):
        loop.pay(np.zeros(12), flags, flags)
    with pytest.raises(ValueError, match="full"):
        loop.act(*ppo._see())
    loop.begin(0, 0, 0)
    with pytest.raises(ValueError, match="not full yet"):
        loop.learn()
    assert loop.act(*ppo._see())
    with pytest.raises(ValueError, match="one reward"):
        loop.pay(np.zeros(11), flags, flags)
