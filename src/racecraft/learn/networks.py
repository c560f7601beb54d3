"""The networks by name, in NumPy: layers, weight shapes, initial weights, the layout of a frame for them.

Every network is two separate towers, as AWS's are: a policy that sees the camera, and a critic that sees
either the privileged state (a small perceptron, training only) or the camera through a tower of its own.
Weights are named ``policy.conv1.weight`` (filters, channels, kernel, kernel), ``policy.dense1.weight`` (out, in),
``policy.head.weight``; the last convolution is flattened in the order row, column, channel.
A backend needs nothing but this file.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from racecraft.errors import ConfigError, ShapeError, did_you_mean
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
    """A camera tower: the image without its sky, average pooling, convolutions, dense layers with ReLU."""

    convs: tuple[Conv, ...]
    dense: tuple[int, ...]
    """Units of each dense layer."""
    pool: int = 1
    """Side of the squares of pixels averaged before the first convolution; 1 or 2."""
    sky: float = 0.0
    """Share of the image's rows, from the top, that the tower does not see."""
    log_std: float = 0.0
    """Log standard deviation that a Gaussian policy begins with; 0 as AWS's."""


ARCHITECTURES: dict[str, Architecture] = {
    "RACECRAFT_SMALL": Architecture(
        (Conv(16, 8, 4), Conv(32, 4, 2), Conv(32, 3, 2)), (128,), pool=2, sky=0.2, log_std=-1.0
    ),
    "DEEP_CONVOLUTIONAL_NETWORK_SHALLOW": Architecture((Conv(32, 8, 4), Conv(64, 4, 2), Conv(64, 3, 1)), (512,)),
    "DEEP_CONVOLUTIONAL_NETWORK": Architecture(
        (Conv(32, 5, 2), Conv(32, 3, 1), Conv(64, 3, 2), Conv(64, 3, 1)), (64, 512)
    ),
    "DEEP_CONVOLUTIONAL_NETWORK_DEEP": Architecture(
        (Conv(32, 8, 4), Conv(32, 4, 2), Conv(64, 4, 2), Conv(64, 3, 1)), (512, 512, 256, 128)
    ),
}
CRITIC_UNITS = (64, 64)
"""Dense layers (tanh) of the critic that sees the privileged state."""


def network_names() -> tuple[str, ...]:
    """Every name ``NetworkSpec`` accepts, the default first."""
    return tuple(ARCHITECTURES)


def architecture(name: str) -> Architecture:
    """The layers behind a name.

    Raises:
        ConfigError: No network has this name.
    """
    try:
        return ARCHITECTURES[name]
    except KeyError:
        known = ", ".join(ARCHITECTURES)
        hint = did_you_mean(name, ARCHITECTURES)
        raise ConfigError(f"Network {name!r} does not exist, expected one of {known}.", hint=hint) from None


def sky_rows(spec: NetworkSpec) -> int:
    """Rows at the top of a camera image that the network does not see.

    The default camera looks 15 degrees down and has its horizon in row 29 of 120. What is above it tells nothing of
    the road but differs from track to track, and a third of the network's arithmetic would go there.
    """
    return int(architecture(spec.name).sky * spec.frame_shape[0])


def pooled_shape(spec: NetworkSpec) -> tuple[int, int]:
    """Height and width of what the first convolution sees, pixels."""
    pool = architecture(spec.name).pool
    return (spec.frame_shape[0] - sky_rows(spec)) // pool, spec.frame_shape[1] // pool


def block_size(spec: NetworkSpec) -> int:
    """Side of the squares of pixels that ``encode`` turns into channels; 1 where the first layer forbids it.

    A convolution whose stride divides its kernel and the image equals one of stride 1 over squares of
    `stride` pixels, `stride`² channels each. On a CPU that is twice as fast as one channel of grey.
    """
    first = architecture(spec.name).convs[0]
    height, width = pooled_shape(spec)
    divides = first.kernel % first.stride == 0 and height % first.stride == 0 and width % first.stride == 0
    return first.stride if divides else 1


def observation_shape(spec: NetworkSpec) -> tuple[int, int, int]:
    """Rows, columns and channels of an encoded frame."""
    block = block_size(spec)
    height, width = pooled_shape(spec)
    return height // block, width // block, block * block


