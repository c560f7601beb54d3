from __future__ import annotations

import dataclasses
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
from late_torch import TorchLearner
from minibatches import OBJECTIVE, minibatch_for, reference_gradient, reference_tower, sight_for

from racecraft import _native
from racecraft.errors import ConfigError
from racecraft.learn import NetworkSpec, make_learner, networks
from racecraft.learn.native_learner import NativeLearner

NAMES = networks.network_names()
# Of one network, the largest, every test takes seconds.
MARKED = [
    pytest.param(name, marks=pytest.mark.costly) if name == "DEEP_CONVOLUTIONAL_NETWORK" else name for name in NAMES
]
SMALL = NetworkSpec(num_actions=5, state_size=21)
HEADS = [(True, 0), (False, 21)]  # is_discrete, state_size


# Every branch a tower can have, and how AWS's networks put them together.
BRANCHES = [
    NetworkSpec(num_actions=5, lidar_size=64),
    NetworkSpec(num_actions=2, is_discrete=False, lidar_size=7, state_size=21),
    NetworkSpec(num_actions=3, lenses=2),
    NetworkSpec(num_actions=3, lenses=2, lidar_size=8, frame_shape=(100, 96)),
    NetworkSpec(name=NAMES[1], num_actions=4, lidar_size=64, state_size=5),
    # small: among millions of units some lie within a rounding of their kink, where float32 and float64 part
    NetworkSpec(name=NAMES[2], num_actions=4, lidar_size=64, frame_shape=(40, 52)),
    NetworkSpec(name=NAMES[3], num_actions=4, lidar_size=30, state_size=5),
    NetworkSpec(name=NAMES[2], num_actions=4, lenses=2, lidar_size=8, frame_shape=(36, 40), state_size=5),
    NetworkSpec(name=NAMES[3], num_actions=2, lenses=2, is_discrete=False, frame_shape=(36, 32), state_size=5),
]


def name_of(spec: NetworkSpec) -> str:
    return f"{spec.name}-{spec.lenses}-{spec.lidar_size}-{spec.state_size}"


@pytest.fixture
def restored_isa():
    before = _native.isa()
    yield
    _native.set_isa(before)


def randomize(learner, *, seed: int = 0) -> None:
    """Weights and biases of every layer of the size a trained network has."""
    rng = np.random.default_rng(seed)
    weights = {}
    for name, shape in networks.weight_shapes(learner.spec).items():
        scale = 0.05 if len(shape) == 1 else 1.4 / np.sqrt(np.prod(shape[1:]))
        weights[name] = np.float32(scale) * rng.standard_normal(shape, np.float32)
    learner.load_weights(weights)


def gradient_of(learner, minibatch, objective):
    """What one step leaves in Adam's first moment, (1 - beta1) times the gradient."""
    stats = learner.update(minibatch, dataclasses.replace(objective, learning_rate=0.0, max_grad_norm=0.0))
    moments = learner.optimizer_state()
    return stats, {name: moments[f"moment1/{name}"] / 0.1 for name in learner.weights()}


def assert_same_bits(a, b) -> None:
    assert a.keys() == b.keys()
    for name, array in a.items():
        assert array.tobytes() == b[name].tobytes(), name


@pytest.mark.costly
@pytest.mark.parametrize("name", NAMES)
def test_frames_are_encoded_as_in_numpy(name):
    spec = NetworkSpec(name=name, num_actions=2)
    frames = np.random.default_rng(0).integers(0, 256, (3, *networks.sight_shape(spec)), dtype=np.uint8)
    np.testing.assert_array_equal(
        NativeLearner(spec, seed=None).encode(frames[::-1]), networks.encode(spec, frames[::-1])
    )


@pytest.mark.parametrize("name", MARKED)
def test_forward_agrees_with_numpy(name):
    spec = NetworkSpec(name=name, num_actions=6)
    learner = NativeLearner(spec, seed=None)
    randomize(learner)
    frames = np.random.default_rng(0).integers(0, 256, (3, *networks.sight_shape(spec)), dtype=np.uint8)
    observations = learner.encode(frames)
    policy, critic = (reference_tower(spec, learner.weights(), frames, tower) for tower in ("policy", "critic"))
    np.testing.assert_allclose(learner.policy(observations), policy, atol=2e-5)
    np.testing.assert_allclose(learner.values(observations, np.zeros((3, 0), np.float32)), critic[:, 0], atol=2e-5)


