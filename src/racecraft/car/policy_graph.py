"""A policy's network as the frozen graph that AWS's trainer would have written of it, and the same as an ONNX model.

    camera: sky cut off, pooled, / 255, convolutions ─┬─ joined -> dense -> head -> policy
    LIDAR: dense ─────────────────────────────────────┘

Names are AWS's (`racecraft.importing.policy_weights`); all operations are TensorFlow's own and old, so every converter
knows them. What `racecraft.learn.networks.encode` does to a frame, which rounds to whole numbers after it pooled, the
graph does, too: ``Floor(mean + 0.5)``. The best action of SAC is the hyperbolic tangent of its mean; a car clips what
it is given, so the tangent is the graph's last node.
"""

from __future__ import annotations

import numpy as np

from racecraft.agent.sensor_suite import SensorSuite
from racecraft.car.graph_writer import GraphWriter
from racecraft.car.onnx_writer import OnnxWriter
from racecraft.importing.policy_weights import layer_names, policy_head
from racecraft.learn import NetworkSpec
from racecraft.learn.learner import Weights
from racecraft.learn.networks import architecture_of, flat_size, pooled_shape, sky_rows, weight_shapes

MAX_BYTE = 255.0


def policy_output(spec: NetworkSpec) -> str:
    """Name of the graph's one output: probabilities of the actions, or two numbers within the action space's ±1."""
    return f"{_scope(spec)}/{policy_head(spec).partition('/')[0]}/policy"


def sensor_input(spec: NetworkSpec, sensor: str) -> str:
    """Name of the placeholder of a sensor."""
    return f"{_online(spec)}/network_0/{sensor}/{sensor}"


def sensor_inputs(spec: NetworkSpec, sensors: SensorSuite) -> list[str]:
    """Names of all placeholders: the camera's, and the LIDAR's where there is one."""
    return [sensor_input(spec, name) for name in (sensors.camera_name, sensors.lidar_name) if name]


def policy_graph(weights: Weights, spec: NetworkSpec, sensors: SensorSuite) -> bytes:
    """The graph as the content of a ``.pb`` file.

    Args:
        weights: ``policy.*`` of `racecraft.learn.networks.weight_shapes`; others are left out.
        spec: The network.
        sensors: Of the car, by AWS's names.
    """
    writer = GraphWriter()
    _PolicyGraph(weights, spec, sensors, writer).write()
    return writer.finish()


def policy_onnx(weights: Weights, spec: NetworkSpec, sensors: SensorSuite) -> bytes:
    """The same as the content of a ``.onnx`` file: inputs and output have the same names and shapes."""
    writer = OnnxWriter()
    _PolicyGraph(weights, spec, sensors, writer).write()
    return writer.finish(policy_output(spec), spec.num_actions)


def _online(spec: NetworkSpec) -> str:
    return f"main_level/agent/{'policy' if spec.is_squashed else 'main'}/online"


def _scope(spec: NetworkSpec) -> str:
    """Where a policy's tower lies: PPO's behind that of its critic."""
    return f"{_online(spec)}/network_{0 if spec.is_squashed else 1}"