def encode(spec: NetworkSpec, frames: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Cut off the sky, pool (mean of each square, halves rounded up) and fold blocks of pixels into channels.

    Args:
        spec: The network the frames are for.
        frames: Camera images  (N, H, W).

    Returns:
        New array  (N, *observation_shape(spec)).

    Raises:
        ShapeError: The frames are not uint8 images of the network's size.
    """
    height, width = spec.frame_shape
    if frames.dtype != np.uint8 or frames.ndim != 3 or frames.shape[1:] != (height, width):
        raise ShapeError(
            f"frames are {frames.dtype} of shape {frames.shape}, expected uint8 of (N, {height}, {width})."
        )
    pixels = np.ascontiguousarray(frames[:, sky_rows(spec) :])
    if architecture(spec.name).pool == 2:
        pairs = pixels.view(np.uint16)  # two neighbours in one word: sums of whole rows at SIMD speed
        sums = (pairs & 255) + (pairs >> 8)
        pixels = ((sums[:, 0::2] + sums[:, 1::2] + 2) >> 2).astype(np.uint8)
    rows, columns, channels = observation_shape(spec)
    block = block_size(spec)
    folded = pixels.reshape(len(pixels), rows, block, columns, block).transpose(0, 1, 3, 2, 4)
    # ascontiguousarray would return the frames themselves where nothing moves; the caller wants its own copy
    return np.array(folded, order="C").reshape(len(pixels), rows, columns, channels)


def flat_size(spec: NetworkSpec) -> int:
    """Inputs of the first dense layer after the camera's convolutions."""
    arch = architecture(spec.name)
    height, width = pooled_shape(spec)
    for conv in arch.convs:
        height = (height - conv.kernel) // conv.stride + 1
        width = (width - conv.kernel) // conv.stride + 1
    if height < 1 or width < 1:
        raise ConfigError(f"frame_shape {spec.frame_shape} is too small for the network {spec.name}.")
    return height * width * arch.convs[-1].filters


def weight_shapes(spec: NetworkSpec) -> dict[str, tuple[int, ...]]:
    """Name and shape of every parameter, in the fixed order of the towers."""
    arch = architecture(spec.name)
    shapes: dict[str, tuple[int, ...]] = {}

    def dense(tower: str, inputs: int, units: tuple[int, ...], outputs: int) -> None:
        for i, size in enumerate(units, 1):
            shapes[f"{tower}.dense{i}.weight"], shapes[f"{tower}.dense{i}.bias"] = (size, inputs), (size,)
            inputs = size
        shapes[f"{tower}.head.weight"], shapes[f"{tower}.head.bias"] = (outputs, inputs), (outputs,)

    def camera(tower: str, outputs: int) -> None:
        channels = 1
        for i, conv in enumerate(arch.convs, 1):
            shapes[f"{tower}.conv{i}.weight"] = (conv.filters, channels, conv.kernel, conv.kernel)
            shapes[f"{tower}.conv{i}.bias"] = (conv.filters,)
            channels = conv.filters
        dense(tower, flat_size(spec), arch.dense, outputs)

    camera("policy", spec.num_actions)
    if not spec.is_discrete:
        shapes["policy.log_std"] = (spec.num_actions,)
    if spec.state_size:
        dense("critic", spec.state_size, CRITIC_UNITS, 1)
    else:
        camera("critic", 1)
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
            begin = architecture(spec.name).log_std if name == "policy.log_std" else 0.0
            weights[name] = np.full(shape, begin, np.float32)
            continue
        gain = {"policy.head.weight": 0.01, "critic.head.weight": 1.0}.get(name, 2.0**0.5)
        rows, columns = shape[0], int(np.prod(shape[1:]))
        vectors = np.ascontiguousarray(normals(rng, rows * columns).reshape(max(rows, columns), -1).T)
        orthonormalize(vectors)
        matrix = vectors if rows < columns else vectors.T
        weights[name] = (gain * matrix).reshape(shape).astype(np.float32)
    return weights


def parameter_count(spec: NetworkSpec, *, tower: str = "") -> int:
    """Number of parameters, of one tower (``"policy"`` or ``"critic"``) or of both."""
    return sum(int(np.prod(shape)) for name, shape in weight_shapes(spec).items() if name.startswith(tower))


def forward_operations(spec: NetworkSpec) -> int:
    """Floating-point operations of one forward pass for one car, both towers; biases and activations not counted."""
    arch = architecture(spec.name)
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