@pytest.mark.costly
@pytest.mark.parametrize("spec", BRANCHES, ids=name_of)
def test_every_branch_agrees_with_numpy_and_torch(spec):
    native = NativeLearner(spec, seed=None, num_threads=2)
    torch = TorchLearner(spec, seed=None, precision="float32", num_threads=1)
    randomize(native)
    torch.load_weights(native.weights())
    sight = sight_for(spec, 11)
    observations, states = native.encode(sight), np.random.default_rng(1).random((11, spec.state_size), np.float32)
    np.testing.assert_array_equal(observations, networks.encode(spec, sight))
    outputs = native.policy(observations)
    policy = reference_tower(spec, native.weights(), sight, "policy")
    np.testing.assert_allclose(outputs[:, : spec.num_actions], policy, atol=2e-5)
    np.testing.assert_allclose(outputs, torch.policy(observations), atol=2e-5)
    np.testing.assert_allclose(native.values(observations, states), torch.values(observations, states), atol=2e-5)


@pytest.mark.parametrize("spec", BRANCHES, ids=name_of)
@pytest.mark.costly
def test_gradient_of_every_branch_is_exact(spec):
    assert_exact_gradient(spec, size=19, value_loss="mse")


@pytest.mark.parametrize("spec", [BRANCHES[0], BRANCHES[3]], ids=name_of)
def test_branches_have_the_same_bits_for_any_number_of_threads(spec):
    states = []
    for num_threads in (1, 3):
        learner = NativeLearner(spec, seed=9, num_threads=num_threads)
        stats = [learner.update(minibatch_for(learner, size, seed=size), OBJECTIVE) for size in (70, 33)]
        states.append((stats, {**learner.weights(), **learner.optimizer_state()}))
    assert states[0][0] == states[1][0]
    assert_same_bits(states[0][1], states[1][1])


def test_a_policy_looks_at_both_lenses_and_at_the_lidar():
    spec = BRANCHES[3]
    learner = NativeLearner(spec, seed=None)
    randomize(learner)
    sight = sight_for(spec, 1)
    seen = learner.policy(learner.encode(sight))
    pixels = spec.frame_shape[0] * spec.frame_shape[1]
    for begin, end in ((0, pixels), (pixels, 2 * pixels), (2 * pixels, None)):
        changed = sight.copy()
        changed[:, begin:end] = 255 - changed[:, begin:end]
        assert abs(learner.policy(learner.encode(changed)) - seen).max() > 1e-3


@pytest.mark.parametrize("name", MARKED)
@pytest.mark.parametrize(("is_discrete", "state_size"), HEADS)
def test_outputs_agree_with_torch(name, is_discrete, state_size):
    spec = NetworkSpec(name=name, num_actions=3, is_discrete=is_discrete, state_size=state_size)
    native = NativeLearner(spec, seed=None)
    torch = TorchLearner(spec, seed=None, precision="float32", num_threads=1)
    randomize(native)
    torch.load_weights(native.weights())
    minibatch = minibatch_for(native, 5)
    observations, states = minibatch.observations, minibatch.states
    np.testing.assert_allclose(native.policy(observations), torch.policy(observations), atol=2e-5)
    np.testing.assert_allclose(native.values(observations, states), torch.values(observations, states), atol=2e-5)


@pytest.mark.parametrize("size", [1, 7, 33])
@pytest.mark.parametrize("value_loss", ["mse", "huber"])
@pytest.mark.parametrize(("is_discrete", "state_size"), [*HEADS, (False, 0), (True, 1)])
def test_gradient_of_the_small_network_is_exact(is_discrete, state_size, value_loss, size):
    spec = NetworkSpec(num_actions=5, is_discrete=is_discrete, state_size=state_size, frame_shape=(110, 104))
    assert_exact_gradient(spec, size=size, value_loss=value_loss)


@pytest.mark.costly
@pytest.mark.parametrize("name", MARKED[1:])
@pytest.mark.parametrize(("is_discrete", "state_size"), HEADS)
def test_gradient_of_aws_networks_is_exact(name, is_discrete, state_size):
    spec = NetworkSpec(name=name, num_actions=4, is_discrete=is_discrete, state_size=state_size)
    assert_exact_gradient(spec, size=9, value_loss="huber")


