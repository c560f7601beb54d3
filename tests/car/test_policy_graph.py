"""The graph that a car gets answers as the network that was trained, node by node, by a reading of its bytes that
shares no code with their writing."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from racecraft.agent.sensor_suite import SensorSuite
from racecraft.car.policy_graph import policy_graph, policy_output, sensor_input
from racecraft.importing.frozen_graph import open_frozen_graph
from racecraft.importing.weights import read_weights
from racecraft.learn import Learner, NetworkSpec
from racecraft.learn.learner import Weights
from racecraft.learn.networks import weight_shapes
from racecraft.race.seeing import learner_of
from real_frames import SHARED, floor_frames, simulated_frames
from tensorflow_graphs import parse_graph, run_graph

AWS_MODEL = SHARED / "aws_model" / "model_48.pb"
SEES, SMALL, SHALLOW, MIDDLE, DEEP = (
    "PERCEPTION",
    "RACECRAFT_SMALL",
    "DEEP_CONVOLUTIONAL_NETWORK_SHALLOW",
    "DEEP_CONVOLUTIONAL_NETWORK",
    "DEEP_CONVOLUTIONAL_NETWORK_DEEP",
)
KINDS = ("discrete", "continuous", "sac")
FRONT, LEFT, OLD, STEREO = "FRONT_FACING_CAMERA", "LEFT_CAMERA", "observation", "STEREO_CAMERAS"
QUICK = [
    (SMALL, (FRONT,), "discrete"),
    (SMALL, (FRONT,), "continuous"),
    (SMALL, (FRONT,), "sac"),
    (SMALL, (STEREO, "SECTOR_LIDAR"), "sac"),
    (SMALL, (FRONT, "LIDAR"), "discrete"),
    (SMALL, (OLD, "LIDAR"), "continuous"),
    (SHALLOW, (FRONT,), "discrete"),
    (SHALLOW, (LEFT, "SECTOR_LIDAR"), "sac"),
    (SHALLOW, (STEREO, "LIDAR"), "continuous"),
    (DEEP, (FRONT,), "discrete"),
    (DEEP, (OLD, "LIDAR"), "sac"),
    (SEES, (FRONT,), "discrete"),
    (SEES, (OLD, "LIDAR"), "continuous"),
    (SEES, (FRONT,), "sac"),
]
LARGE = [(MIDDLE, (FRONT,), "discrete"), (MIDDLE, (STEREO,), "sac"), (DEEP, (STEREO, "LIDAR"), "continuous")]
TOLERANCES = {SMALL: 1e-5, SHALLOW: 1e-5, SEES: 1e-3}
"""A level of brightness, or a byte, that lies just between two comes out as either."""
REAL = pytest.mark.skipif(not SHARED.is_dir(), reason="the pictures are not in the repository")


def suite_and_spec(network: str, sensors: tuple[str, ...], kind: str) -> tuple[SensorSuite, NetworkSpec]:
    suite = SensorSuite(sensors)
    return suite, NetworkSpec(
        name=network,
        num_actions=7 if kind == "discrete" else 2,
        is_discrete=kind == "discrete",
        is_squashed=kind == "sac",
        state_size=1,
        lenses=suite.lenses,
        lidar_size=suite.lidar_size,
    )


def made(spec: NetworkSpec, sight: NDArray[np.uint8], *, seed: int = 3) -> Learner:
    """A network to which these pictures tell different things: each output's mean over them is 0, its deviation 1."""
    is_large, rng = spec.name in (MIDDLE, DEEP), np.random.default_rng(seed)
    learner = learner_of(spec, seed=None if is_large else seed, num_threads=1)
    weights = {} if is_large else learner.weights()
    for name, shape in weight_shapes(spec).items():
        if name.endswith(".bias"):
            weights[name] = np.float32(0.05) * rng.standard_normal(shape, np.float32)
        elif is_large:  # nearly orthogonal, and there at once
            weights[name] = np.float32((2.0 / np.prod(shape[1:])) ** 0.5) * rng.standard_normal(shape, np.float32)
    learner.load_weights(weights)
    outputs = learner.policy(learner.encode(sight))[:, : spec.num_actions]
    scale = 1 / outputs.std(axis=0)
    weights["policy.head.weight"] *= scale[:, None]
    weights["policy.head.bias"] = (weights["policy.head.bias"] - outputs.mean(axis=0)) * scale
    learner.load_weights(weights)
    return learner


def answers(learner: Learner, sight: NDArray[np.uint8]) -> NDArray[np.float64]:
    """Probabilities, or two numbers within ±1 before a car clips them."""
    outputs = learner.policy(learner.encode(sight)).astype(np.float64)
    if not learner.spec.is_discrete:
        means = outputs[:, :2]
        return np.tanh(means) if learner.spec.is_squashed else means
    powers = np.exp(outputs - outputs.max(1, keepdims=True))
    return np.asarray(powers / powers.sum(1, keepdims=True))


def fed(spec: NetworkSpec, suite: SensorSuite, sight: NDArray[np.uint8]) -> dict[str, NDArray[np.float32]]:
    """The same as a car hands it to a graph: grey 0 to 255, lenses last, distances in metres."""
    count, size = len(sight), spec.lenses * 120 * 160
    flat = sight.reshape(count, -1).astype(np.float32)
    feeds = {
        sensor_input(spec, suite.camera_name): flat[:, :size]
        .reshape(count, spec.lenses, 120, 160)
        .transpose(0, 2, 3, 1)
    }
    if suite.lidar_name:
        feeds[sensor_input(spec, suite.lidar_name)] = flat[:, size:] / 255
    return feeds


