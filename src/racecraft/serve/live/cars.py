"""The cars of a training as they drive: one small file in memory, written by the job, read by the server.

Poses, not video: the browser draws. A writer never waits for readers; a reader that catches it in the middle of a
writing tries again (a sequence lock: the number is odd while something is written).

    header   int64 (9)            sequence, step, time in ns, N cars, H, W, A actions, K objects,
                                  kind (0 discrete, 1 continuous)
    poses    float32 (N, 6)       x, y, heading, speed, steering (SI), share of the lap driven
    steps    int32 (N)            of the episode: smaller than before means the car was put at a new start
    objects  float32 (K, 4)       around car 0: kind, x, y, heading
    policy   float32 (A)          of car 0: probabilities, or mean steering and speed from -1 to 1
    frame    uint8 (H, W)         what car 0 sees
"""

from __future__ import annotations

import os
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from racecraft.race.policy import NetworkPolicy
from racecraft.sim import Simulation
from racecraft.sim.columns import ROW_COLUMNS
from racecraft.sim.objects import OBJECT_KINDS

NAME: Final = ".live"
"""Of the file, in the run folder."""
SPACING: Final = 0.05  # s between two looks, at least
MAX_CARS: Final = 256  # that are shown
MAX_BYTES: Final = 1 << 20
LARGEST: Final = 1e6  # of any number that is shown, in its unit; roads lie within 10,000 m
HEADER: Final = 9  # int64
POSE: Final = 6
OBJECT: Final = 4
STALE: Final = 120.0  # s after which a training that was killed no longer counts as live
_OBJECT_COLUMNS: Final = ("object_kind", "object_x", "object_y", "object_heading")
_ROWS: Final = [ROW_COLUMNS.index(name) for name in ("progress", "steps")]


@dataclass(frozen=True, kw_only=True)
class Look:
    """One moment of a training."""

    sequence: int
    step: int
    """Camera steps of training so far."""
    poses: NDArray[np.float32]
    """(N, 6)"""
    steps: NDArray[np.int32]
    """(N,)"""
    objects: NDArray[np.float32]
    """Kind (index into `racecraft.sim.objects.OBJECT_KINDS`), x, y, heading of what is around car 0  (K, 4)."""
    policy: NDArray[np.float32]
    """(A,)"""
    is_discrete: bool
    frame: NDArray[np.uint8]
    """(H, W)"""


class LiveWriter:
    """Lets others look at a training.

    Args:
        folder: The run folder; the file is made anew.
        simulation: The cars, read at every `look`.
        policy: What drives them.
    """

    def __init__(self, folder: Path, simulation: Simulation, policy: NetworkPolicy) -> None:
        self._simulation, self._policy = simulation, policy
        self._count = min(simulation.num_envs, MAX_CARS)
        self._is_discrete = policy.learner.spec.is_discrete
        size = policy.learner.spec.num_actions
        height, width = simulation.frames.shape[-2:]
        sizes = [self._count, height, width, size, simulation.num_objects]
        header = np.array([0, 0, 0, *sizes, not self._is_discrete], np.int64)
        fresh = folder / f"{NAME}.new"
        length = _length(*sizes)
        np.memmap(fresh, np.uint8, "w+", shape=(length,))[: header.nbytes] = header.view(np.uint8)
        os.replace(fresh, folder / NAME)  # a reader of the old one keeps it
        self._memory = np.memmap(folder / NAME, np.uint8, "r+", shape=(length,))
        parts = _parts(self._memory, header.tolist())
        self._header, self._poses, self._steps, self._objects, self._outputs, self._frame = parts
        self._next = 0.0

    def look(self, *, step: int) -> None:
        """Show where everything is now; does nothing when the last look was a moment ago."""
        if time.monotonic() < self._next:
            return
        self._next = time.monotonic() + SPACING
        simulation, count = self._simulation, self._count
        self._header[0] += 1
        self._poses[:, :3] = simulation.vehicles[:3, :count].T
        self._poses[:, 3] = simulation.vehicles[3, :count]
        self._poses[:, 4] = simulation.vehicles[6, :count]
        self._poses[:, 5] = simulation.rows[:count, _ROWS[0]]
        self._steps[:] = simulation.rows[:count, _ROWS[1]]
        if simulation.num_objects:
            for column, name in enumerate(_OBJECT_COLUMNS):
                self._objects[:, column] = simulation.object_column(name)[0]
        self._outputs[:] = self._decide()
        frames = simulation.frames
        self._frame[:] = frames[0] if frames.ndim == 3 else frames[0, 0]  # of two lenses the left one
        self._header[1], self._header[2] = step, time.time_ns()
        self._header[0] += 1

    def close(self) -> None:
        """The training has ended: there is nothing to look at any more."""
        self._header[2] = 0
        self._header[0] += 2  # new to who copies it to another machine

    def _decide(self) -> NDArray[np.float32]:
        learner = self._policy.learner
        sight = self._policy.sensors.read(self._simulation)
        outputs = learner.policy(learner.encode(sight[:1]))[0]
        if not self._is_discrete:
            return np.asarray(outputs[: learner.spec.num_actions].clip(-1.0, 1.0), np.float32)
        shares = np.exp(outputs - outputs.max())
        return np.asarray(shares / shares.sum(), np.float32)


