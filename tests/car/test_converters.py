"""What cars run: the graph through TensorFlow, OpenVINO and TFLite, where they are installed.

    .venv/bin/pip install tensorflow-cpu openvino

They are some 1 GB, so neither an extra nor the development set-up brings them.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from test_export import trained
from test_policy_graph import AWS_MODEL, FRONT, OLD, REAL, SHALLOW, SMALL, answers, fed, made, suite_and_spec

from racecraft.agent.sensor_suite import SensorSuite
from racecraft.car import export_run
from racecraft.car.converters import openvino_model, tflite_model
from racecraft.car.policy_graph import policy_graph, policy_output
from racecraft.importing.frozen_graph import open_frozen_graph
from racecraft.importing.weights import read_weights
from racecraft.learn import Learner, NetworkSpec, make_learner
from real_frames import floor_frames, simulated_frames

Feeds = dict[str, NDArray[np.float32]]
pytestmark = [REAL, pytest.mark.slow, pytest.mark.filterwarnings("ignore")]


def tensorflow(graph: bytes, output: str, feeds: Feeds, folder: Path) -> NDArray[np.float32]:
    tf = pytest.importorskip("tensorflow", reason="TensorFlow is not installed")
    definition = tf.compat.v1.GraphDef()
    definition.ParseFromString(graph)
    with tf.Graph().as_default():
        tf.import_graph_def(definition, name="")
        with tf.compat.v1.Session() as session:
            return np.asarray(session.run(f"{output}:0", {f"{name}:0": array for name, array in feeds.items()}))


def openvino(graph: bytes, output: str, feeds: Feeds, folder: Path) -> NDArray[np.float32]:
    """As a car of x86 does: weights in FP16."""
    ov = pytest.importorskip("openvino", reason="OpenVINO is not installed")
    xml, weights = openvino_model(graph)
    (folder / "model.xml").write_bytes(xml)
    (folder / "model.bin").write_bytes(weights)
    model = ov.Core().read_model(folder / "model.xml")
    assert [out.any_name for out in model.outputs] == [f"{output}:0"]
    compiled = ov.Core().compile_model(model, "CPU", {"INFERENCE_PRECISION_HINT": "f32"})
    given = {name: feeds[name.removesuffix(":0")] for name in (source.any_name for source in model.inputs)}
    return np.asarray(next(iter(compiled(given).values())))


def tflite(graph: bytes, output: str, feeds: Feeds, folder: Path) -> NDArray[np.float32]:
    """As a car with a Raspberry Pi does: weights in FP16."""
    tf: Any = pytest.importorskip("tensorflow", reason="TensorFlow is not installed")
    converted = tflite_model(graph, list(feeds), output)
    interpreter = tf.lite.Interpreter(model_content=converted, num_threads=1)
    places = {name: part["index"] for part in interpreter.get_input_details() for name in feeds if name in part["name"]}
    for name, place in places.items():
        interpreter.resize_tensor_input(place, feeds[name].shape)
    interpreter.allocate_tensors()
    for name, place in places.items():
        interpreter.set_tensor(place, feeds[name])
    interpreter.invoke()
    return np.asarray(interpreter.get_tensor(interpreter.get_output_details()[0]["index"]))


@pytest.mark.parametrize(
    ("network", "sensors", "kind"),
    [
        (SMALL, (FRONT,), "discrete"),
        (SMALL, (FRONT,), "sac"),
        (SMALL, (OLD, "LIDAR"), "continuous"),
        (SHALLOW, (FRONT,), "discrete"),
    ],
)
@pytest.mark.parametrize(("run", "within"), [(tensorflow, 1e-5), (openvino, 5e-3), (tflite, 5e-3)])
def test_it_gives_the_same_choice_on_every_real_picture(
    run: Callable[..., NDArray[np.float32]],
    within: float,
    network: str,
    sensors: tuple[str, ...],
    kind: str,
    tmp_path: Path,
) -> None:
    suite, spec = suite_and_spec(network, sensors, kind)
    sight = np.concatenate([simulated_frames(), floor_frames()])
    if suite.lidar_name:
        rays = np.random.default_rng(1).integers(0, 256, (len(sight), suite.lidar_size), np.uint8)
        sight = np.concatenate([sight.reshape(len(sight), -1), rays], axis=1)
    compare(made(spec, sight), suite, sight, run, within, tmp_path)


@pytest.mark.parametrize(("run", "within"), [(tensorflow, 1e-5), (openvino, 1e-3), (tflite, 1e-3)])
def test_what_aws_trained_goes_through_as_well(
    run: Callable[..., NDArray[np.float32]], within: float, tmp_path: Path
) -> None:
    suite, spec = SensorSuite(), NetworkSpec(name=SHALLOW, num_actions=12, state_size=1)
    learner = make_learner(spec, seed=None, num_threads=1)
    with open_frozen_graph(AWS_MODEL) as tensors:
        learner.load_weights({**learner.weights(), **read_weights(tensors, spec, suite, [])})
    frames = np.concatenate([simulated_frames(), floor_frames()])
    compare(learner, suite, frames, run, within, tmp_path)


def compare(
    learner: Learner,
    suite: SensorSuite,
    sight: NDArray[np.uint8],
    run: Callable[..., NDArray[np.float32]],
    within: float,
    folder: Path,
) -> None:
    spec = learner.spec
    graph = policy_graph(learner.weights(), spec, suite)
    ours, theirs = answers(learner, sight), run(graph, policy_output(spec), fed(spec, suite, sight), folder)
    np.testing.assert_allclose(theirs, ours, atol=within)
    if spec.is_discrete:
        assert (theirs.argmax(1) == ours.argmax(1)).all()


@pytest.mark.parametrize(
    ("to", "module", "endings"), [("tflite", "tensorflow", [".tflite"]), ("openvino", "openvino", [".xml", ".bin"])]
)
def test_a_run_s_model_lies_beside_its_files(to: str, module: str, endings: list[str], tmp_path: Path) -> None:
    pytest.importorskip(module, reason=f"{module} is not installed")
    run = trained(tmp_path, name="floor")
    exported = export_run(run, to=to)
    files = [run / f"floor{ending}" for ending in endings]
    assert exported.file == files[0]
    assert exported.size == sum(file.stat().st_size for file in files)
    onnx = export_run(run, to="onnx").size
    assert 0.4 * onnx < exported.size < 0.8 * onnx  # FP16
