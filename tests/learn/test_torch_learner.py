from __future__ import annotations

import dataclasses
import subprocess
import sys

import numpy as np
import pytest
from late_torch import TorchLearner
from minibatches import OBJECTIVE, minibatch_for, reference_tower

from racecraft.errors import CheckpointError, ConfigError
from racecraft.learn import NetworkSpec, networks


@pytest.mark.costly
@pytest.mark.parametrize("name", networks.network_names())
def test_forward_agrees_with_numpy(name):
    spec = NetworkSpec(name=name, num_actions=6)
    learner = TorchLearner(spec, seed=2, precision="float32")
    weights = {key: array * (50 if key == "policy.head.weight" else 1) for key, array in learner.weights().items()}
    learner.load_weights(weights)
    frames = np.random.default_rng(0).integers(0, 256, (2, *networks.sight_shape(spec)), dtype=np.uint8)
    observations = learner.encode(frames)
    expected = reference_tower(spec, weights, frames, "policy")
    np.testing.assert_allclose(learner.policy(observations), expected, atol=1e-4)
    values = learner.values(observations, np.zeros((2, 0), np.float32))
    np.testing.assert_allclose(values, reference_tower(spec, weights, frames, "critic")[:, 0], atol=1e-4)


@pytest.mark.parametrize("is_discrete", [True, False])
@pytest.mark.parametrize("precision", ["float32", "bfloat16"])
def test_updates_lower_the_loss_on_a_fixed_batch(is_discrete, precision):
    spec = NetworkSpec(num_actions=4, is_discrete=is_discrete, state_size=6)
    learner = TorchLearner(spec, precision=precision)
    minibatch = minibatch_for(learner)
    first, *_, last = [learner.update(minibatch, OBJECTIVE) for _ in range(6)]
    assert last.policy_loss < first.policy_loss - 0.01
    assert last.value_loss < first.value_loss
    assert abs(first.approx_kl) < 1e-3  # nothing has moved yet
    assert first.clip_fraction < 0.01


@pytest.mark.parametrize("is_discrete", [True, False])
@pytest.mark.parametrize("value_loss", ["mse", "huber"])
def test_gradient_is_that_of_the_loss(is_discrete, value_loss):
    spec = NetworkSpec(num_actions=3, is_discrete=is_discrete, state_size=6)
    learner = TorchLearner(spec, seed=3, precision="float32")
    objective = dataclasses.replace(OBJECTIVE, value_loss=value_loss, max_grad_norm=0.0, ent_coef=0.1)
    minibatch = minibatch_for(learner, 64)
    start = learner.weights()

    def loss() -> float:
        stats = learner.update(minibatch, dataclasses.replace(objective, learning_rate=0.0))
        return stats.policy_loss + 0.5 * stats.value_loss - 0.1 * stats.entropy

    # a tiny step along the sign of the gradient must change the loss by the directional derivative
    loss()
    gradient = {
        name.removeprefix("moment1/"): array / 0.1
        for name, array in learner.optimizer_state().items()
        if name.startswith("moment1/")
    }
    names = ["policy.head.weight", "critic.head.bias"] + ([] if is_discrete else ["policy.log_std"])
    for name in names:
        slope, step = float(abs(gradient[name]).sum()), 1e-4 if name.endswith("weight") else 1e-3
        losses = []
        for sign in (1, -1):
            moved = start[name] + sign * step * np.sign(gradient[name])
            learner.load_weights(start | {name: moved.astype(np.float32)})
            losses.append(loss())
        assert (losses[0] - losses[1]) / (2 * step) == pytest.approx(slope, rel=0.05, abs=2e-3), name


@pytest.mark.parametrize("is_discrete", [True, False])
def test_learning_rate_zero_changes_nothing(is_discrete):
    learner = TorchLearner(NetworkSpec(num_actions=4, is_discrete=is_discrete, state_size=6))
    before = learner.weights()
    learner.update(minibatch_for(learner), dataclasses.replace(OBJECTIVE, learning_rate=0.0))
    for name, array in learner.weights().items():
        np.testing.assert_array_equal(array, before[name])


