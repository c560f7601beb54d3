"""A numeric reward function as a kernel of the GPU, believed only after it gave the interpreter's rewards.

rows on the device -> pay_cars -> rewards on the device
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from racecraft.errors import ConfigError
from racecraft.gpu import Device
from racecraft.reward.cuda_source import cuda_source
from racecraft.reward.numeric import NotNumeric
from racecraft.reward.worker import waypoints_of
from racecraft.track.track import Track

THREADS: Final = 128
TOLERANCE: Final = 1e-9
"""Largest difference to the interpreter, relative to rewards above 1: sine and power differ in their last bits."""


class CudaReward:
    """A reward function on a device.

    Args:
        source: Text of a ``reward_function.py`` that passed the check.
        tracks: Those of the simulation.
        device: Where rows and rewards lie.
        width: Columns of a row.
        include: Folder of the kernels' headers.

    Raises:
        NotNumeric: The function is not one that can be translated; the message says why.
    """

    def __init__(self, source: str, tracks: Sequence[Track], *, device: Device, width: int, include: Path) -> None:
        try:
            device.load(
                cuda_source(source), name="reward_function.cu", kernels=["pay_cars"], include=include, defines={}
            )
        except ConfigError as error:
            raise NotNumeric("its translation does not compile") from error
        lines = waypoints_of(tracks)
        points = np.array([point for line in lines for point in line], np.float64)
        first = np.cumsum([0, *(len(line) for line in lines)]).astype(np.int32)
        self._device = device
        self._width = width
        self._points = device.allocate(points.nbytes)
        device.write(self._points, points)
        self._first = device.allocate(first.nbytes)
        device.write(self._first, first)

    def pay(self, rows: int, rewards: int, *, count: int, stream: int = 0) -> None:
        """Queue the rewards of rows.

        Args:
            rows: Address of float64 (count, width).
            rewards: Address of float64 (count,); NaN where the function would raise or return no finite number.
            count: Rows.
            stream: Of the launch.
        """
        task = np.zeros(1, dtype="u8,u8,u8,u8,i4,i4")
        task[0] = (rows, rewards, self._points, self._first, count, self._width)
        self._device.launch(
            "pay_cars",
            blocks=-(-count // THREADS),
            threads=THREADS,
            batch=task.view(np.uint8),
            input=0,
            extra=0,
            stream=stream,
        )

    def prove(self, interpret: Callable[[Any], NDArray[np.float64]], rows: NDArray[np.float64]) -> None:
        """Compare with the interpreter on recorded rows.

        Args:
            interpret: The interpreter: rows in, rewards out.
            rows: (N, width).

        Raises:
            NotNumeric: A reward differs.
        """
        address = self._device.allocate(rows.nbytes)
        rewards = self._device.allocate(8 * len(rows))
        self._device.write(address, rows)
        self.pay(address, rewards, count=len(rows))
        ours = self._device.read(rewards, 8 * len(rows)).view(np.float64)
        theirs = interpret(rows)
        limit = TOLERANCE * np.maximum(1.0, np.abs(theirs))
        differs = ~(np.abs(ours - theirs) <= limit)  # NaN differs
        if differs.any():
            row = int(np.flatnonzero(differs)[0])
            raise NotNumeric(f"on the GPU it gave {ours[row]!r} where the interpreter gave {theirs[row]!r}")