def assert_exact_gradient(spec: NetworkSpec, *, size: int, value_loss: str) -> None:
    """Against autograd in float64; samples lie on both sides of the clip range."""
    learner = NativeLearner(spec, seed=None, num_threads=2)
    randomize(learner)
    rng = np.random.default_rng(4)
    frames = rng.integers(0, 256, (size, *networks.sight_shape(spec)), dtype=np.uint8)
    minibatch = minibatch_for(learner, size)
    shift = rng.normal(0, 0.3, size).astype(np.float32)
    minibatch = dataclasses.replace(
        minibatch, observations=learner.encode(frames), log_probs=minibatch.log_probs + shift
    )
    objective = dataclasses.replace(OBJECTIVE, value_loss=value_loss, ent_coef=0.1)
    terms, expected = reference_gradient(spec, learner.weights(), frames, minibatch, objective)
    stats, gradient = gradient_of(learner, minibatch, objective)
    assert (stats.policy_loss, stats.value_loss, stats.entropy) == pytest.approx(terms, rel=1e-4, abs=1e-5)
    norm = np.sqrt(sum(float((array**2).sum()) for array in expected.values()))
    assert stats.grad_norm == pytest.approx(norm, rel=1e-5)
    for name, array in expected.items():
        difference = np.linalg.norm(gradient[name] - array)
        assert difference <= 1e-5 * np.linalg.norm(array) + 1e-6 * norm, name


@pytest.mark.parametrize(
    ("is_discrete", "state_size", "limit"),
    # a camera critic starts with large errors, whose rounding Adam makes as large as any other gradient
    [(True, 21, 1e-4), (False, 21, 1e-4), (True, 0, 1e-3)],
)
@pytest.mark.costly
def test_fifty_steps_stay_close_to_torch(is_discrete, state_size, limit):
    spec = NetworkSpec(num_actions=3, is_discrete=is_discrete, state_size=state_size)
    native, torch = NativeLearner(spec, num_threads=2), TorchLearner(spec, precision="float32", num_threads=2)
    torch.load_weights(native.weights())
    objective = dataclasses.replace(OBJECTIVE, learning_rate=1e-4)
    for step in range(50):
        minibatch = minibatch_for(native, 32, seed=step)
        expected, stats = torch.update(minibatch, objective), native.update(minibatch, objective)
        assert stats.value_loss == pytest.approx(expected.value_loss, rel=1e-3)
    ours, theirs = native.weights(), torch.weights()
    assert max(abs(ours[name] - theirs[name]).max() for name in ours) < limit


def test_eps_hat_is_added_before_the_correction_as_in_tensorflow():
    objective = dataclasses.replace(OBJECTIVE, adam_eps=1e-3, is_eps_hat=True, max_grad_norm=0.0)
    for learner in (NativeLearner(SMALL, num_threads=1), TorchLearner(SMALL, precision="float32", num_threads=1)):
        for step in (1, 2, 3):
            before = learner.weights()
            learner.update(minibatch_for(learner, 32, seed=step), objective)
            moments, after = learner.optimizer_state(), learner.weights()
            rate = objective.learning_rate * (1 - 0.999**step) ** 0.5 / (1 - 0.9**step)
            for name, array in before.items():
                moment1, moment2 = moments[f"moment1/{name}"], moments[f"moment2/{name}"]
                expected = rate * moment1 / (np.sqrt(moment2) + 1e-3)
                np.testing.assert_allclose(array - after[name], expected, rtol=1e-3, atol=1e-7, err_msg=name)


# the last one's dense layer fits no cache, so it takes portions of a minibatch, which depend on the threads
@pytest.mark.slow
@pytest.mark.parametrize(
    "spec",
    [
        SMALL,
        NetworkSpec(num_actions=2, is_discrete=False),
        NetworkSpec(name=NAMES[3], num_actions=3, frame_shape=(100, 100)),
    ],
)
def test_same_bits_for_any_number_of_threads(spec):
    results = []
    for num_threads in (1, 2, 5):
        learner = NativeLearner(spec, seed=9, num_threads=num_threads)
        batches = [minibatch_for(learner, size, seed=size) for size in (256, 200, 50)]
        stats = [learner.update(minibatch, OBJECTIVE) for minibatch in batches]
        outputs = learner.policy(batches[0].observations), learner.values(batches[0].observations, batches[0].states)
        results.append((stats, outputs, {**learner.weights(), **learner.optimizer_state()}))
    for stats, outputs, state in results[1:]:
        assert stats == results[0][0]
        assert all(a.tobytes() == b.tobytes() for a, b in zip(outputs, results[0][1], strict=True))
        assert_same_bits(state, results[0][2])