class LiveReader:
    """Looks at a training of any process.

    Args:
        folder: The run folder.
    """

    def __init__(self, folder: Path) -> None:
        self._path = folder / NAME
        self._memory: NDArray[np.uint8] | None = None
        self._inode = 0
        self._taken = 0  # by `snapshot`

    @property
    def is_live(self) -> bool:
        """Whether there is a training to look at; its cars may stand still while it learns."""
        memory = self._open()
        return memory is not None and _is_fresh(memory[: HEADER * 8].view(np.int64).tolist())

    def look(self, *, after: int = -1) -> Look | None:
        """The present moment, or None when there is none, it is stale, or it is the one with number `after`.

        None, too, of one that cannot be, as another machine may have written it.
        """
        memory = self._open()
        if memory is None:
            return None
        for _ in range(20):
            header = memory[: HEADER * 8].view(np.int64).tolist()
            if header[0] == after or header[0] == 0 or not _is_fresh(header):
                return None
            if header[0] % 2 == 0:
                _, poses, steps, objects, policy, frame = (part.copy() for part in _parts(memory, header))
                if int(memory[:8].view(np.int64)[0]) == header[0]:
                    if not _can_be(poses, objects, policy):
                        return None
                    return Look(
                        sequence=header[0],
                        step=header[1],
                        poses=poses,
                        steps=steps,
                        objects=objects,
                        policy=policy,
                        is_discrete=not header[8],
                        frame=frame,
                    )
            time.sleep(0.0005)
        return None

    def snapshot(self) -> bytes:
        """The present moment as the file has it, for `write_live`; nothing when it was taken before or is none."""
        memory = self._open()
        for _ in range(20 if memory is not None else 0):
            assert memory is not None
            data = memory.tobytes()
            sequence, after = (int(part[:8].view(np.int64)[0]) for part in (np.frombuffer(data, np.uint8), memory))
            if sequence == after and sequence % 2 == 0:
                is_new, self._taken = sequence != self._taken, sequence
                return data if is_new and sequence else b""
            time.sleep(0.0005)
        return b""

    def _open(self) -> NDArray[np.uint8] | None:
        """The file's memory; opened again when the training was started again."""
        try:
            status = self._path.stat()
            if status.st_ino == self._inode:
                return self._memory
            self._inode, self._memory = status.st_ino, None
            if not HEADER * 8 < status.st_size <= MAX_BYTES:
                return None
            memory = np.memmap(self._path, np.uint8, "r")
            header = memory[: HEADER * 8].view(np.int64).tolist()
            if min(header[3:8]) >= 0 and max(header[3:8]) <= MAX_BYTES and _length(*header[3:8]) == len(memory):
                self._memory = memory
        except (OSError, ValueError):
            self._inode, self._memory = 0, None
        return self._memory


def write_live(folder: Path, data: bytes) -> None:
    """Show what a `LiveReader` of another machine took, as of now by this machine's clock.

    What does not hold what it says is left out; readers check as always.
    """
    if not HEADER * 8 < len(data) <= MAX_BYTES:
        return
    memory = np.frombuffer(bytearray(data), np.uint8)
    header = memory[: HEADER * 8].view(np.int64)
    if header[2]:  # not one that has ended
        header[2] = time.time_ns()
    fresh = folder / f"{NAME}.new"
    fresh.write_bytes(memory.tobytes())
    os.replace(fresh, folder / NAME)


def _can_be(poses: NDArray[np.float32], objects: NDArray[np.float32], policy: NDArray[np.float32]) -> bool:
    """Whether these are a few cars with numbers, among objects that there are."""
    kinds = objects[:, 0]
    is_known = bool(((kinds >= 0) & (kinds < len(OBJECT_KINDS))).all())
    return (
        len(poses) <= MAX_CARS
        and is_known
        and all((np.abs(part) <= LARGEST).all() for part in (poses, objects, policy))
    )


def _is_fresh(header: list[int]) -> bool:
    return time.time_ns() - header[2] <= STALE * 1e9


def _length(*sizes: int) -> int:
    return sum(_bytes(*sizes))


def _bytes(count: int, height: int, width: int, size: int, objects: int) -> list[int]:
    """Of header, poses, steps, objects, policy and frame."""
    return [HEADER * 8, count * POSE * 4, count * 4, objects * OBJECT * 4, size * 4, height * width]


def _parts(memory: NDArray[np.uint8], header: list[int]) -> tuple[NDArray[Any], ...]:
    """Header, poses, steps, objects, policy and frame as views."""
    count, height, width, _, objects = header[3:8]
    ends = np.cumsum(_bytes(*header[3:8]))
    pieces = [memory[start:end] for start, end in zip([0, *ends[:-1]], ends, strict=True)]
    return (
        pieces[0].view(np.int64),
        pieces[1].view(np.float32).reshape(count, POSE),
        pieces[2].view(np.int32),
        pieces[3].view(np.float32).reshape(objects, OBJECT),
        pieces[4].view(np.float32),
        pieces[5].reshape(height, width),
    )
