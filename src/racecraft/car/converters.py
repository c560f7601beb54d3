"""What a car makes of the graph that it is given, by the libraries with which cars make it; weights in FP16.

    graph -> *tflite_model*    cars with a Raspberry Pi
    graph -> *openvino_model*  cars with an x86

Neither library comes with Racecraft: together they are some 1 GB.
"""

from __future__ import annotations

import importlib
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

from racecraft.errors import ConfigError

PACKAGES: Final = {"tensorflow": "tensorflow-cpu", "openvino": "openvino"}
"""What brings each module."""


def tflite_model(graph: bytes, inputs: Sequence[str], output: str) -> bytes:
    """The content of a ``.tflite`` file; one picture at a time, or as many as its input is made for.

    Args:
        graph: Of `racecraft.car.policy_graph`.
        inputs: Names of its placeholders.
        output: Name of what it gives.

    Raises:
        ConfigError: TensorFlow is not installed.
    """
    tf = _library("tensorflow", "A TFLite model")
    definition = tf.compat.v1.GraphDef()
    definition.ParseFromString(graph)
    with tf.Graph().as_default() as loaded:
        tf.import_graph_def(definition, name="")
        sources = [loaded.get_tensor_by_name(f"{name}:0") for name in inputs]
        converter = tf.compat.v1.lite.TFLiteConverter(definition, sources, [loaded.get_tensor_by_name(f"{output}:0")])
        converter.optimizations = [tf.lite.Optimize.DEFAULT]
        converter.target_spec.supported_types = [tf.float16]
        return bytes(converter.convert())


def openvino_model(graph: bytes) -> tuple[bytes, bytes]:
    """The contents of a ``.xml`` and a ``.bin`` file.

    Args:
        graph: Of `racecraft.car.policy_graph`.

    Raises:
        ConfigError: OpenVINO is not installed.
    """
    ov = _library("openvino", "An OpenVINO model")
    with tempfile.TemporaryDirectory() as folder:
        source, model = Path(folder, "model.pb"), Path(folder, "model.xml")
        source.write_bytes(graph)
        ov.save_model(ov.convert_model(source), model, compress_to_fp16=True)
        return model.read_bytes(), model.with_suffix(".bin").read_bytes()


def _library(name: str, what: str) -> Any:
    try:
        return importlib.import_module(name)
    except ModuleNotFoundError as error:
        if error.name != name:
            raise
        raise ConfigError(
            f"{what} needs {name}, which is not installed.",
            hint=f"pip install {PACKAGES[name]}, or in a checkout: .venv/bin/pip install {PACKAGES[name]}",
        ) from error
