"""Every kind of the original's models: our network answers as the graph does, node by node."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from aws_models import DEEP, MIDDLE, SHALLOW, AwsModel
from numpy.typing import NDArray

from racecraft.agent import ModelMetadata
from racecraft.errors import SourceError
from racecraft.importing.frozen_graph import open_frozen_graph
from racecraft.importing.policy_weights import find_tower, policy_head
from racecraft.importing.tf_bundle import TensorBundle
from racecraft.importing.weights import read_weights
from racecraft.learn import NetworkSpec, make_learner
from racecraft.learn.learner import Weights
from racecraft.learn.networks import weight_shapes
from tensorflow_graphs import GraphWriter, run_graph

MODELS = {
    "shallow": AwsModel(),
    "observation": AwsModel(sensors=("observation",)),
    "lidar before the camera": AwsModel(sensors=("observation", "LIDAR")),
    "lidar behind the camera": AwsModel(sensors=("FRONT_FACING_CAMERA", "LIDAR"), kind="continuous"),
    "sectors behind the left camera": AwsModel(sensors=("SECTOR_LIDAR", "LEFT_CAMERA")),
    "bits before the camera": AwsModel(sensors=("FRONT_FACING_CAMERA", "DISCRETIZED_SECTOR_LIDAR")),
    "two lenses": AwsModel(sensors=("STEREO_CAMERAS",)),
    "lidar before two lenses": AwsModel(sensors=("STEREO_CAMERAS", "LIDAR")),
    "continuous": AwsModel(kind="continuous"),
    "sac": AwsModel(kind="sac"),
    "sac with a lidar": AwsModel(kind="sac", sensors=("STEREO_CAMERAS", "SECTOR_LIDAR")),
    "deep": AwsModel(DEEP, num_actions=21),
    "deep and continuous": AwsModel(DEEP, kind="continuous"),
    "deep sac with a lidar": AwsModel(DEEP, kind="sac", sensors=("LEFT_CAMERA", "DISCRETIZED_SECTOR_LIDAR")),
}
LARGE = {
    "middle": AwsModel(MIDDLE),
    "middle with a lidar": AwsModel(MIDDLE, sensors=("observation", "SECTOR_LIDAR")),
    "middle with two lenses": AwsModel(MIDDLE, sensors=("STEREO_CAMERAS",), kind="sac"),
    "deep with two lenses and a lidar": AwsModel(DEEP, sensors=("STEREO_CAMERAS", "LIDAR")),
}


def spec_of(model: AwsModel, *, state_size: int = 1) -> NetworkSpec:
    metadata = ModelMetadata.from_dict(model.metadata())
    return NetworkSpec(
        name=model.network,
        num_actions=model.num_actions if model.kind == "discrete" else 2,
        is_discrete=model.kind == "discrete",
        is_squashed=model.kind == "sac",
        state_size=state_size,
        lenses=metadata.suite.lenses,
        lidar_size=metadata.suite.lidar_size,
    )


def outputs_of(weights: Weights, model: AwsModel, sight: NDArray[np.uint8]) -> NDArray[np.float64]:
    """Probabilities or means of our network."""
    spec = spec_of(model)
    learner = make_learner(spec, seed=None, num_threads=1)
    learner.load_weights({**learner.weights(), **weights})
    outputs = learner.policy(learner.encode(sight)).astype(np.float64)
    if not spec.is_discrete:
        return outputs[:, :2]
    powers = np.exp(outputs - outputs.max(1, keepdims=True))
    return np.asarray(powers / powers.sum(1, keepdims=True))


def sights(model: AwsModel, count: int) -> tuple[NDArray[np.uint8], dict[str, NDArray[np.float32]]]:
    """What the sensors tell: as our networks take it, and as the graph does."""
    rng = np.random.default_rng(7)
    spec = spec_of(model)
    squares = rng.integers(0, 256, (count, spec.lenses, 12, 16)).astype(np.uint8)
    images = squares.repeat(10, axis=2).repeat(10, axis=3)
    lidar = rng.integers(0, 256, (count, spec.lidar_size)).astype(np.uint8)
    feeds = {}
    for sensor in model.sensors:
        values = lidar / np.float32(255) if "LIDAR" in sensor else images.transpose(0, 2, 3, 1).astype(np.float32)
        feeds[model.input(sensor)] = values
    if spec.lidar_size:
        return np.concatenate([images.reshape(count, -1), lidar], axis=1), feeds
    return images if spec.lenses == 2 else images[:, 0], feeds


def check(model: AwsModel, folder: Path) -> None:
    metadata = ModelMetadata.from_dict(model.metadata())
    data = model.graph()
    (folder / "model.pb").write_bytes(data)
    with open_frozen_graph(folder / "model.pb") as graph:
        weights = read_weights(graph, spec_of(model), metadata.suite, [])
    sight, feeds = sights(model, 3)
    theirs = run_graph(data, model.output, feeds)
    assert np.ptp(theirs, axis=0).max() > 0.01  # the graph answers differently to different frames
    assert np.abs(outputs_of(weights, model, sight) - theirs).max() < 1e-5


@pytest.mark.costly
@pytest.mark.parametrize("model", MODELS.values(), ids=MODELS)
def test_our_network_answers_as_the_graph(model: AwsModel, tmp_path: Path) -> None:
    check(model, tmp_path)


@pytest.mark.slow
@pytest.mark.parametrize("model", LARGE.values(), ids=LARGE)
def test_our_network_answers_as_a_large_graph(model: AwsModel, tmp_path: Path) -> None:
    check(model, tmp_path)


@pytest.mark.costly
@pytest.mark.parametrize("kind", ["discrete", "continuous", "sac"])
def test_a_checkpoint_says_what_the_graph_does_and_more(kind: str, tmp_path: Path) -> None:
    model = AwsModel(DEEP, kind=kind)
    model.write(tmp_path, graph="model_8.pb", checkpoint="8_Step-100.ckpt")
    place = str(tmp_path / "8_Step-100.ckpt")
    bundle = TensorBundle(Path(f"{place}.index"), Path(f"{place}.data-00000-of-00001"), name="8_Step-100.ckpt")
    suite, notes = ModelMetadata.from_dict(model.metadata()).suite, list[str]()
    spec = spec_of(model, state_size=1 if kind == "sac" else 0)
    found = read_weights(bundle, spec, suite, notes)
    with open_frozen_graph(tmp_path / "model_8.pb") as graph:
        of_the_graph = read_weights(graph, spec, suite, notes)
    more = {name for name in found if not np.array_equal(found[name], of_the_graph.get(name, ()))}
    expected = {name for name in weight_shapes(spec) if name.startswith("critic.") and kind != "sac"}
    assert more == expected | ({"policy.log_std"} if kind == "continuous" else set())
    if kind == "continuous":
        assert found["policy.log_std"].tolist() == [-0.5, 0.25]
        assert of_the_graph["policy.log_std"].tolist() == [0.0, 0.0]
        assert len(notes) == 1
        assert "does not say how widely the policy explores" in notes[0]
    if kind != "sac":
        value = model.tensors()[f"{model.online}/network_0/v_values_head_0/output/kernel"]
        assert np.array_equal(found["critic.head.weight"], value.T)


def test_the_metadata_of_another_model_is_refused(tmp_path: Path) -> None:
    model = AwsModel(DEEP)
    (tmp_path / "model.pb").write_bytes(model.small_graph())
    suite = ModelMetadata.from_dict(model.metadata()).suite
    others = {
        "no policy of this kind: it has no ppo_head_0/policy_mean/kernel": AwsModel(DEEP, kind="continuous"),
        "no policy of this kind: it has no sac_policy_head_0/policy_mean/kernel": AwsModel(DEEP, kind="sac"),
        r"model\.pb chooses from 5 actions, and model_metadata\.json lists 7\.": AwsModel(DEEP, num_actions=7),
        r"has the shape \(4, 4, 32, 32\) in its FRONT_FACING_CAMERA/Conv2d_2/kernel": AwsModel(SHALLOW),
        r"has the shape \(8, 8, 1, 32\) in its FRONT_FACING_CAMERA/Conv2d_0/kernel": AwsModel(MIDDLE),
    }
    with open_frozen_graph(tmp_path / "model.pb") as graph:
        for says, other in others.items():
            with pytest.raises(SourceError, match=says) as caught:
                read_weights(graph, spec_of(other), suite, [])
            assert "model_metadata.json" in caught.value.hint
        left = ModelMetadata.from_dict(AwsModel(DEEP, sensors=("LEFT_CAMERA",)).metadata()).suite
        with pytest.raises(SourceError, match="has no LEFT_CAMERA/Conv2d_0/kernel"):
            read_weights(graph, spec_of(model), left, [])


def test_two_policies_are_none(tmp_path: Path) -> None:
    writer = GraphWriter()
    for agent in ("agent_0", "agent_1"):
        name = f"main_level/{agent}/main/online/network_1/ppo_head_0/policy_fc/kernel"
        writer.constant(name, np.zeros((512, 5), np.float32))
    (tmp_path / "model.pb").write_bytes(writer.bytes())
    with open_frozen_graph(tmp_path / "model.pb") as graph, pytest.raises(SourceError, match="holds 2 policies"):
        find_tower(graph, policy_head(spec_of(AwsModel())))


def test_a_graph_that_does_something_else_is_refused(tmp_path: Path) -> None:
    model = AwsModel(DEEP)
    data, suite = model.graph(), ModelMetadata.from_dict(model.metadata()).suite
    for other, says in (
        (
            data.replace(b"\x12\x04Relu", b"\x12\x04Tanh", 1),
            r"has a 'Tanh' as its FRONT_FACING_CAMERA/Batchnorm\w+_1_activ",
        ),
        (
            data.replace(b"\x12\x07Softmax", b"\x12\x07Sigmoid"),
            "has a 'Sigmoid' as its ppo_head_0/policy, expected a Softm",
        ),
        (data.replace(b"ppo_head_0/policy\x12", b"ppo_head_0/somethi\x12"), "damaged|has no ppo_head_0/policy"),
    ):
        assert other != data
        (tmp_path / "model.pb").write_bytes(other)
        with pytest.raises(SourceError, match=says), open_frozen_graph(tmp_path / "model.pb") as graph:
            read_weights(graph, spec_of(model), suite, [])


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_numbers_that_are_none_are_refused(value: float, tmp_path: Path) -> None:
    model = AwsModel(DEEP)
    tensors = model.tensors()
    tensors[f"{model.policy}/ppo_head_0/policy_fc/bias"][3] = value
    (tmp_path / "model.pb").write_bytes(model.graph(tensors))
    suite = ModelMetadata.from_dict(model.metadata()).suite
    with open_frozen_graph(tmp_path / "model.pb") as graph, pytest.raises(SourceError, match="not finite"):
        read_weights(graph, spec_of(model), suite, [])
