"""The networks by name, in NumPy: layers, weight shapes, initial weights, the layout of a frame for them.

Every network is two separate towers, as AWS's are: a policy that sees what the sensors tell, and a critic that sees
either the privileged state (a small perceptron, training only) or the same through a tower of its own. A LIDAR has
dense layers of its own, and what comes of them is laid behind what comes of the camera.

    image -> convolutions -> (camera, LIDAR) -> dense layers -> head
    LIDAR -> dense layers ------^

Weights are named ``policy.conv1.weight`` (filters, channels, kernel, kernel), ``policy.dense1.weight`` (out, in),
``policy.lidar1.weight``, ``policy.head.weight``; the last convolution is flattened in the order row, column, channel.
A backend needs nothing but this file.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from racecraft.checks import check_choice
from racecraft.errors import ConfigError, ShapeError
from racecraft.learn.learner import NetworkSpec, Weights
from racecraft.learn.native_distributions import normals


@dataclass(frozen=True)
class Conv:
    """A convolution without padding, followed by a ReLU."""

    filters: int
    """Output channels."""
    kernel: int
    """Side of the square kernel, pixels."""
    stride: int
    """Pixels between two applications of the kernel."""


@dataclass(frozen=True)
class Architecture:
    """A tower: the image without its sky, average pooling, convolutions, dense layers with ReLU."""

    convs: tuple[Conv, ...]
    dense: tuple[int, ...]
    """Units of each dense layer."""
    pool: int = 1
    """Side of the squares of pixels averaged before the first convolution; 1 or 2."""
    sky: float = 0.0
    """Share of the image's rows, from the top, that the tower does not see."""
    log_std: float = 0.0
    """Log standard deviation that a Gaussian policy begins with; 0 as AWS's."""
    lidar: tuple[int, ...] = (256, 256)
    """Units of the LIDAR's own dense layers, where there is one."""
    told: int = 0
    """Side of the square of bytes that the tower is told in place of the camera's image; 0: it sees the image."""


PERCEPTION = "PERCEPTION"
"""The network that sees nothing but what perception tells of a frame, for `racecraft.perception.learner`."""
TOLD_SIDE = 10
"""Side of the square that holds a byte for each number that perception tells."""

ARCHITECTURES: dict[str, Architecture] = {
    "RACECRAFT_SMALL": Architecture(
        (Conv(16, 8, 4), Conv(32, 4, 2), Conv(32, 3, 2)), (128,), pool=2, sky=0.2, log_std=-1.0, lidar=(64, 64)
    ),
    "DEEP_CONVOLUTIONAL_NETWORK_SHALLOW": Architecture((Conv(32, 8, 4), Conv(64, 4, 2), Conv(64, 3, 1)), (512,)),
    "DEEP_CONVOLUTIONAL_NETWORK": Architecture(
        (Conv(32, 5, 2), Conv(32, 3, 1), Conv(64, 3, 2), Conv(64, 3, 1), Conv(64, 1, 1)), (512,)
    ),
    "DEEP_CONVOLUTIONAL_NETWORK_DEEP": Architecture(
        (Conv(32, 8, 4), Conv(32, 4, 2), Conv(64, 4, 2), Conv(64, 3, 1), Conv(512, 1, 1), Conv(512, 1, 1)), (256, 128)
    ),
    # one convolution over all that it is told is a dense layer
    PERCEPTION: Architecture((Conv(64, TOLD_SIDE, 1),), (64,), log_std=-1.0, lidar=(64, 64), told=TOLD_SIDE),
}
"""By name. What AWS's console calls the dense layers of 64, and of 512 and 512, units of the last two stands before the
flattening in its trainer, so it acts at every position of the image by itself: a convolution whose kernel is one pixel.
"""
_STEREO_CONVS = (Conv(32, 3, 1), Conv(64, 3, 2), Conv(64, 3, 1), Conv(128, 3, 2), Conv(128, 3, 1))
STEREO: dict[str, Architecture] = {
    "DEEP_CONVOLUTIONAL_NETWORK": Architecture(_STEREO_CONVS, (512,)),
    "DEEP_CONVOLUTIONAL_NETWORK_DEEP": Architecture(_STEREO_CONVS, (256, 128)),
}
"""What AWS builds under these names for a stereo camera; the others are the same for both."""
SAC_HEAD = 256
"""Units of one more dense layer that AWS's policies have before the head when SAC trains them."""
INITIAL_WEIGHTS = ("orthogonal", "glorot")
"""What an untrained network can begin with."""
CRITIC_UNITS = (64, 64)
"""Dense layers (tanh) of the critic that sees the privileged state."""
TEACHER = "TEACHER"
"""The network without a camera, for `racecraft.learn.native_state_learner`: both towers are dense layers (tanh)
over the privileged state."""
TEACHER_UNITS = (64, 64)
"""Its dense layers."""
TEACHER_LOG_STD = -1.0
"""Log standard deviation that it begins with where actions are continuous."""