def test_every_parameter_learns():
    for spec in (NetworkSpec(num_actions=3, is_discrete=False), NetworkSpec(num_actions=3, state_size=5)):
        learner = TorchLearner(spec)
        before = learner.weights()
        for seed in range(3):
            learner.update(minibatch_for(learner, seed=seed), OBJECTIVE)
        assert all(not np.array_equal(array, before[name]) for name, array in learner.weights().items())


def test_same_bits_for_any_number_of_threads():
    weights = []
    for num_threads in (1, 2, 3):
        learner = TorchLearner(NetworkSpec(num_actions=5, state_size=6), seed=9, num_threads=num_threads)
        for seed in range(3):
            learner.update(minibatch_for(learner, 300, seed=seed), OBJECTIVE)
        weights.append(learner.weights())
    for other in weights[1:]:
        for name, array in weights[0].items():
            np.testing.assert_array_equal(array, other[name])


def test_saved_and_loaded_learner_continues_to_the_bit():
    spec = NetworkSpec(num_actions=5, state_size=6)
    straight, saved, resumed = (TorchLearner(spec, seed=seed) for seed in (1, 1, 2))
    batches = [minibatch_for(straight, seed=seed) for seed in range(4)]
    for batch in batches:
        straight.update(batch, OBJECTIVE)
    for batch in batches[:2]:
        saved.update(batch, OBJECTIVE)
    resumed.load_weights(saved.weights())
    resumed.load_optimizer_state(saved.optimizer_state())
    for batch in batches[2:]:
        resumed.update(batch, OBJECTIVE)
    for name, array in straight.weights().items():
        np.testing.assert_array_equal(array, resumed.weights()[name])


@pytest.mark.parametrize("poison", ["advantages", "returns", "states"])
def test_a_loss_that_is_not_finite_is_reported_and_not_applied(poison):
    learner = TorchLearner(NetworkSpec(num_actions=4, state_size=6))
    minibatch = minibatch_for(learner)
    before, moments = learner.weights(), learner.optimizer_state()
    getattr(minibatch, poison)[5] = np.nan
    assert not learner.update(minibatch, OBJECTIVE).is_finite
    for name, array in learner.weights().items():
        np.testing.assert_array_equal(array, before[name])
    for name, array in learner.optimizer_state().items():
        np.testing.assert_array_equal(array, moments[name])


def test_weights_of_another_network_are_refused():
    learner = TorchLearner(NetworkSpec(num_actions=4))
    others = TorchLearner(NetworkSpec(num_actions=5)).weights()
    with pytest.raises(CheckpointError, match=r"policy\.head"):
        learner.load_weights(others)
    with pytest.raises(CheckpointError, match="missing"):
        learner.load_weights({})
    with pytest.raises(CheckpointError):
        learner.load_optimizer_state({})


def test_weights_are_copies():
    learner = TorchLearner(NetworkSpec(num_actions=4))
    learner.weights()["policy.head.bias"][:] = 7
    assert not learner.weights()["policy.head.bias"].any()


def test_unknown_precision_is_refused():
    with pytest.raises(ConfigError, match="float16"):
        TorchLearner(NetworkSpec(num_actions=4), precision="float16")


@pytest.mark.costly
def test_torch_is_imported_only_by_the_torch_learner():
    code = "import sys, racecraft.learn; assert 'torch' not in sys.modules; "
    code += "racecraft.learn.make_learner(racecraft.learn.NetworkSpec(num_actions=2), backend='torch'); "
    code += "assert 'torch' in sys.modules and 'torch._dynamo' not in sys.modules"
    subprocess.run([sys.executable, "-c", code], check=True, env={"PYTHONPATH": ":".join(sys.path)}, timeout=300)