def check(network: str, sensors: tuple[str, ...], kind: str, *, count: int = 6) -> None:
    (suite, spec), rng = suite_and_spec(network, sensors, kind), np.random.default_rng(7)
    blocks = rng.integers(0, 256, (count, spec.lenses, 40, 40)).astype(np.uint8).repeat(3, axis=2).repeat(4, axis=3)
    noisy = np.clip(blocks + rng.integers(-3, 4, blocks.shape), 0, 255).astype(np.uint8)  # pooling has to round
    lidar = rng.integers(0, 256, (count, spec.lidar_size)).astype(np.uint8)
    sight = noisy.reshape(count, 120, 160) if spec.lenses == 1 else noisy
    if suite.lidar_name:
        sight = np.concatenate([noisy.reshape(count, -1), lidar], axis=1)
    learner = made(spec, sight)
    graph = policy_graph(learner.weights(), spec, suite)
    ours, theirs = answers(learner, sight), run_graph(graph, policy_output(spec), fed(spec, suite, sight))
    assert theirs.shape == ours.shape
    assert np.ptp(ours, axis=0).max() > 0.05, "the pictures tell the network nothing"
    # what comes through seven layers of random weights is scaled up a hundredfold, and so is the last bit of it
    np.testing.assert_allclose(theirs, ours, atol=TOLERANCES.get(network, 2e-4))


@pytest.mark.costly
@pytest.mark.parametrize(("network", "sensors", "kind"), QUICK)
def test_the_graph_answers_as_the_network(network: str, sensors: tuple[str, ...], kind: str) -> None:
    check(network, sensors, kind)


@pytest.mark.slow
@pytest.mark.parametrize(("network", "sensors", "kind"), LARGE)
def test_a_large_graph_answers_as_the_network(network: str, sensors: tuple[str, ...], kind: str) -> None:
    check(network, sensors, kind, count=2)


@pytest.mark.costly
@REAL
@pytest.mark.parametrize(
    ("network", "kind"), [(SMALL, "discrete"), (SMALL, "continuous"), (SHALLOW, "discrete"), (SEES, "discrete")]
)
def test_real_pictures_get_the_same_answer(network: str, kind: str) -> None:
    suite, spec = suite_and_spec(network, (FRONT,), kind)
    frames = np.concatenate([simulated_frames(), floor_frames()])
    assert len(frames) == 529
    learner = made(spec, frames)
    graph = policy_graph(learner.weights(), spec, suite)
    ours = answers(learner, frames)
    theirs = np.concatenate(
        [run_graph(graph, policy_output(spec), fed(spec, suite, frames[i : i + 64])) for i in range(0, len(frames), 64)]
    )
    np.testing.assert_allclose(theirs, ours, atol=TOLERANCES[network])
    if kind == "discrete":
        assert (theirs.argmax(1) == ours.argmax(1)).all()
        assert len(set(ours.argmax(1).tolist())) > 2


@pytest.mark.parametrize(("network", "sensors", "kind"), QUICK)
def test_a_converter_finds_one_output_and_an_input_for_each_sensor(
    network: str, sensors: tuple[str, ...], kind: str
) -> None:
    suite, spec = suite_and_spec(network, sensors, kind)
    nodes = parse_graph(policy_graph(learner_of(spec, seed=None, num_threads=1).weights(), spec, suite))
    used = {source for node in nodes.values() for source in node.inputs}
    agent = "policy" if kind == "sac" else "main"
    heads = {"sac": "network_0/sac_policy_head_0"}.get(kind, "network_1/ppo_head_0")
    assert set(nodes) - used == {f"main_level/agent/{agent}/online/{heads}/policy"}
    assert used <= set(nodes)
    assert {name for name, node in nodes.items() if node.operation == "Placeholder"} == {
        f"main_level/agent/{agent}/online/network_0/{sensor}/{sensor}" for sensor in sensors
    }
    assert all("dtype" in node.attributes or node.attributes["T"] == {6: 1} for node in nodes.values())


@REAL
def test_layers_are_called_as_in_a_graph_of_aws(tmp_path: Path) -> None:
    suite = SensorSuite()
    spec = NetworkSpec(name=SHALLOW, num_actions=12, state_size=1)
    theirs = parse_graph(AWS_MODEL.read_bytes())
    with open_frozen_graph(AWS_MODEL) as tensors:
        weights: Weights = read_weights(tensors, spec, suite, [])
        path = tmp_path / "model.pb"
        path.write_bytes(policy_graph(weights, spec, suite))
        with open_frozen_graph(path) as again:
            for name, shape in again.shapes.items():
                if name.endswith(("/kernel", "/bias")):
                    assert tensors.shapes[name] == shape
                    assert np.array_equal(tensors.read(name), again.read(name))
    ours = parse_graph(path.read_bytes())
    ends = ("/kernel", "/bias", "/Conv2D", "/MatMul", "/BiasAdd", "_activation", "/policy")
    named = {name for name, node in ours.items() if name.endswith(ends) or node.operation == "Placeholder"}
    assert len(named) > 20
    assert named <= set(theirs)
    assert {name: ours[name].operation for name in named} == {name: theirs[name].operation for name in named}
