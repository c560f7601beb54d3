"""The ONNX model answers as the network, by a reading of its bytes that shares no code with their writing."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray
from test_policy_graph import (
    DEEP,
    FRONT,
    LEFT,
    OLD,
    REAL,
    SEES,
    SHALLOW,
    SMALL,
    STEREO,
    TOLERANCES,
    answers,
    fed,
    made,
    suite_and_spec,
)

from racecraft.car.policy_graph import policy_onnx, policy_output
from real_frames import floor_frames, simulated_frames
from tensorflow_graphs import fields

Arrays = dict[str, NDArray[Any]]
MODELS = [
    (SMALL, (FRONT,), "discrete"),
    (SMALL, (STEREO, "SECTOR_LIDAR"), "sac"),
    (SMALL, (OLD, "LIDAR"), "continuous"),
    (SHALLOW, (LEFT, "SECTOR_LIDAR"), "sac"),
    (DEEP, (FRONT,), "discrete"),
    (SEES, (FRONT, "LIDAR"), "continuous"),
]


def several(message: bytes, number: int) -> list[Any]:
    return [value for field, value in fields(message) if field == number]


def number_of(message: bytes) -> NDArray[Any]:
    """A TensorProto."""
    (kind,), (data,) = several(message, 2), several(message, 9)
    return np.frombuffer(data, {1: "<f4", 7: "<i8"}[kind]).reshape(several(message, 1))


def settings_of(node: bytes) -> dict[str, Any]:
    """Whole numbers and lists of them."""
    found = {}
    for attribute in several(node, 5):
        (name,), (kind,) = several(attribute, 1), several(attribute, 20)
        if kind == 2:
            (value,) = several(attribute, 3)
            found[name.decode()] = value - (1 << 64) if value >> 63 else value
        else:
            assert kind == 7
            (packed,) = several(attribute, 8)
            found[name.decode()] = list(packed)  # all below 128: a byte each
    return found


def run_onnx(model: bytes, feeds: Arrays) -> Arrays:
    """Every value of a model, in the order of its nodes; only what is an output is to be used."""
    (graph,) = several(model, 7)
    assert several(several(model, 8)[0], 2) == [13]
    inputs = {several(one, 1)[0].decode() for one in several(graph, 11)}
    assert inputs == set(feeds)
    values: Arrays = {several(tensor, 8)[0].decode(): number_of(tensor) for tensor in several(graph, 5)}
    values |= feeds
    for node in several(graph, 1):
        (name,), (operation,) = several(node, 2), several(node, 4)
        assert name.decode() not in values
        given = [values[source.decode()] for source in several(node, 1)]
        values[name.decode()] = compute(operation.decode(), given, settings_of(node))
    return {several(one, 1)[0].decode(): values[several(one, 1)[0].decode()] for one in several(graph, 12)}


def compute(operation: str, given: list[NDArray[Any]], settings: dict[str, Any]) -> NDArray[Any]:
    if operation == "Conv":  # images (N, C, H, W), kernels (filters, C, rows, columns)
        side, (stride, _) = given[1].shape[2], settings["strides"]
        windows = sliding_window_view(given[0], (side, side), axis=(2, 3))[:, :, ::stride, ::stride]
        return np.einsum("nchwij,fcij->nfhw", windows, given[1], optimize=True)
    if operation == "AveragePool":
        rows, columns = settings["kernel_shape"]
        assert settings["strides"] == [rows, columns]
        count, channels, height, width = given[0].shape
        squares = given[0].reshape(count, channels, height // rows, rows, width // columns, columns)
        return squares.mean(axis=(3, 5), dtype=np.float32)
    if operation == "Slice":
        (start,), (end,), (axis,) = (part.tolist() for part in given[1:])
        return given[0][tuple(slice(start, end) if i == axis else slice(None) for i in range(given[0].ndim))]
    if operation == "Softmax":
        assert settings["axis"] == -1
        powers = np.exp(given[0] - given[0].max(-1, keepdims=True))
        return powers / powers.sum(-1, keepdims=True)
    if operation == "Concat":
        return np.concatenate(given, axis=settings["axis"])
    if operation == "Transpose":
        return given[0].transpose(settings["perm"])
    if operation == "Reshape":
        return given[0].reshape(given[1].tolist())
    plain = {"Add": np.add, "Div": np.divide, "MatMul": np.matmul, "Floor": np.floor, "Tanh": np.tanh}
    plain |= {
        "Sub": np.subtract,
        "Mul": np.multiply,
        "Sqrt": np.sqrt,
        "Sign": np.sign,
        "Max": np.maximum,
        "Min": np.minimum,
    }
    plain |= {"Identity": np.positive, "Relu": lambda values: np.maximum(values, 0)}
    return np.asarray(plain[operation](*given))


def check(network: str, sensors: tuple[str, ...], kind: str, sight: NDArray[np.uint8]) -> None:
    suite, spec = suite_and_spec(network, sensors, kind)
    if suite.lidar_name:
        rays = np.random.default_rng(1).integers(0, 256, (len(sight), suite.lidar_size), np.uint8)
        sight = np.concatenate([sight.reshape(len(sight), -1), rays], axis=1)
    learner = made(spec, sight)
    results = run_onnx(policy_onnx(learner.weights(), spec, suite), dict(fed(spec, suite, sight)))
    assert list(results) == [policy_output(spec)]
    ours, (theirs,) = answers(learner, sight), results.values()
    np.testing.assert_allclose(theirs, ours, atol=TOLERANCES.get(network, 2e-4))
    if kind == "discrete" and network in (SMALL, SEES):
        assert (theirs.argmax(1) == ours.argmax(1)).all()


@pytest.mark.costly
@pytest.mark.parametrize(("network", "sensors", "kind"), MODELS)
def test_the_model_answers_as_the_network(network: str, sensors: tuple[str, ...], kind: str) -> None:
    shape = (5, 2, 40, 40) if STEREO in sensors else (5, 40, 40)
    blocks = np.random.default_rng(7).integers(0, 250, shape).astype(np.uint8).repeat(3, axis=-2).repeat(4, axis=-1)
    check(network, sensors, kind, blocks + np.random.default_rng(8).integers(0, 5, blocks.shape, np.uint8))


@REAL
@pytest.mark.parametrize("network", [SMALL, SEES])
def test_real_pictures_get_the_same_choice(network: str) -> None:
    check(network, (FRONT,), "discrete", np.concatenate([simulated_frames(), floor_frames()]))
