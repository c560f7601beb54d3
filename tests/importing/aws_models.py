"""Models as the original's trainer writes them, with weights of ours: names, graph and checkpoint, from its layers."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from tensorflow_bundles import write_checkpoint

from racecraft.importing.crc32c import crc32c
from tensorflow_graphs import GraphWriter, bytes_field, number, shape_message

SHALLOW = "DEEP_CONVOLUTIONAL_NETWORK_SHALLOW"
MIDDLE = "DEEP_CONVOLUTIONAL_NETWORK"
DEEP = "DEEP_CONVOLUTIONAL_NETWORK_DEEP"
LAYERS = {  # convolutions, dense layers before the flattening, dense layers after it
    SHALLOW: ([(32, 8, 4), (64, 4, 2), (64, 3, 1)], [], [512]),
    MIDDLE: ([(32, 5, 2), (32, 3, 1), (64, 3, 2), (64, 3, 1)], [64], [512]),
    DEEP: ([(32, 8, 4), (32, 4, 2), (64, 4, 2), (64, 3, 1)], [512, 512], [256, 128]),
}
STEREO = [(32, 3, 1), (64, 3, 2), (64, 3, 1), (128, 3, 2), (128, 3, 1)]
LIDARS = {"LIDAR": 64, "SECTOR_LIDAR": 8, "DISCRETIZED_SECTOR_LIDAR": 64}

Arrays = dict[str, NDArray[np.float32]]


@dataclass(frozen=True)
class AwsModel:
    """One model."""

    network: str = SHALLOW
    sensors: tuple[str, ...] = ("FRONT_FACING_CAMERA",)
    kind: str = "discrete"  # or continuous, or sac
    num_actions: int = 5
    seed: int = 1

    @property
    def online(self) -> str:
        return f"main_level/agent/{'policy' if self.kind == 'sac' else 'main'}/online"

    @property
    def output(self) -> str:
        return f"{self.policy}/{'sac_policy_head_0' if self.kind == 'sac' else 'ppo_head_0'}/policy"

    @property
    def policy(self) -> str:
        return f"{self.online}/network_{0 if self.kind == 'sac' else 1}"

    def input(self, sensor: str) -> str:
        return f"{self.online}/network_0/{sensor}/{sensor}"

    def metadata(self) -> dict[str, object]:
        space: object = {"steering_angle": {"low": -30, "high": 30}, "speed": {"low": 0.5, "high": 2}}
        if self.kind == "discrete":
            angles = np.linspace(-30, 30, self.num_actions).tolist()
            space = [{"steering_angle": angle, "speed": 1.0} for angle in angles]
        return {
            "action_space": space,
            "sensor": list(self.sensors),
            "neural_network": self.network,
            "training_algorithm": "sac" if self.kind == "sac" else "clipped_ppo",
            "action_space_type": "discrete" if self.kind == "discrete" else "continuous",
            "version": "5",
        }

    def shapes(self) -> dict[str, tuple[int, ...]]:
        """Every trainable variable."""
        found: dict[str, tuple[int, ...]] = {}

        def layer(name: str, *shape: int) -> int:
            found[f"{name}/kernel"], found[f"{name}/bias"] = shape, shape[-1:]
            return shape[-1]

        def tower(scope: str) -> int:
            joined = 0
            for sensor in sorted(self.sensors):
                convs, dense = self._layers(sensor)
                height, width, channels = (120, 160, 2 if sensor == "STEREO_CAMERAS" else 1)
                if sensor in LIDARS:
                    height, width, channels = 1, 1, LIDARS[sensor]
                for i, (filters, kernel, stride) in enumerate(convs):
                    channels = layer(f"{scope}/{sensor}/Conv2d_{2 * i}", kernel, kernel, channels, filters)
                    height, width = (height - kernel) // stride + 1, (width - kernel) // stride + 1
                for i, units in enumerate(dense, len(convs)):
                    channels = layer(f"{scope}/{sensor}/Dense_{2 * i}", channels, units)
                joined += height * width * channels
            for i, units in enumerate(LAYERS[self.network][2]):
                joined = layer(f"{scope}/middleware_fc_embedder/Dense_{2 * i}", joined, units)
            return joined

        if self.kind == "sac":
            head = f"{self.policy}/sac_policy_head_0"
            units = layer(f"{head}/dense", tower(self.policy), 256)
            layer(f"{head}/dense_1", units, 2)
            layer(f"{head}/policy_mean", units, 2)
            return found
        layer(f"{self.online}/network_0/v_values_head_0/output", tower(f"{self.online}/network_0"), 1)
        units = tower(self.policy)
        if self.kind == "discrete":
            layer(f"{self.policy}/ppo_head_0/policy_fc", units, self.num_actions)
        else:
            layer(f"{self.policy}/ppo_head_0/policy_mean", units, 2)
            found[f"{self.policy}/ppo_head_0/policy_log_std"] = (1, 2)
        return found

    def tensors(self) -> Arrays:
        """Their values."""
        rng = np.random.default_rng(self.seed)
        found: Arrays = {}
        for name, shape in self.shapes().items():
            found[name] = rng.standard_normal(shape, np.float32)
            # so that signals do not fade on their way
            found[name] *= np.float32(1.5 / np.sqrt(np.prod(shape[:-1])) if name.endswith("kernel") else 0.1)
            if name.endswith("policy_log_std"):
                found[name][:] = -0.5, 0.25
        return found

    def _layers(self, sensor: str) -> tuple[Sequence[tuple[int, int, int]], Sequence[int]]:
        if sensor in LIDARS:
            return [], [256, 256]
        is_stereo = sensor == "STEREO_CAMERAS" and self.network != SHALLOW
        return (STEREO, []) if is_stereo else LAYERS[self.network][:2]

    def graph(self, tensors: Arrays | None = None) -> bytes:
        """The frozen graph: the policy's tower, from its placeholders to ``policy``."""
        tensors = self.tensors() if tensors is None else tensors
        writer, scope = GraphWriter(), self.policy

        def read(name: str) -> str:
            writer.constant(name, tensors[name])
            return writer.node(f"{name}/read", "Identity", name)

        def biased(layer: str, product: str) -> str:
            return writer.node(f"{layer}/BiasAdd", "BiasAdd", product, read(f"{layer}/bias"))

        def dense(layer: str, x: str) -> str:
            return biased(layer, writer.node(f"{layer}/MatMul", "MatMul", x, read(f"{layer}/kernel")))

        def activation(layer: str, x: str) -> str:
            part, number_ = layer.rsplit("_", 1)
            name = f"{part.rpartition('/')[0]}/BatchnormActivationDropout_{int(number_) + 1}_activation"
            return writer.node(name, "Relu", x)

        def flat(name: str, x: str, sizes: Sequence[int]) -> str:
            return writer.node(name, "Reshape", x, writer.constant(f"{name}/shape", np.array(sizes, np.int32)))

        outputs = []
        for sensor in sorted(self.sensors):
            below = f"{scope}/{sensor}"
            convs, units = self._layers(sensor)
            shape = [-1, LIDARS.get(sensor, 0)]
            if sensor not in LIDARS:
                shape = [-1, 120, 160, 2 if sensor == "STEREO_CAMERAS" else 1]
            x = writer.placeholder(self.input(sensor), shape)
            divisor = writer.constant(f"{below}/truediv/y", np.float32(1.0 if sensor in LIDARS else 255.0))
            x = writer.node(f"{below}/truediv", "RealDiv", x, divisor)
            x = writer.node(f"{below}/sub", "Sub", x, writer.constant(f"{below}/sub/y", np.float32(0.0)))
            height, width, channels = 120, 160, 0
            for i, (filters, kernel, stride) in enumerate(convs):
                layer = f"{below}/Conv2d_{2 * i}"
                strides = bytes_field(1, bytes_field(3, bytes([1, stride, stride, 1])))
                product = writer.node(
                    f"{layer}/Conv2D",
                    "Conv2D",
                    x,
                    read(f"{layer}/kernel"),
                    strides=strides,
                    padding=bytes_field(2, "VALID"),
                )
                x = activation(layer, biased(layer, product))
                height, width, channels = (height - kernel) // stride + 1, (width - kernel) // stride + 1, filters
            for i, size in enumerate(units, len(convs)):
                layer = f"{below}/Dense_{2 * i}"
                if convs:  # a dense layer acts on the last axis of an image
                    flattened = flat(f"{layer}/Tensordot/Reshape", x, [-1, channels])
                    product = writer.node(f"{layer}/Tensordot/MatMul", "MatMul", flattened, read(f"{layer}/kernel"))
                    x = biased(layer, flat(f"{layer}/Tensordot", product, [-1, height, width, size]))
                    channels = size
                else:
                    x = dense(layer, x)
                x = activation(layer, x)
            outputs.append(flat(f"{below}/Flatten/flatten/Reshape", x, [-1, height * width * channels]) if convs else x)
        x = outputs[0]
        if len(outputs) > 1:
            x = writer.node(
                f"{scope}/merger", "ConcatV2", *outputs, writer.constant(f"{scope}/merger/axis", np.int32(1))
            )
        for i in range(len(LAYERS[self.network][2])):
            layer = f"{scope}/middleware_fc_embedder/Dense_{2 * i}"
            x = activation(layer, dense(layer, x))
        if self.kind == "sac":
            head = f"{scope}/sac_policy_head_0"
            x = writer.node(f"{head}/dense/Relu", "Relu", dense(f"{head}/dense", x))
            writer.node(self.output, "Identity", dense(f"{head}/policy_mean", x))
        elif self.kind == "discrete":
            writer.node(self.output, "Softmax", dense(f"{scope}/ppo_head_0/policy_fc", x))
        else:
            writer.node(self.output, "Identity", dense(f"{scope}/ppo_head_0/policy_mean", x))
        return writer.bytes()

    def small_graph(self) -> bytes:
        """A graph of a few kilobytes: every kernel is one number, which TensorFlow takes to fill it."""
        writer = GraphWriter()
        for place, (name, shape) in enumerate(self.shapes().items()):
            if name.startswith(self.policy) and not name.endswith("policy_log_std"):
                body = number(1, 1) + bytes_field(2, shape_message(shape))
                body += bytes_field(5, np.float32(0.001 * (place % 7)).tobytes())
                writer.node(name, "Const", value=bytes_field(8, body), dtype=number(6, 1))
        writer.node(self.output, "Softmax" if self.kind == "discrete" else "Identity")
        return writer.bytes()

    def write(self, folder: Path, *, graph: str = "", checkpoint: str = "") -> Path:
        """A folder with the metadata, and the graph and the checkpoint where they are named."""
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "model_metadata.json").write_text(json.dumps(self.metadata()))
        tensors = self.tensors()
        if graph:
            (folder / graph).parent.mkdir(parents=True, exist_ok=True)
            (folder / graph).write_bytes(self.graph(tensors))
        if checkpoint:
            place = folder / checkpoint
            write_checkpoint(place.parent, place.name, tensors, crc=crc32c)
        return folder
