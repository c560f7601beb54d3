"""The network that looks: pictures in, beliefs out.

pictures ──observe──▶ observations ──native core──▶ outputs ──believe──▶ Belief
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray
from safetensors.numpy import load as load_tensors
from safetensors.numpy import save as save_tensors

from racecraft.errors import CheckpointError
from racecraft.learn.native_regressor import NativeRegressor
from racecraft.learn.networks import PERCEIVER
from racecraft.perception.answers import (
    HALF,
    LOG_LIMITS,
    NUM_CONTINUOUS,
    NUM_OUTPUTS,
    NUM_REGIONS,
    NUM_TARGETS,
    NUMBERS,
    REGION_COLUMNS,
    REGION_ROWS,
    ROWS,
)
from racecraft.perception.memory import Memory
from racecraft.perception.mirror import mirrored_answers, mirrored_observations

WEIGHTS: Final = Path(__file__).with_name("weights.safetensors")
"""What `racecraft perceive --train` made and the package brings along: float16, and steps of the largest matrix."""
STEP: Final = ".step"
"""Behind the name of a large matrix: what one of its whole numbers is worth, in each row."""
MEMORY: Final = "memory."
"""Before the names of the memory's weights."""
LARGE: Final = 100_000
"""Weights in a matrix that is kept so; coarser outputs would put the road one or two millimetres aside."""
MEAN, SPREAD = 112.0, 48.0
"""Mean and standard deviation that a picture's brightness is brought to, in levels of 255."""
LEAST_SPREAD: Final = 4.0
"""Standard deviation, in levels, that the picture of a wall has: less is noise, and is not made more of."""
MAX_WEIGHTS: Final = 16_000_000
"""Bytes of a file of weights; ours has 0.8 million."""


@dataclass(frozen=True)
class Belief:
    """What is believed of N pictures; every ``*_error`` is the mean distance to the truth that is expected."""

    on_road: NDArray[np.float32]
    """Probability that there is road below the lens  (N,)."""
    offset: NDArray[np.float32]
    """m, of the lens from the road's middle, left positive  (N,)."""
    offset_error: NDArray[np.float32]
    """m  (N,)."""
    heading: NDArray[np.float32]
    """rad, of the lens against the road beside it, turned left positive  (N,)."""
    heading_error: NDArray[np.float32]
    """rad  (N,)."""
    heading_ahead: NDArray[np.float32]
    """rad, of the lens against where the road beside it leads over the next 40 cm, turned left positive  (N,)."""
    heading_ahead_error: NDArray[np.float32]
    """rad  (N,)."""
    half_width: NDArray[np.float32]
    """m, half the road's width  (N,)."""
    curvature: NDArray[np.float32]
    """1/m, of the road's middle 0.5, 1 and 2 m ahead, to the left positive  (N, 3)."""
    curvature_error: NDArray[np.float32]
    """1/m  (N, 3)."""
    closeness: NDArray[np.float32]
    """1 / (1 + m to the next object ahead), 0 where there is none  (N,)."""
    closeness_error: NDArray[np.float32]
    """The same  (N,)."""
    middle: NDArray[np.float32]
    """Column of a picture of 160 x 120 where the road's middle is in each of `ROWS`  (N, R)."""
    middle_error: NDArray[np.float32]
    """Columns  (N, R)."""
    is_middle: NDArray[np.float32]
    """Probability that it is in the picture in that row  (N, R)."""
    regions: NDArray[np.float32]
    """Probability that there is road at `REGION_ROWS` and `REGION_COLUMNS`  (N, 6, 8)."""

    def __len__(self) -> int:
        return len(self.on_road)