@pytest.mark.parametrize("name", MARKED)
def test_same_bits_on_every_instruction_set(name, restored_isa):
    isas = _native.available_isas()
    if name != NAMES[0]:
        isas = isas[1:]  # without the instruction a fused multiply-add is a function call: only the small network
    spec = NetworkSpec(name=name, num_actions=3, state_size=0 if name == NAMES[0] else 5)
    states = []
    for isa in isas:
        _native.set_isa(isa)
        learner = NativeLearner(spec, seed=None, num_threads=2)
        randomize(learner)
        minibatch = minibatch_for(learner, 9)
        stats = learner.update(minibatch, OBJECTIVE)
        values = learner.values(minibatch.observations, minibatch.states)
        states.append(
            (stats, {**learner.weights(), "values": values, "logits": learner.policy(minibatch.observations)})
        )
    for stats, state in states[1:]:
        assert stats == states[0][0]
        assert_same_bits(state, states[0][1])


def test_outputs_do_not_depend_on_the_batch():
    learner = NativeLearner(SMALL, num_threads=2)
    minibatch = minibatch_for(learner, 37)
    observations, states = minibatch.observations, minibatch.states
    policy, values = learner.policy(observations), learner.values(observations, states)
    for i in range(37):
        np.testing.assert_array_equal(learner.policy(observations[i : i + 1])[0], policy[i])
        np.testing.assert_array_equal(learner.values(observations[i : i + 1], states[i : i + 1])[0], values[i])
    assert learner.policy(observations[:0]).shape == (0, 5)
    assert learner.values(observations[:0], states[:0]).shape == (0,)


def test_learning_rate_zero_changes_nothing():
    for is_discrete in (True, False):
        learner = NativeLearner(dataclasses.replace(SMALL, is_discrete=is_discrete))
        before = learner.weights()
        learner.update(minibatch_for(learner), dataclasses.replace(OBJECTIVE, learning_rate=0.0))
        assert_same_bits(learner.weights(), before)


def test_every_parameter_learns():
    for spec in (NetworkSpec(num_actions=3, is_discrete=False), NetworkSpec(num_actions=3, state_size=5)):
        learner = NativeLearner(spec)
        before = learner.weights()
        for seed in range(3):
            learner.update(minibatch_for(learner, 64, seed=seed), OBJECTIVE)
        assert all(not np.array_equal(array, before[name]) for name, array in learner.weights().items())


def test_updates_lower_the_loss_on_a_fixed_batch():
    learner = NativeLearner(SMALL)
    minibatch = minibatch_for(learner)
    first, *_, last = [learner.update(minibatch, OBJECTIVE) for _ in range(6)]
    assert last.policy_loss < first.policy_loss - 0.01
    assert last.value_loss < first.value_loss
    assert abs(first.approx_kl) < 1e-6  # nothing has moved yet
    assert first.clip_fraction == 0


@pytest.mark.parametrize(
    ("field", "value"),
    [
        *(("advantages", value) for value in (np.nan, np.inf, -np.inf)),
        *(("returns", value) for value in (np.nan, np.inf, -np.inf)),
        *(("log_probs", value) for value in (np.nan, -np.inf)),
        ("states", np.nan),
    ],
)
def test_a_step_that_is_not_finite_changes_nothing(field, value):
    learner = NativeLearner(SMALL, num_threads=2)
    learner.update(minibatch_for(learner, 40), OBJECTIVE)
    before = {**learner.weights(), **learner.optimizer_state()}
    minibatch = minibatch_for(learner, 40)
    minibatch = dataclasses.replace(minibatch, advantages=-abs(minibatch.advantages))  # an unbounded loss
    array = getattr(minibatch, field).copy()
    array[17] = value
    stats = learner.update(dataclasses.replace(minibatch, **{field: array}), OBJECTIVE)
    assert not stats.is_finite
    assert_same_bits({**learner.weights(), **learner.optimizer_state()}, before)
    assert learner.update(minibatch, OBJECTIVE).is_finite  # and nothing of it stays behind


