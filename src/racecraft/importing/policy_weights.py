"""From TensorFlow's tensors, by the names that AWS's trainer gave them, to the weights of our networks.

    frozen graph or checkpoint ──tower──▶ {"policy.conv1.weight": ..., "policy.head.bias": ...}

A tower lies below ``main_level/agent/main/online/network_1/``. Its sensors' layers are numbered two by two, for the odd
numbers are the activations: ``FRONT_FACING_CAMERA/Conv2d_0``, ``Conv2d_2``, ..., ``LIDAR/Dense_0``, ``Dense_2``. What
comes of the sensors is joined in the order of their names, then follow ``middleware_fc_embedder/Dense_0``, ..., and the
head. Kernels are (rows, columns, inputs, outputs) and (inputs, outputs).
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final, Protocol

import numpy as np
from numpy.typing import NDArray

from racecraft.agent.sensor_suite import SensorSuite
from racecraft.errors import SourceError
from racecraft.learn import NetworkSpec
from racecraft.learn.learner import Weights
from racecraft.learn.networks import architecture, architecture_of, flat_size, weight_shapes

MIDDLEWARE: Final = "middleware_fc_embedder"
CRITIC_HEAD: Final = "v_values_head_0/output"


class Tensors(Protocol):
    """Named float32 tensors of a file, read when they are asked for."""

    @property
    def name(self) -> str:
        """What messages call the file."""

    @property
    def shapes(self) -> Mapping[str, tuple[int, ...]]:
        """Of every tensor."""

    def read(self, name: str) -> NDArray[np.float32]:
        """One of them, perhaps a view of the file."""


def policy_head(spec: NetworkSpec) -> str:
    """Name of the layer that a policy ends in, below its tower."""
    if spec.is_squashed:
        return "sac_policy_head_0/policy_mean"
    return "ppo_head_0/policy_fc" if spec.is_discrete else "ppo_head_0/policy_mean"


def find_tower(tensors: Tensors, head: str) -> str:
    """The prefix of the tower that ends in a head, ``""`` where there is none.

    Raises:
        SourceError: There are several: the file holds the models of several cars.
    """
    end = f"/{head}/kernel"
    towers = sorted(name.removesuffix(end) for name in tensors.shapes if name.endswith(end) and "/target/" not in name)
    if len(towers) > 1:
        raise SourceError(f"{tensors.name} holds {len(towers)} policies; a model has one.")
    return towers[0] if towers else ""


def policy_weights(tensors: Tensors, spec: NetworkSpec, sensors: SensorSuite) -> Weights:
    """The policy's weights: every ``policy.*`` of `racecraft.learn.networks.weight_shapes`.

    A Gaussian's ``policy.log_std`` is left out where the file has none, as a frozen graph never has.

    Args:
        tensors: The file.
        spec: The network that they are to fit.
        sensors: Of the car, by AWS's names.

    Raises:
        SourceError: The file holds no such policy, one of another network, or numbers that are none.
    """
    head = policy_head(spec)
    scope = find_tower(tensors, head)
    if not scope:
        raise SourceError(
            f"{tensors.name} holds no policy of this kind: it has no {head}/kernel.",
            hint="Do action_space_type and training_algorithm in model_metadata.json belong to this model?",
        )
    outputs = tensors.shapes[f"{scope}/{head}/kernel"][-1:]
    if spec.is_discrete and outputs != (spec.num_actions,) and len(outputs) == 1:
        raise SourceError(
            f"{tensors.name} chooses from {outputs[0]} actions, and model_metadata.json lists {spec.num_actions}.",
            hint="Is this the model_metadata.json that it was trained with?",
        )
    weights = _tower(tensors, spec, sensors, scope=scope, head=head, tower="policy")
    log_std = f"{scope}/ppo_head_0/policy_log_std"
    if not spec.is_discrete and log_std in tensors.shapes:
        shape = (1, spec.num_actions)
        weights["policy.log_std"] = _checked(tensors, log_std, shape).reshape(spec.num_actions)
    return weights


def has_critic(tensors: Tensors) -> bool:
    """Whether the file holds the value of a state, too, as checkpoints of PPO do."""
    return bool(find_tower(tensors, CRITIC_HEAD))


def critic_weights(tensors: Tensors, spec: NetworkSpec, sensors: SensorSuite) -> Weights:
    """The weights of the critic that sees the sensors: every ``critic.*`` of `weight_shapes`.

    Raises:
        SourceError: As `policy_weights`.
    """
    scope = find_tower(tensors, CRITIC_HEAD)
    return _tower(tensors, spec, sensors, scope=scope, head=CRITIC_HEAD, tower="critic")


def layer_names(spec: NetworkSpec, sensors: SensorSuite, *, head: str, tower: str = "policy") -> dict[str, str]:
    """AWS's name of each of our layers, below a tower's scope, from the sensors to the head.

    ``RACECRAFT_SMALL``, which AWS has not, is called by the same rules.

    Args:
        spec: The network.
        sensors: Of the car, by AWS's names.
        head: Name of the last layer.
        tower: ``policy`` or ``critic``.
    """
    arch = architecture_of(spec)
    layers = {
        f"{tower}.conv{i + 1}": f"{sensors.camera_name}/{'Dense' if conv.kernel == 1 else 'Conv2d'}_{2 * i}"
        for i, conv in enumerate(arch.convs)
    }
    for i in range(len(arch.lidar) if spec.lidar_size else 0):
        layers[f"{tower}.lidar{i + 1}"] = f"{sensors.lidar_name}/Dense_{2 * i}"
    for i in range(len(arch.dense)):
        layers[f"{tower}.dense{i + 1}"] = f"{MIDDLEWARE}/Dense_{2 * i}"
    if tower == "policy" and len(arch.dense) > len(architecture(spec.name, lenses=spec.lenses).dense):
        layers[f"{tower}.dense{len(arch.dense)}"] = f"{head.split('/')[0]}/dense"  # SAC's own
    layers[f"{tower}.head"] = head
    return layers


def _tower(tensors: Tensors, spec: NetworkSpec, sensors: SensorSuite, *, scope: str, head: str, tower: str) -> Weights:
    """The layers of one tower by our names."""
    shapes = {name: shape for name, shape in weight_shapes(spec).items() if name.startswith(f"{tower}.")}
    layers = layer_names(spec, sensors, head=head, tower=tower)
    for ours, theirs in layers.items():
        if theirs.endswith("/dense"):
            units = shapes[f"{ours}.weight"][::-1]
            layers[ours] = _unnamed(tensors, scope, theirs.split("/")[0], units)
    weights: Weights = {}
    for ours, theirs in layers.items():
        shape = shapes[f"{ours}.weight"]
        is_dense = len(shape) == 2 or "/Dense_" in theirs
        kernel = _checked(
            tensors, f"{scope}/{theirs}/kernel", shape[1::-1] if is_dense else (*shape[2:], *shape[1::-1])
        )
        turned = kernel.transpose((1, 0) if is_dense else (3, 2, 0, 1))
        weight = weights[f"{ours}.weight"] = np.empty(shape, np.float32)
        if theirs == f"{MIDDLEWARE}/Dense_0" and spec.lidar_size and sensors.lidar_is_first:
            size = flat_size(spec)  # the camera's inputs come last there, first here
            weight[:, :size], weight[:, size:] = turned[:, -size:], turned[:, :-size]
        else:
            weight[:] = turned.reshape(shape)
        weights[f"{ours}.bias"] = _checked(tensors, f"{scope}/{theirs}/bias", shape[:1]).copy()
    return weights


def _unnamed(tensors: Tensors, scope: str, part: str, shape: tuple[int, ...]) -> str:
    """A dense layer without a name of its own: TensorFlow calls it ``dense_N``, so its kernel's shape has to tell."""
    for name, given in tensors.shapes.items():
        layer = name.removeprefix(f"{scope}/").removesuffix("/kernel")
        if given == shape and layer.startswith(f"{part}/dense"):
            return layer
    return f"{part}/dense"


def _checked(tensors: Tensors, name: str, shape: tuple[int, ...]) -> NDArray[np.float32]:
    """A tensor of this shape, of finite numbers."""
    layer = "/".join(name.split("/")[-3:])
    given = tensors.shapes.get(name)
    if given != shape:
        has = "has no" if given is None else f"has the shape {given} in its"
        raise SourceError(
            f"{tensors.name} {has} {layer}, expected {shape}: it is of another network or other sensors.",
            hint="Do neural_network and sensor in model_metadata.json belong to this model?",
        )
    values = tensors.read(name)
    if not np.isfinite(values).all():
        raise SourceError(f"{tensors.name} is damaged: its {layer} holds numbers that are not finite.")
    return values
