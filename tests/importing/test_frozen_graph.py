"""Frozen graphs: what AWS trained drives here as it did there."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from racecraft.agent import ModelMetadata
from racecraft.agent.sensor_suite import SensorSuite
from racecraft.errors import SourceError
from racecraft.importing.frozen_graph import open_frozen_graph
from racecraft.importing.policy_weights import policy_weights
from racecraft.learn import NetworkSpec, make_learner
from real_frames import simulated_frames
from tensorflow_graphs import GraphWriter, attribute, bytes_field, number, run_graph, shape_message

SHARED = Path(__file__).parents[3] / "shared"
AWS_MODEL = SHARED / "aws_model"
ONLINE = "main_level/agent/main/online"
SHALLOW = "DEEP_CONVOLUTIONAL_NETWORK_SHALLOW"


@pytest.mark.costly
@pytest.mark.skipif(not AWS_MODEL.is_dir(), reason="the models are not in the repository")
@pytest.mark.parametrize("name", ["model_30.pb", "model_48.pb"])
def test_probabilities_are_those_of_the_graph(name: str) -> None:
    metadata = ModelMetadata.load(AWS_MODEL / "model_metadata.json")
    frames = simulated_frames()
    assert len(frames) == 467
    spec = NetworkSpec(name=metadata.neural_network, num_actions=metadata.action_space.size)
    learner = make_learner(spec, seed=None, num_threads=1)
    with open_frozen_graph(AWS_MODEL / name) as graph:
        learner.load_weights({**learner.weights(), **policy_weights(graph, spec, metadata.suite)})
    data = (AWS_MODEL / name).read_bytes()
    camera = f"{ONLINE}/network_0/FRONT_FACING_CAMERA/FRONT_FACING_CAMERA"
    difference, choices = 0.0, set()
    for i in range(0, len(frames), 64):
        batch = frames[i : i + 64]
        logits = learner.policy(learner.encode(batch)).astype(np.float64)
        ours = np.exp(logits - logits.max(1, keepdims=True))
        ours /= ours.sum(1, keepdims=True)
        seen = {camera: batch[..., None].astype(np.float32)}
        theirs = run_graph(data, f"{ONLINE}/network_1/ppo_head_0/policy", seen)
        difference = max(difference, float(np.abs(ours - theirs).max()))
        choices |= set(theirs.argmax(1).tolist())
    assert difference <= 1e-5
    assert len(choices) > 3  # the frames tell the policy different things


def test_the_metadata_of_another_model_is_refused(tmp_path: Path) -> None:
    writer = GraphWriter()
    writer.constant(f"{ONLINE}/network_1/ppo_head_0/policy_fc/kernel", np.zeros((512, 5), np.float32))
    (tmp_path / "model.pb").write_bytes(writer.bytes())
    suite = SensorSuite()
    with open_frozen_graph(tmp_path / "model.pb") as graph:
        spec = NetworkSpec(name=SHALLOW, num_actions=2, is_discrete=False)
        with pytest.raises(SourceError, match="no policy of this kind: it has no ppo_head_0/policy_mean/kernel"):
            policy_weights(graph, spec, suite)
        with pytest.raises(SourceError, match="has no FRONT_FACING_CAMERA/Conv2d_0/kernel, expected"):
            policy_weights(graph, NetworkSpec(name=SHALLOW, num_actions=5), suite)


def test_a_single_number_fills_a_constant(tmp_path: Path) -> None:
    tensor = number(1, 1) + bytes_field(2, shape_message((3, 4))) + bytes_field(5, np.float32(2.5).tobytes())
    writer = GraphWriter()
    writer.node("filled", "Const", value=bytes_field(8, tensor), dtype=number(6, 1))
    (tmp_path / "model.pb").write_bytes(writer.bytes())
    with open_frozen_graph(tmp_path / "model.pb") as graph:
        assert graph.read("filled").tolist() == [[2.5] * 4] * 3


HOSTILE = {
    "nothing": (b"", "has 0 bytes"),
    "text": (b"graph", "wire type 7"),
    "zeros": (b"\x00" * 1000, "a field has the number 0"),
    "a number without an end": (b"\x08" + b"\xff" * 20, "a number does not end"),
    "a group": (b"\x0b" * 100_000, "wire type 3"),
    "no nodes": (bytes_field(4, number(1, 134)), "it has no nodes"),
    "more than there is": (b"\x0a\xff\xff\xff\xff\x7f", "34,359,738,367 bytes are announced"),
    "a million fields": (number(9, 1) * 1_000_000, "more fields than a model has"),
    "nodes of one name": (bytes_field(1, bytes_field(1, "a")) * 2, "not one each"),
    "a huge constant": (
        bytes_field(
            1,
            bytes_field(1, "a")
            + bytes_field(2, "Const")
            + attribute("value", bytes_field(8, number(1, 1) + bytes_field(2, shape_message((1 << 40, 1 << 40))))),
        ),
        "a constant has the shape",
    ),
}


@pytest.mark.parametrize(("data", "says"), HOSTILE.values(), ids=HOSTILE)
def test_a_hostile_graph_is_one_sentence(data: bytes, says: str, tmp_path: Path) -> None:
    (tmp_path / "model.pb").write_bytes(data)
    with pytest.raises(SourceError) as caught, open_frozen_graph(tmp_path / "model.pb"):
        pass
    assert says in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.costly
@pytest.mark.skipif(not AWS_MODEL.is_dir(), reason="the models are not in the repository")
def test_awss_networks_began_with_glorot_weights() -> None:
    """After thirty iterations most weights are about where they began; orthogonal ones of conv1 are six times those."""
    metadata = ModelMetadata.load(AWS_MODEL / "model_metadata.json")
    spec = NetworkSpec(name=metadata.neural_network, num_actions=metadata.action_space.size)
    with open_frozen_graph(AWS_MODEL / "model_30.pb") as graph:
        trained = policy_weights(graph, spec, metadata.suite)
    begun = make_learner(spec, seed=3, initial_weights="glorot", num_threads=1).weights()
    for name in (f"policy.{layer}.weight" for layer in ("conv1", "conv2", "conv3", "dense1", "head")):
        theirs, ours = (np.quantile(abs(weights[name]), (0.25, 0.5, 0.75)) for weights in (trained, begun))
        np.testing.assert_allclose(ours, theirs, rtol=0.1, err_msg=name)