def test_huge_rewards_do_not_spoil_the_optimiser():
    learner = NativeLearner(SMALL)
    before = {**learner.weights(), **learner.optimizer_state()}
    minibatch = minibatch_for(learner, 32)
    huge = dataclasses.replace(minibatch, returns=np.full(32, 3e38, np.float32))
    assert not learner.update(huge, OBJECTIVE).is_finite
    assert_same_bits({**learner.weights(), **learner.optimizer_state()}, before)


def test_gradient_norm_is_clipped():
    learner, clipped = NativeLearner(SMALL), NativeLearner(SMALL)
    minibatch = minibatch_for(learner, 64)
    stats, gradient = gradient_of(learner, minibatch, OBJECTIVE)
    limit = stats.grad_norm / 4
    clipped.update(minibatch, dataclasses.replace(OBJECTIVE, max_grad_norm=limit))
    moments = clipped.optimizer_state()
    for name, array in gradient.items():
        np.testing.assert_allclose(moments[f"moment1/{name}"] / 0.1, array / 4, rtol=1e-4, atol=1e-9)


def test_an_update_says_how_many_ratios_were_clipped():
    learner = NativeLearner(SMALL)
    batch = minibatch_for(learner, 8)
    shifts = np.float32([0.0, 0.1, -0.1, 0.15, 0.5, -0.5, 1.0, -1.0])  # of log ratios; a clip range of 0.2
    moved = dataclasses.replace(batch, log_probs=batch.log_probs + shifts)
    objective = dataclasses.replace(OBJECTIVE, clip_coef=0.2, learning_rate=0.0)
    assert learner.update(batch, objective).clip_fraction == 0.0
    assert learner.update(moved, objective).clip_fraction == 0.5


@pytest.mark.parametrize("other", [NativeLearner, TorchLearner])
def test_saved_and_loaded_learner_continues(other):
    spec = NetworkSpec(num_actions=3, is_discrete=False, state_size=6)
    straight, saved, resumed = NativeLearner(spec, seed=1), other(spec, seed=1), NativeLearner(spec, seed=2)
    batches = [minibatch_for(straight, 48, seed=seed) for seed in range(4)]
    objective = dataclasses.replace(OBJECTIVE, learning_rate=1e-4)
    for batch in batches:
        straight.update(batch, objective)
    for batch in batches[:2]:
        saved.update(batch, objective)
    resumed.load_weights(saved.weights())
    resumed.load_optimizer_state(saved.optimizer_state())
    for batch in batches[2:]:
        resumed.update(batch, objective)
    assert resumed.optimizer_state()["step"] == 4
    if other is NativeLearner:
        assert_same_bits(resumed.weights(), straight.weights())
        assert_same_bits(resumed.optimizer_state(), straight.optimizer_state())
    for name, array in straight.weights().items():
        np.testing.assert_allclose(resumed.weights()[name], array, atol=1e-3)


def test_a_gradient_flows_through_the_weights_that_were_loaded_last():
    learner, fresh = NativeLearner(SMALL, seed=1), NativeLearner(SMALL, seed=2)
    batch = minibatch_for(learner, 8)
    # A step that is not taken leaves the weights, and what was made of them for the way back.
    learner.update(dataclasses.replace(batch, advantages=np.full(8, np.nan, np.float32)), OBJECTIVE)
    learner.load_weights(fresh.weights())
    assert_same_bits(gradient_of(learner, batch, OBJECTIVE)[1], gradient_of(fresh, batch, OBJECTIVE)[1])


@pytest.mark.costly
@pytest.mark.parametrize("name", ["RACECRAFT_SMALL", "DEEP_CONVOLUTIONAL_NETWORK_DEEP"])
def test_weights_begin_as_those_of_torch(name):
    spec = NetworkSpec(name=name, num_actions=3, is_discrete=False, state_size=6)
    native, torch = NativeLearner(spec, seed=5), TorchLearner(spec, seed=5)
    for key, array in torch.weights().items():
        np.testing.assert_allclose(native.weights()[key], array, rtol=1e-6, atol=1e-7)
    assert_same_bits(native.optimizer_state(), torch.optimizer_state())
    assert not any(array.any() for array in NativeLearner(spec, seed=None).weights().values())