class _PolicyGraph:
    """The graph while it is written."""

    def __init__(
        self, weights: Weights, spec: NetworkSpec, sensors: SensorSuite, writer: GraphWriter | OnnxWriter
    ) -> None:
        self.weights, self.spec, self.sensors = weights, spec, sensors
        self.arch, self.scope, self.writer = architecture_of(spec), _scope(spec), writer
        self.names = layer_names(spec, sensors, head=policy_head(spec))

    def write(self) -> None:
        parts = [self._camera()]
        if self.spec.lidar_size:
            parts.insert(0 if self.sensors.lidar_is_first else 1, self._lidar())
        x = parts[0] if len(parts) == 1 else self.writer.join(f"{self.scope}/Merger/concat", *parts)
        for i in range(len(self.arch.dense)):
            x = self._activated(f"dense{i + 1}", self._dense(f"dense{i + 1}", x))
        x = self._dense("head", x)
        last = "Softmax" if self.spec.is_discrete else "Tanh" if self.spec.is_squashed else "Identity"
        self.writer.apply(policy_output(self.spec), last, x)

    def _camera(self) -> str:
        spec, writer, camera = self.spec, self.writer, self.sensors.camera_name
        below = f"{self.scope}/{camera}"
        x = writer.placeholder(sensor_input(spec, camera), [-1, *spec.frame_shape, spec.lenses])
        if self.arch.told:
            return self._convolved(self._told(f"{below}/perception", x))
        if sky_rows(spec):
            x = writer.below(f"{below}/below_sky", x, row=sky_rows(spec))
        if self.arch.pool > 1:
            x = writer.pool(f"{below}/pool", x, side=self.arch.pool)
            x = writer.apply(f"{below}/half", "Add", x, writer.constant(f"{below}/half/y", np.float32(0.5)))
            x = writer.apply(f"{below}/whole", "Floor", x)
        x = writer.apply(f"{below}/truediv", "RealDiv", x, writer.constant(f"{below}/truediv/y", np.float32(MAX_BYTE)))
        return self._convolved(x)

    def _told(self, below: str, x: str) -> str:
        """What perception tells of pictures, with the weights that the package brings along."""
        from racecraft.car.perception_graph import tell
        from racecraft.perception import Perceiver

        network = Perceiver(num_threads=1).network
        return tell(self.writer, below, x, spec=network.spec, weights=network.weights())

    def _convolved(self, x: str) -> str:
        """What the camera's convolutions end in, of an image of 0 to 1, or of what is told in its place."""
        spec, writer, below = self.spec, self.writer, f"{self.scope}/{self.sensors.camera_name}"
        (height, width), channels = pooled_shape(spec), spec.lenses
        for i, conv in enumerate(self.arch.convs):
            layer = f"conv{i + 1}"
            name = f"{self.scope}/{self.names[f'policy.{layer}']}"
            if conv.kernel == 1:  # a dense layer at every position
                flat = writer.reshape(f"{name}/Tensordot/Reshape", x, [-1, channels])
                x = self._dense(layer, flat)
                x = writer.reshape(f"{name}/Tensordot", x, [-1, height, width, conv.filters])
            else:
                kernel = self._weight(layer, "weight").transpose(2, 3, 1, 0)
                x = writer.convolution(
                    f"{name}/Conv2D", x, writer.variable(f"{name}/kernel", kernel), stride=conv.stride
                )
                x = self._biased(layer, x)
            x = self._activated(layer, x)
            height, width = (height - conv.kernel) // conv.stride + 1, (width - conv.kernel) // conv.stride + 1
            channels = conv.filters
        return writer.reshape(f"{below}/Flatten/flatten/Reshape", x, [-1, height * width * channels])

    def _lidar(self) -> str:
        x = self.writer.placeholder(sensor_input(self.spec, self.sensors.lidar_name), [-1, self.spec.lidar_size])
        for i in range(len(self.arch.lidar)):
            x = self._activated(f"lidar{i + 1}", self._dense(f"lidar{i + 1}", x))
        return x

    def _dense(self, layer: str, x: str) -> str:
        name = f"{self.scope}/{self.names[f'policy.{layer}']}"
        kernel = self._weight(layer, "weight")
        kernel = kernel.reshape(len(kernel), -1).T
        if layer == "dense1" and self.spec.lidar_size and self.sensors.lidar_is_first:
            size = flat_size(self.spec)  # the camera's inputs come first here, last there
            kernel = np.concatenate([kernel[size:], kernel[:size]])
        x = self.writer.product(f"{name}/MatMul", x, self.writer.variable(f"{name}/kernel", kernel))
        return self._biased(layer, x)

    def _biased(self, layer: str, x: str) -> str:
        name = f"{self.scope}/{self.names[f'policy.{layer}']}"
        return self.writer.bias(f"{name}/BiasAdd", x, self.writer.variable(f"{name}/bias", self._weight(layer, "bias")))

    def _activated(self, layer: str, x: str) -> str:
        """A ReLU by AWS's name: the odd numbers between the layers'."""
        name = self.names[f"policy.{layer}"]
        part, _, number = name.rpartition("_")
        folder = part.rpartition("/")[0]
        if not number.isdigit():  # SAC's layer has no number
            return self.writer.apply(f"{self.scope}/{name}/Relu", "Relu", x)
        activation = f"BatchnormActivationDropout_{int(number) + 1}_activation"
        return self.writer.apply(f"{self.scope}/{folder}/{activation}", "Relu", x)

    def _weight(self, layer: str, kind: str) -> np.ndarray[tuple[int, ...], np.dtype[np.float32]]:
        name = f"policy.{layer}.{kind}"
        return self.weights[name].reshape(weight_shapes(self.spec)[name])
