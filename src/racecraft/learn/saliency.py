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


@dataclass(frozen=True, kw_only=True)
class Pass:
    """What a policy's tower made of one image."""

    maps: list[Floats]
    """The image, and the map of each convolution, from the first on  (channels, rows, columns)."""
    dense: list[Floats]
    """The last map, flattened, and what each dense layer made of it  (units,)."""
    outputs: Floats
    """(A,)."""

    @property
    def shown(self) -> int:
        """Which map a picture is made of: the deepest that still has rows and columns to show."""
        chosen = len(self.maps) - 1
        while chosen > 1 and (self.maps[chosen].shape[1] < LEAST_ROWS or self.maps[chosen].shape[2] < LEAST_COLUMNS):
            chosen -= 1
        return chosen


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
    if architecture_of(spec).told:
        raise ConfigError(f"Grad-CAM explains networks that see pictures; {spec.name} sees what is told of them.")
    check_explained(spec, frame)
    seen = forward(spec, weights, pooled(spec, frame)[None] / np.float32(255.0))
    chosen = target_of(spec, seen.outputs) if target is None else target
    slope = slope_at(spec, weights, seen, np.eye(len(seen.outputs), dtype=np.float32)[chosen], seen.shown)
    cells = cells_of(seen, slope)
    return Saliency(
        picture=on_the_frame(spec, cells, seen.shown),
        cells=cells,
        layer=f"conv{seen.shown}",
        outputs=seen.outputs,
        target=chosen,
    )


def check_explained(spec: NetworkSpec, frame: NDArray[np.uint8]) -> None:
    """Refuse what cannot be explained by one picture.

    Raises:
        ConfigError: The network sees through other sensors, too.
        ShapeError: The frame is not of the network's size.
    """
    if spec.lenses != 1 or spec.lidar_size:
        raise ConfigError("Grad-CAM explains networks that see one camera alone; this one has other sensors, too.")
    if frame.shape != spec.frame_shape:
        raise ShapeError(f"frame has shape {frame.shape}, expected {spec.frame_shape}.")


def target_of(spec: NetworkSpec, outputs: Floats) -> int:
    """The output to explain where none is named: the largest, of a continuous policy the steering."""
    return int(outputs.argmax()) if spec.is_discrete else 0


def forward(spec: NetworkSpec, weights: Weights, x: Floats) -> Pass:
    """What the policy's tower makes of an image of 0 to 1  (1, rows, columns)."""
    arch = architecture_of(spec)
    maps = [x]
    for index, conv in enumerate(arch.convs, 1):
        weight, bias = weights[f"policy.conv{index}.weight"], weights[f"policy.conv{index}.bias"]
        maps.append(np.maximum(_convolved(maps[-1], weight, bias, conv), 0.0))
    # the camera tower flattens in the order row, column, channel
    dense = [np.ascontiguousarray(maps[-1].transpose(1, 2, 0)).ravel()]
    for index in range(1, len(arch.dense) + 1):
        weight, bias = weights[f"policy.dense{index}.weight"], weights[f"policy.dense{index}.bias"]
        dense.append(np.maximum(weight @ dense[-1] + bias, 0.0))
    outputs = weights["policy.head.weight"] @ dense[-1] + weights["policy.head.bias"]
    return Pass(maps=maps, dense=dense, outputs=outputs.astype(np.float32))


def slope_at(spec: NetworkSpec, weights: Weights, seen: Pass, slope: Floats, layer: int) -> Floats:
    """How a sum of outputs changes with a map, 0 for the image itself  (channels, rows, columns).

    Args:
        spec: The network.
        weights: Its parameters.
        seen: What it made of an image.
        slope: How much each output counts  (A,).
        layer: Which map.
    """
    gradient = slope @ weights["policy.head.weight"]
    for index in range(len(seen.dense) - 1, 0, -1):
        gradient = (gradient * (seen.dense[index] > 0)) @ weights[f"policy.dense{index}.weight"]
    channels, rows, columns = seen.maps[-1].shape
    found = gradient.reshape(rows, columns, channels).transpose(2, 0, 1)
    convs = architecture_of(spec).convs
    for index in range(len(convs), layer, -1):
        weight = weights[f"policy.conv{index}.weight"]
        found = _backward(found * (seen.maps[index] > 0), weight, convs[index - 1], seen.maps[index - 1].shape)
    return found


def cells_of(seen: Pass, slope: Floats) -> Floats:
    """What remains positive of the weighted sum of the map that is shown  (rows, columns)."""
    return np.asarray(np.maximum((slope.mean(axis=(1, 2))[:, None, None] * seen.maps[seen.shown]).sum(axis=0), 0.0))


def pooled(spec: NetworkSpec, frame: NDArray[np.uint8]) -> Floats:
    """The image as the first convolution sees it, rounded as training rounds it, of 0 to 255."""
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


def on_the_frame(spec: NetworkSpec, picture: Floats, layer: int) -> Floats:
    """The cells of a map enlarged to the camera's image: each stands at the middle of what it sees  (H, W)."""
    stride, first = 1, 0.0
    for conv in architecture_of(spec).convs[:layer]:
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