PERCEIVER = "PERCEIVER"
"""The network behind `racecraft.perception`, which tells what a frame shows and drives nothing."""
_PERCEIVER = Architecture((Conv(16, 4, 2), Conv(32, 3, 2), Conv(64, 3, 2)), (256,), pool=2, sky=0.2)


def network_names() -> tuple[str, ...]:
    """Every name ``NetworkSpec`` accepts, the default first."""
    return tuple(ARCHITECTURES)


def architecture(name: str, *, lenses: int = 1) -> Architecture:
    """The layers behind a name.

    Args:
        name: One of `network_names()`.
        lenses: 2 for a stereo camera, which two of AWS's networks look at with other layers.

    Raises:
        ConfigError: No network has this name.
    """
    if lenses == 2 and name in STEREO:
        return STEREO[name]
    if name == PERCEIVER:
        return _PERCEIVER
    check_choice("network", name, ARCHITECTURES)
    return ARCHITECTURES[name]


def architecture_of(spec: NetworkSpec) -> Architecture:
    """The layers of a network's towers."""
    arch = architecture(spec.name, lenses=spec.lenses)
    is_aws = spec.name.startswith("DEEP_CONVOLUTIONAL_NETWORK")
    return replace(arch, dense=(*arch.dense, SAC_HEAD)) if spec.is_squashed and is_aws else arch


def sky_rows(spec: NetworkSpec) -> int:
    """Rows at the top of a camera image that the network does not see.

    The default camera looks 15 degrees down and has its horizon in row 29 of 120. What is above it tells nothing of
    the road but differs from track to track, and a third of the network's arithmetic would go there.
    """
    return int(architecture_of(spec).sky * spec.frame_shape[0])


def picture_shape(spec: NetworkSpec) -> tuple[int, int]:
    """Height and width of what a network gets of each lens: the camera's image, or the square of what it is told."""
    told = 0 if spec.name == TEACHER else architecture_of(spec).told
    return (told, told) if told else spec.frame_shape


def pooled_shape(spec: NetworkSpec) -> tuple[int, int]:
    """Height and width of what the first convolution sees, pixels."""
    pool, (height, width) = architecture_of(spec).pool, picture_shape(spec)
    return (height - sky_rows(spec)) // pool, width // pool


def block_size(spec: NetworkSpec) -> int:
    """Side of the squares of pixels that ``encode`` turns into channels; 1 where the first layer forbids it.

    A convolution whose stride divides its kernel and the image equals one of stride 1 over squares of
    `stride` pixels, `stride`² channels each. On a CPU that is twice as fast as one channel of grey.
    """
    first = architecture_of(spec).convs[0]
    height, width = pooled_shape(spec)
    divides = first.kernel % first.stride == 0 and height % first.stride == 0 and width % first.stride == 0
    return first.stride if divides else 1


def sight_shape(spec: NetworkSpec) -> tuple[int, ...]:
    """Shape of what `encode` takes for one car: an image, the images of two lenses, or, with a LIDAR, plain bytes.

    The bytes are the image, or the images of the lenses, and behind them the LIDAR's values times 255. The image of a
    network that is told what there is to see is what it is told.
    """
    height, width = picture_shape(spec)
    if spec.lidar_size:
        return (spec.lenses * height * width + spec.lidar_size,)
    return (height, width) if spec.lenses == 1 else (spec.lenses, height, width)


def image_shape(spec: NetworkSpec) -> tuple[int, int, int]:
    """Rows, columns and channels of an encoded image: block by block of the first lens, then of the second."""
    block = block_size(spec)
    height, width = pooled_shape(spec)
    return height // block, width // block, spec.lenses * block * block