def test_initial_weights_are_the_same_bits_on_every_instruction_set(restored_isa):
    results = []
    for isa in _native.available_isas():
        _native.set_isa(isa)
        results.append(NativeLearner(SMALL, seed=3).weights())
    for weights in results[1:]:
        assert_same_bits(weights, results[0])
    with pytest.raises(ValueError, match="more vectors"):
        _native.orthonormalize(np.ones((3, 2)))


def test_weights_are_copies():
    learner = NativeLearner(NetworkSpec(num_actions=4))
    learner.weights()["policy.head.bias"][:] = 7
    assert not learner.weights()["policy.head.bias"].any()


def test_arrays_may_be_views_of_any_layout():
    learner, other = NativeLearner(SMALL), NativeLearner(SMALL)
    minibatch = minibatch_for(learner, 16)
    names = [field.name for field in dataclasses.fields(minibatch) if field.name != "rows"]
    spread = {name: np.repeat(getattr(minibatch, name), 2, axis=0)[::2] for name in names}
    learner.update(minibatch, OBJECTIVE)
    other.update(dataclasses.replace(minibatch, **spread), OBJECTIVE)
    assert_same_bits(learner.weights(), other.weights())


@pytest.mark.parametrize("backend", [NativeLearner, TorchLearner])
@pytest.mark.parametrize(("is_discrete", "state_size"), HEADS)
def test_rows_choose_the_samples_of_a_minibatch(backend, is_discrete, state_size):
    spec = NetworkSpec(num_actions=3, is_discrete=is_discrete, state_size=state_size)
    learner, other = backend(spec, seed=1), backend(spec, seed=1)
    everything = minibatch_for(learner, 50)
    rows = np.random.default_rng(0).permutation(50)[:33]
    names = [field.name for field in dataclasses.fields(everything) if field.name != "rows"]
    chosen = dataclasses.replace(everything, **{name: getattr(everything, name)[rows] for name in names})
    assert learner.update(dataclasses.replace(everything, rows=rows), OBJECTIVE) == other.update(chosen, OBJECTIVE)
    assert_same_bits(learner.weights(), other.weights())


def test_it_may_be_asked_from_several_threads():
    learner = NativeLearner(SMALL, num_threads=2)
    minibatch = minibatch_for(learner, 64)
    expected = learner.policy(minibatch.observations)
    still = dataclasses.replace(OBJECTIVE, learning_rate=0.0)
    with ThreadPoolExecutor(3) as pool:
        tasks = [pool.submit(learner.policy, minibatch.observations) for _ in range(20)]
        updates = [pool.submit(learner.update, minibatch, still) for _ in range(5)]
        assert all(np.array_equal(task.result(), expected) for task in tasks)
        assert len({update.result() for update in updates}) == 1


def test_the_native_backend_is_the_default(monkeypatch):
    spec = NetworkSpec(num_actions=2)
    assert isinstance(make_learner(spec), NativeLearner)
    assert type(make_learner(spec, backend="torch")) is type(TorchLearner(spec))
    with pytest.raises(ConfigError, match="'jax'"):
        make_learner(spec, backend="jax")
    monkeypatch.delitem(sys.modules, "racecraft.learn.torch_learner")
    monkeypatch.setitem(sys.modules, "torch", None)
    with pytest.raises(ConfigError, match="not installed"):
        make_learner(spec, backend="torch")


def test_training_imports_no_torch():
    code = """
import sys
sys.modules["torch"] = None  # as if it were not installed
from racecraft.learn import PPO, NetworkSpec, PPOConfig, make_learner
from stripe_world import StripeWorld

config = PPOConfig(num_envs=8, num_steps=4, minibatch_size=16, update_epochs=1)
PPO(config, make_learner(NetworkSpec(num_actions=3, state_size=2)), StripeWorld(8)).iterate()
"""
    path = ":".join([str(Path(__file__).parent), *sys.path])
    subprocess.run([sys.executable, "-c", code], check=True, env={"PYTHONPATH": path}, timeout=300)
