"""The network that looks: pictures in, beliefs out.

pictures ──observe──▶ observations ──native core──▶ outputs ──believe──▶ Belief
"""

from __future__ import annotations

from collections.abc import Mapping
from os import PathLike
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray
from safetensors.numpy import load as load_tensors
from safetensors.numpy import save as save_tensors

from racecraft.checks import check_type, check_whole, shown
from racecraft.errors import CheckpointError, RunError, ShapeError
from racecraft.json_file import open_regular
from racecraft.learn.native_regressor import NativeRegressor
from racecraft.learn.networks import PERCEIVER
from racecraft.perception.answers import NUM_OUTPUTS
from racecraft.perception.belief import Belief, believe
from racecraft.perception.memory import Memory
from racecraft.perception.mirror import mirrored_answers, mirrored_observations
from racecraft.perception.packing import packed, unpacked
from racecraft.run.atomic import write_file

WEIGHTS: Final = Path(__file__).with_name("weights.safetensors")
"""What `racecraft perceive --train` made and the package brings along."""
MEMORY: Final = "memory."
"""Before the names of the memory's weights."""
MEAN, SPREAD = 112.0, 48.0
"""Mean and standard deviation that a picture's brightness is brought to, in levels of 255."""
LEAST_SPREAD: Final = 4.0
"""Standard deviation, in levels, that the picture of a wall has: less is noise, and is not made more of."""
MAX_WEIGHTS: Final = 16_000_000
"""Bytes of a file of weights; ours has 0.9 million."""


class Perceiver:
    """Looks at pictures, each by itself; who has them in order asks a `Watcher`, which remembers those before.

    Args:
        weights: A file of weights; None begins untrained, from `seed`.
        seed: Of untrained weights.
        num_threads: 0 takes every core. Results are the same for any number.

    Raises:
        ConfigError: The seed or the number of threads is none.
        CheckpointError: The file is missing, damaged, or not of this network.
    """

    def __init__(self, weights: Path | None = WEIGHTS, *, seed: int = 0, num_threads: int = 0) -> None:
        check_whole("seed", seed, 0, 2**63 - 1)
        check_whole("num_threads", num_threads, 0, 1024)
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
        if not isinstance(frames, np.ndarray):
            raise ShapeError(f"frames are {shown(frames)}, expected an array of uint8, (N, 120, 160).")
        return of_one_brightness(self.network.encode(frames))

    def save(self, path: str | Path) -> None:
        """Replace a file of weights by these.

        Raises:
            ConfigError: It is no path.
            RunError: It cannot be written; an older one is still whole.
        """
        check_type("path", path, (str, PathLike), "use a file's path")
        try:
            write_file(Path(path), save_tensors(self._kept()))
        except OSError as error:
            raise RunError(f"{path} cannot be written: {error.strerror or error}.") from error

    def settle(self) -> None:
        """Round the weights to what `save` keeps of them."""
        self._take(self._kept())

    def _kept(self) -> dict[str, NDArray[np.generic]]:
        weights = {name: array for name, array in self.network.weights().items() if name.startswith("policy.")}
        memory = {} if self.memory is None else self.memory.weights
        return packed(weights) | {MEMORY + name: array.astype(np.float16) for name, array in memory.items()}

    def _load(self, path: Path) -> None:
        try:
            with open_regular(path) as file:
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
        try:
            self._take(stored)
        except ValueError as error:
            raise CheckpointError(f"The weights of perception in {path} cannot be read: {error}.") from error

    def _take(self, stored: Mapping[str, NDArray[np.generic]]) -> None:
        """Have the weights of a file.

        Raises:
            ValueError: They do not go together, or are not finite.
            CheckpointError: They are of another network.
        """
        weights = unpacked(stored)
        memory = {name.removeprefix(MEMORY): weights.pop(name) for name in list(weights) if name.startswith(MEMORY)}
        critic = {name: array for name, array in self.network.weights().items() if name.startswith("critic.")}
        self.network.load_weights(weights | critic)
        self.memory = Memory.of(memory)


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