class Perceiver:
    """Looks at pictures, each by itself; who has them in order asks a `Watcher`, which remembers those before.

    Args:
        weights: A file of weights; None begins untrained, from `seed`.
        seed: Of untrained weights.
        num_threads: 0 takes every core. Results are the same for any number.

    Raises:
        CheckpointError: The file is missing, damaged, or not of this network.
    """

    def __init__(self, weights: Path | None = WEIGHTS, *, seed: int = 0, num_threads: int = 0) -> None:
        self.network = NativeRegressor(
            PERCEIVER, NUM_OUTPUTS, seed=seed if weights is None else None, num_threads=num_threads
        )
        self.memory: Memory | None = None
        """For pictures in order; None where the weights are without."""
        if weights is not None:
            self._load(weights)

    def __call__(self, frames: NDArray[np.uint8]) -> Belief:
        """What is believed of some pictures, grey uint8 (N, 120, 160): the mean of them and of them in a mirror.

        Raises:
            ShapeError: They are not of this type and shape.
        """
        return believe(self.outputs(frames))

    def outputs(self, frames: NDArray[np.uint8]) -> NDArray[np.float32]:
        """The same as the network tells it  (N, NUM_OUTPUTS).

        Raises:
            ShapeError: The pictures are not of this type and shape.
        """
        observations = self.observe(frames)
        straight = self.network.policy(observations)
        turned = self.network.policy(mirrored_observations(observations))
        return np.asarray(np.float32(0.5) * (straight + mirrored_answers(turned)))

    def observe(self, frames: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """What the network sees of pictures: without their sky, pooled, and of one brightness and contrast.

        Raises:
            ShapeError: They are not uint8 (N, 120, 160).
        """
        return of_one_brightness(self.network.encode(frames))

    def save(self, path: Path) -> None:
        """Write the weights: the large matrix, nine tenths of all, in 255 steps a row, and the rest in float16."""
        path.write_bytes(save_tensors(self._kept()))

    def settle(self) -> None:
        """Round the weights to what `save` keeps of them."""
        self._take(self._kept())

    def _kept(self) -> dict[str, NDArray[np.generic]]:
        weights = {name: array for name, array in self.network.weights().items() if name.startswith("policy.")}
        remembers = {} if self.memory is None else self.memory.weights
        return _packed(weights) | {MEMORY + name: array.astype(np.float16) for name, array in remembers.items()}

    def _load(self, path: Path) -> None:
        try:
            with path.open("rb") as file:
                data = file.read(MAX_WEIGHTS + 1)
        except OSError as error:
            told = error.strerror or error
            raise CheckpointError(f"The weights of perception in {path} cannot be read: {told}.") from error
        if len(data) > MAX_WEIGHTS:
            raise CheckpointError(f"The weights of perception in {path} are larger than {MAX_WEIGHTS // 10**6} MB.")
        try:
            stored: Mapping[str, NDArray[np.generic]] = load_tensors(data)
        except Exception as error:  # whatever the reader makes of what is no such file
            raise CheckpointError(f"The weights of perception in {path} cannot be read: {error}.") from error
        if not all(np.isfinite(array).all() for array in stored.values()):
            raise CheckpointError(f"The weights of perception in {path} are not all finite.")
        try:
            self._take(stored)
        except ValueError as error:
            raise CheckpointError(f"The weights of perception in {path} cannot be read: {error}.") from error

    def _take(self, stored: Mapping[str, NDArray[np.generic]]) -> None:
        """Have the weights of a file.

        Raises:
            ValueError: They do not go together.
            CheckpointError: They are of another network.
        """
        weights = _unpacked(stored)
        remembers = {name: weights.pop(name).astype(np.float64) for name in list(weights) if name.startswith(MEMORY)}
        critic = {name: array for name, array in self.network.weights().items() if name.startswith("critic.")}
        self.network.load_weights(weights | critic)
        self.memory = Memory.of({name.removeprefix(MEMORY): array for name, array in remembers.items()})


def _packed(weights: Mapping[str, NDArray[np.float32]]) -> dict[str, NDArray[np.generic]]:
    packed: dict[str, NDArray[np.generic]] = {}
    for name, array in weights.items():
        if array.size >= LARGE:
            step = (np.abs(array).max(axis=1, keepdims=True) / 127.0).astype(np.float32)
            packed[name] = np.rint(array / np.where(step > 0.0, step, 1.0)).astype(np.int8)
            packed[name + STEP] = step
        else:
            packed[name] = array.astype(np.float16)
    return packed


def _unpacked(stored: Mapping[str, NDArray[np.generic]]) -> dict[str, NDArray[np.float32]]:
    """Weights by name.

    Raises:
        ValueError: Whole numbers have no step for each of their rows, or a step is of nothing.
    """
    weights = {name: np.asarray(array, np.float32) for name, array in stored.items() if not name.endswith(STEP)}
    whole = {name for name in weights if stored[name].dtype == np.int8}
    if whole != {name.removesuffix(STEP) for name in stored if name.endswith(STEP)}:
        raise ValueError("its whole numbers and their steps do not go together")
    for name in whole:
        step = np.asarray(stored[name + STEP], np.float32)
        if step.shape != (*weights[name].shape[:1], 1):
            raise ValueError(f"{name} has not one step for each of its rows")
        weights[name] *= step
    return weights


def of_one_brightness(observations: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Each with a mean of `MEAN` and a standard deviation of `SPREAD`, from sums of whole numbers.

    Args:
        observations: (N, ...).
    """
    flat = observations.reshape(len(observations), -1)
    size = flat.shape[1]
    wide = flat.astype(np.uint32)
    sums, squares = wide.sum(axis=1, dtype=np.int64), (wide * wide).sum(axis=1, dtype=np.int64)
    variance = (squares * size - sums * sums) / (size * size)
    gain = SPREAD / np.maximum(np.sqrt(variance), LEAST_SPREAD)
    levels = (np.arange(256) - (sums / size)[:, None]) * gain[:, None] + MEAN
    table = np.rint(levels).clip(0, 255).astype(np.uint8)
    return np.take_along_axis(table, flat.astype(np.intp), axis=1).reshape(observations.shape)


def believe(outputs: NDArray[np.float32]) -> Belief:
    """What the outputs of the network mean  (N, NUM_OUTPUTS)."""
    units = np.array([*NUMBERS.values(), *[HALF] * len(ROWS)], np.float32)
    told = outputs[:, :NUM_CONTINUOUS] * units
    errors = np.exp(outputs[:, NUM_TARGETS:].clip(*LOG_LIMITS)) * units
    yes = 1.0 / (1.0 + np.exp(-outputs[:, NUM_CONTINUOUS:NUM_TARGETS].clip(-30.0, 30.0)))
    rows, numbers = len(ROWS), len(NUMBERS)
    return Belief(
        on_road=yes[:, -1],
        offset=told[:, 0],
        offset_error=errors[:, 0],
        heading=told[:, 1],
        heading_error=errors[:, 1],
        heading_ahead=told[:, 7],
        heading_ahead_error=errors[:, 7],
        half_width=told[:, 2],
        curvature=told[:, 3:6],
        curvature_error=errors[:, 3:6],
        closeness=told[:, 6].clip(0.0, 1.0),
        closeness_error=errors[:, 6],
        middle=told[:, numbers:] + np.float32(HALF - 0.5),
        middle_error=errors[:, numbers:],
        is_middle=yes[:, :rows],
        regions=yes[:, rows : rows + NUM_REGIONS].reshape(-1, len(REGION_ROWS), len(REGION_COLUMNS)),
    )