def observation_shape(spec: NetworkSpec) -> tuple[int, ...]:
    """Shape of an observation as `encode` makes it: that of the image, or its bytes and behind them the LIDAR's.

    Of a teacher it is that of its state.
    """
    if spec.name == TEACHER:
        return (spec.state_size,)
    shape = image_shape(spec)
    return (int(np.prod(shape)) + spec.lidar_size,) if spec.lidar_size else shape


def check_sight(spec: NetworkSpec, sight: NDArray[np.uint8]) -> None:
    """Refuse what is not what this network's sensors tell.

    Raises:
        ShapeError: Another type or shape.
    """
    shape = sight_shape(spec)
    if sight.dtype != np.uint8 or sight.shape[1:] != shape:
        expected = ", ".join(("N", *map(str, shape)))
        raise ShapeError(f"frames are {sight.dtype} of shape {sight.shape}, expected uint8 of ({expected}).")


def encode(spec: NetworkSpec, sight: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Cut off the sky, pool (mean of each square, halves rounded up) and fold blocks of pixels into channels.

    Args:
        spec: The network the frames are for.
        sight: What the sensors tell  (N, *sight_shape(spec)).

    Returns:
        New array  (N, *observation_shape(spec)).

    Raises:
        ShapeError: It is not uint8 of that shape.
    """
    check_sight(spec, sight)
    count, (height, width) = len(sight), picture_shape(spec)
    size = spec.lenses * height * width
    flat = sight.reshape(count, size + spec.lidar_size)
    frames = flat[:, :size].reshape(count * spec.lenses, height, width)
    pixels = np.ascontiguousarray(frames[:, sky_rows(spec) :])
    if architecture_of(spec).pool == 2:
        pairs = pixels.view(np.uint16)  # two neighbours in one word: sums of whole rows at SIMD speed
        sums = (pairs & 255) + (pairs >> 8)
        pixels = ((sums[:, 0::2] + sums[:, 1::2] + 2) >> 2).astype(np.uint8)
    rows, columns, channels = image_shape(spec)
    block = block_size(spec)
    folded = pixels.reshape(count, spec.lenses, rows, block, columns, block).transpose(0, 2, 4, 1, 3, 5)
    # ascontiguousarray would return the frames themselves where nothing moves; the caller wants its own copy
    images = np.array(folded, order="C").reshape(count, rows, columns, channels)
    if not spec.lidar_size:
        return images
    return np.concatenate([images.reshape(count, rows * columns * channels), flat[:, size:]], axis=1)


def flat_size(spec: NetworkSpec) -> int:
    """Numbers that the camera's convolutions end in."""
    arch = architecture_of(spec)
    height, width = pooled_shape(spec)
    for conv in arch.convs:
        height = (height - conv.kernel) // conv.stride + 1
        width = (width - conv.kernel) // conv.stride + 1
    if height < 1 or width < 1:
        raise ConfigError(f"frame_shape {spec.frame_shape} is too small for the network {spec.name}.")
    return height * width * arch.convs[-1].filters


def weight_shapes(spec: NetworkSpec) -> dict[str, tuple[int, ...]]:
    """Name and shape of every parameter, in the fixed order of the towers."""
    is_blind = spec.name == TEACHER
    shapes: dict[str, tuple[int, ...]] = {}

    def dense(layer: str, inputs: int, units: tuple[int, ...]) -> int:
        for i, size in enumerate(units, 1):
            shapes[f"{layer}{i}.weight"], shapes[f"{layer}{i}.bias"] = (size, inputs), (size,)
            inputs = size
        return inputs

    def head(tower: str, inputs: int, outputs: int) -> None:
        shapes[f"{tower}.head.weight"], shapes[f"{tower}.head.bias"] = (outputs, inputs), (outputs,)

    def sensors(tower: str, outputs: int) -> None:
        arch, channels = architecture_of(spec), spec.lenses
        for i, conv in enumerate(arch.convs, 1):
            shapes[f"{tower}.conv{i}.weight"] = (conv.filters, channels, conv.kernel, conv.kernel)
            shapes[f"{tower}.conv{i}.bias"] = (conv.filters,)
            channels = conv.filters
        inputs = flat_size(spec)
        if spec.lidar_size:
            inputs += dense(f"{tower}.lidar", spec.lidar_size, arch.lidar)
        head(tower, dense(f"{tower}.dense", inputs, arch.dense), outputs)

    def states(tower: str, units: tuple[int, ...], outputs: int) -> None:
        head(tower, dense(f"{tower}.dense", spec.state_size, units), outputs)

    if is_blind:
        states("policy", TEACHER_UNITS, spec.num_actions)
    else:
        sensors("policy", spec.num_actions)
    if not spec.is_discrete:
        shapes["policy.log_std"] = (spec.num_actions,)
    if is_blind or spec.state_size:
        states("critic", TEACHER_UNITS if is_blind else CRITIC_UNITS, 1)
    else:
        sensors("critic", 1)
    return shapes


def orthonormalize_by_qr(vectors: NDArray[np.float64]) -> None:
    """Make the rows orthonormal in place, each from itself and those before it; the bits are LAPACK's."""
    q, r = np.linalg.qr(vectors.T)
    vectors[:] = (q * np.sign(np.diag(r))).T


def initial_weights(
    spec: NetworkSpec, *, seed: int, orthonormalize: Callable[[NDArray[np.float64]], None] = orthonormalize_by_qr
) -> Weights:
    """Orthogonal weights (gain √2 inside, 0.01 before the policy, 1 before the value), biases zero.

    Args:
        spec: The network.
        seed: Decides the weights.
        orthonormalize: Does what ``orthonormalize_by_qr`` does.
    """
    rng = np.random.default_rng([seed, 0x6E6574])
    weights: Weights = {}
    for name, shape in weight_shapes(spec).items():
        if not name.endswith(".weight"):
            weights[name] = _initial_bias(spec, name, shape)
            continue
        gain = {"policy.head.weight": 0.01, "critic.head.weight": 1.0}.get(name, 2.0**0.5)
        rows, columns = shape[0], int(np.prod(shape[1:]))
        vectors = np.ascontiguousarray(normals(rng, rows * columns).reshape(max(rows, columns), -1).T)
        orthonormalize(vectors)
        matrix = vectors if rows < columns else vectors.T
        weights[name] = (gain * matrix).reshape(shape).astype(np.float32)
    return weights


def glorot_weights(spec: NetworkSpec, *, seed: int) -> Weights:
    """The weights AWS's networks begin with: Glorot's uniform ones, biases zero.

    ±√(6 / (inputs + outputs)), a kernel's places counted (https://proceedings.mlr.press/v9/glorot10a.html); what comes
    before the value has length 1, and before each mean of a continuous policy 0.01.

    Args:
        spec: The network.
        seed: Decides the weights.
    """
    rng = np.random.default_rng([seed, 0x6E6574])
    lengths = {"critic.head.weight": 1.0} | ({} if spec.is_discrete else {"policy.head.weight": 0.01})
    weights: Weights = {}
    for name, shape in weight_shapes(spec).items():
        if not name.endswith(".weight"):
            weights[name] = _initial_bias(spec, name, shape)
        elif name in lengths:
            rows = normals(rng, int(np.prod(shape))).reshape(shape)
            norms = [math.sqrt(math.fsum(row**2)) for row in rows]
            weights[name] = (lengths[name] / np.array(norms)[:, None] * rows).astype(np.float32)
        else:
            limit = math.sqrt(6.0 / (sum(shape[:2]) * math.prod(shape[2:])))
            weights[name] = ((2.0 * rng.random(shape) - 1.0) * limit).astype(np.float32)
    return weights


def _initial_bias(spec: NetworkSpec, name: str, shape: tuple[int, ...]) -> NDArray[np.float32]:
    begin = 0.0
    if name == "policy.log_std":
        begin = TEACHER_LOG_STD if spec.name == TEACHER else architecture_of(spec).log_std
    return np.full(shape, begin, np.float32)


def parameter_count(spec: NetworkSpec, *, tower: str = "") -> int:
    """Number of parameters, of one tower (``"policy"`` or ``"critic"``) or of both."""
    return sum(int(np.prod(shape)) for name, shape in weight_shapes(spec).items() if name.startswith(tower))


def forward_operations(spec: NetworkSpec) -> int:
    """Floating-point operations of one forward pass for one car, both towers; biases and activations not counted."""
    arch = architecture_of(spec)
    total = 0
    for name, shape in weight_shapes(spec).items():
        if not name.endswith(".weight"):
            continue
        places = 1
        if ".conv" in name:
            height, width = pooled_shape(spec)
            for conv in arch.convs[: int(name.split(".conv")[1].split(".")[0])]:
                height, width = (height - conv.kernel) // conv.stride + 1, (width - conv.kernel) // conv.stride + 1
            places = height * width
        total += 2 * places * int(np.prod(shape))
    return total
