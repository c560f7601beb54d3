"""Which parts of a camera image a policy's output hangs on: Grad-CAM on the policy's tower, in plain NumPy.

Forward to a convolution's maps A_k, backward from one output y; a map's weight is the mean of dy/dA_k over its
places, and the picture is what remains positive of the weighted sum (https://arxiv.org/abs/1610.02391). The deepest
convolution that still has a picture to show is taken: at least four rows and eight columns.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from racecraft.errors import ConfigError, ShapeError
from racecraft.learn.learner import NetworkSpec, Weights
from racecraft.learn.networks import Conv, architecture_of, pooled_shape, sky_rows

Floats = NDArray[np.float32]

LEAST_ROWS: Final = 4
LEAST_COLUMNS: Final = 8


@dataclass(frozen=True, kw_only=True)
class Saliency:
    """What an output hangs on."""

    picture: Floats
    """0 to 1 for every pixel of the camera's image; 0 where the network does not look  (H, W)."""
    cells: Floats
    """The same on the convolution's own places, not scaled  (rows, columns)."""
    layer: str
    """The convolution it was taken from, ``conv2``."""
    outputs: Floats
    """Of the policy, before the softmax  (A,)."""
    target: int
    """The output that was explained."""


def grad_cam(spec: NetworkSpec, weights: Weights, frame: NDArray[np.uint8], *, target: int | None = None) -> Saliency:
    """Explain one output of a policy for one camera image.

    Args:
        spec: The network.
        weights: Its parameters.
        frame: Camera image  (H, W).
        target: Which output; by default the largest one, of a continuous policy the steering.

    Raises:
        ConfigError: The network sees through other sensors, too, or no pictures at all.
        ShapeError: The frame is not of the network's size.
    """
    if spec.lenses != 1 or spec.lidar_size:
        raise ConfigError("Grad-CAM explains networks that see one camera alone; this one has other sensors, too.")
    if architecture_of(spec).told:
        raise ConfigError(f"Grad-CAM explains networks that see pictures; {spec.name} sees what is told of them.")
    if frame.shape != spec.frame_shape:
        raise ShapeError(f"frame has shape {frame.shape}, expected {spec.frame_shape}.")
    arch = architecture_of(spec)
    x = _pooled(spec, frame)[None] / np.float32(255.0)
    maps = []
    for index, conv in enumerate(arch.convs, 1):
        weight, bias = weights[f"policy.conv{index}.weight"], weights[f"policy.conv{index}.bias"]
        x = np.maximum(_convolved(x, weight, bias, conv), 0.0)
        maps.append(x)
    # the camera tower flattens in the order row, column, channel
    layers = [np.ascontiguousarray(x.transpose(1, 2, 0)).ravel()]
    names = [f"policy.dense{index}" for index in range(1, len(arch.dense) + 1)]
    for name in names:
        layers.append(np.maximum(weights[f"{name}.weight"] @ layers[-1] + weights[f"{name}.bias"], 0.0))
    outputs = weights["policy.head.weight"] @ layers[-1] + weights["policy.head.bias"]
    if target is None:
        target = int(outputs.argmax()) if spec.is_discrete else 0

    gradient = weights["policy.head.weight"][target]
    for name, above in zip(reversed(names), reversed(layers[1:]), strict=True):
        gradient = (gradient * (above > 0)) @ weights[f"{name}.weight"]
    channels, rows, columns = maps[-1].shape
    slope = gradient.reshape(rows, columns, channels).transpose(2, 0, 1)
    chosen = len(maps) - 1
    while chosen > 0 and (maps[chosen].shape[1] < LEAST_ROWS or maps[chosen].shape[2] < LEAST_COLUMNS):
        weight = weights[f"policy.conv{chosen + 1}.weight"]
        slope = _backward(slope * (maps[chosen] > 0), weight, arch.convs[chosen], maps[chosen - 1].shape)
        chosen -= 1
    picture = np.maximum((slope.mean(axis=(1, 2))[:, None, None] * maps[chosen]).sum(axis=0), 0.0)
    return Saliency(
        picture=_on_the_frame(spec, picture, arch.convs[: chosen + 1]),
        cells=picture,
        layer=f"conv{chosen + 1}",
        outputs=outputs.astype(np.float32),
        target=target,
    )


def _pooled(spec: NetworkSpec, frame: NDArray[np.uint8]) -> Floats:
    """The image as the first convolution sees it, rounded as training rounds it."""
    pixels = frame[sky_rows(spec) :].astype(np.uint16)
    if architecture_of(spec).pool == 2:
        height, width = pooled_shape(spec)
        pixels = (pixels.reshape(height, 2, width, 2).sum(axis=(1, 3)) + 2) >> 2
    return pixels.astype(np.float32)


def _windows(x: Floats, conv: Conv) -> NDArray[np.float32]:
    """Views of what each place of the result sees  (C, rows, columns, K, K)."""
    views = np.lib.stride_tricks.sliding_window_view(x, (conv.kernel, conv.kernel), axis=(1, 2))
    return views[:, :: conv.stride, :: conv.stride]


def _convolved(x: Floats, weight: Floats, bias: Floats, conv: Conv) -> Floats:
    return np.asarray(np.einsum("cyxij,fcij->fyx", _windows(x, conv), weight, optimize=True) + bias[:, None, None])


def _backward(slope: Floats, weight: Floats, conv: Conv, shape: tuple[int, ...]) -> Floats:
    """Gradient by the input of a convolution, from that by its output."""
    found = np.zeros(shape, np.float32)
    rows, columns = slope.shape[1:]
    spread = np.einsum("fyx,fcij->cijyx", slope, weight, optimize=True)
    for i in range(conv.kernel):
        for j in range(conv.kernel):
            y, x = slice(i, i + rows * conv.stride, conv.stride), slice(j, j + columns * conv.stride, conv.stride)
            found[:, y, x] += spread[:, i, j]
    return found


def _on_the_frame(spec: NetworkSpec, picture: Floats, convs: tuple[Conv, ...]) -> Floats:
    """Enlarged to the camera's image: every place of a map stands at the middle of what it sees."""
    stride, first = 1, 0.0
    for conv in convs:
        first += 0.5 * (conv.kernel - 1) * stride
        stride *= conv.stride
    pool, sky = architecture_of(spec).pool, sky_rows(spec)
    height, width = spec.frame_shape
    rows = ((np.arange(sky, height) - sky + 0.5) / pool - 0.5 - first) / stride
    columns = ((np.arange(width) + 0.5) / pool - 0.5 - first) / stride
    tall = np.stack([np.interp(rows, np.arange(len(picture)), column) for column in picture.T], axis=1)
    full = np.stack([np.interp(columns, np.arange(picture.shape[1]), row) for row in tall])
    largest = float(full.max())
    found = np.zeros(spec.frame_shape, np.float32)
    found[sky:] = full / largest if largest > 0 else 0.0
    return found
