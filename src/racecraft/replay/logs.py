"""Reads sim-traces of any era as a stream of whole episodes: CSV files, or ``SIM_TRACE_LOG`` lines inside larger logs.

    for log in read_logs(paths):  # some ten thousand rows at a time
        ...

Memory does not grow with the file. Rows that cannot be read are counted and named, and end their episode.
"""

from __future__ import annotations

import gzip
import io
import math
import re
import zlib
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import BinaryIO, Final, TextIO

import numpy as np
from numpy.typing import NDArray

from racecraft.errors import RunError
from racecraft.run.simtrace import COLUMNS, READABLE

MARK: Final = "SIM_TRACE_LOG:"
BATCH_ROWS: Final = 20_000
MAX_EPISODE_ROWS: Final = 100_000
"""Rows of an episode kept together; a longer one is continued as another."""
MAX_LINE: Final = 1_000_000  # characters
MAX_NOTES: Final = 20
_NEEDED: Final = COLUMNS[:14]  # up to track_len; tstamp is the fifteenth of all eras
_NUMBERS: Final = ("episode", "steps", "X", "Y", "yaw", "steer", "throttle", "reward", "progress", "tstamp")
_BRACKETS: Final = re.compile(r"\[[^\]]*\]")


@dataclass(frozen=True)
class Log:
    """Some whole episodes of a log, SI units and radians. Arrays   (R,)."""

    source: str
    lines: NDArray[np.int64]  # of the file, from 1
    is_first: NDArray[np.bool_]  # the row begins an episode
    is_prepare: NDArray[np.bool_]
    x: NDArray[np.float64]  # 0.14 m ahead of the car's origin
    y: NDArray[np.float64]
    heading: NDArray[np.float64]
    steering_angle: NDArray[np.float64]
    speed: NDArray[np.float64]
    steps: NDArray[np.float64]
    reward: NDArray[np.float64]
    progress: NDArray[np.float64]  # fraction of a lap
    time: NDArray[np.float64]  # the log's stamp
    all_wheels_on_track: NDArray[np.bool_]
    closest_waypoint: NDArray[np.int64]
    track_length: NDArray[np.float64]
    done: NDArray[np.bool_]
    status: list[str]  # empty where the era has none

    def __len__(self) -> int:
        return len(self.x)

    @property
    def starts(self) -> NDArray[np.int64]:
        """Rows that begin an episode, and the end   (E + 1,)."""
        return np.append(np.flatnonzero(self.is_first), len(self)).astype(np.int64)


@dataclass
class Faults:
    """What could not be read."""

    count: int = 0
    notes: list[str] = field(default_factory=list)

    def add(self, source: str, line: int, text: str) -> None:
        """Count a row, and remember the first few."""
        self.count += 1
        if len(self.notes) < MAX_NOTES:
            self.notes.append(f"{source}, line {line}: {text}")


def read_logs(paths: Iterable[str | Path], faults: Faults) -> Iterator[Log]:
    """Whole episodes of every file, in order.

    Raises:
        RunError: A file is missing, holds no sim-trace, or most of its rows are broken.
    """
    for path in paths:
        yield from _read_file(Path(path), faults)


def _read_file(path: Path, faults: Faults) -> Iterator[Log]:
    rows: list[tuple[int, list[str]]] = []
    good, broken_before = 0, faults.count
    try:
        with path.open("rb") as raw, _decoded(raw) as file:
            for log in _batches(path.name, file, rows, faults):
                good += len(log)
                yield log
    except (OSError, EOFError, zlib.error) as error:
        text = getattr(error, "strerror", None) or error
        raise RunError(f"{path} cannot be read: {text}.") from error
    broken = faults.count - broken_before
    if good == 0 and broken == 0:
        raise RunError(
            f"{path} holds no sim-trace: neither rows of {', '.join(map(str, READABLE))} columns nor {MARK} lines.",
            hint="A training's sim-traces lie in training-simtrace/, an evaluation's in evaluation-*/.",
        )
    if broken > good:
        raise RunError(f"{path} has {broken:,} broken rows and {good:,} good ones. {faults.notes[-1]}.")


def _decoded(raw: BinaryIO) -> TextIO:
    is_gzip = raw.read(2) == b"\x1f\x8b"
    raw.seek(0)
    stream = gzip.GzipFile(fileobj=raw) if is_gzip else raw
    return io.TextIOWrapper(stream, encoding="utf-8-sig", errors="replace")


def _batches(source: str, file: TextIO, rows: list[tuple[int, list[str]]], faults: Faults) -> Iterator[Log]:
    """Fields of every trace row, handed on whenever enough whole episodes are there."""
    names: Sequence[str] | None = None
    episode = ""
    number = 0
    while line := file.readline(MAX_LINE):
        number += 1
        marked = line.find(MARK)
        if marked >= 0:
            fields = _split(line[marked + len(MARK) :])
            now: Sequence[str] | None = COLUMNS[: len(fields)] if len(fields) in READABLE else None
            if now is None:
                faults.add(source, number, f"{len(fields)} columns, a sim-trace has 15, 17, 18 or 19")
                continue
        elif line.startswith("episode,"):
            names = [name.strip() for name in line.split(",")]
            missing = [name for name in (*_NEEDED, "tstamp") if name not in names]
            if missing:
                raise RunError(f"{source} lacks the column {missing[0]!r}; it has {', '.join(names)}.")
            continue
        else:
            fields = _split(line)
            if names is None:
                if number > 1 or len(fields) not in READABLE or not fields[0].strip().isdecimal():
                    continue  # some other line of a larger log
                names = COLUMNS[: len(fields)]
            now = names
            if len(fields) != len(now):
                if line.strip():
                    faults.add(source, number, f"{len(fields)} columns, expected {len(now)}")
                continue
        if fields[0] != episode:
            if len(rows) >= BATCH_ROWS:
                yield from _convert(source, rows, faults)
            episode = fields[0]
        elif len(rows) >= MAX_EPISODE_ROWS:
            yield from _convert(source, rows, faults)
        rows.append((number, _ordered(fields, now)))
    yield from _convert(source, rows, faults)


def _split(line: str) -> list[str]:
    line = line.strip()
    if "[" in line:  # a continuous action: [steering speed], by whatever it is parted
        line = _BRACKETS.sub("0", line).replace('"', "")
    return line.split(",")


_ORDER: Final = (
    *_NUMBERS,
    "all_wheels_on_track",
    "closest_waypoint",
    "track_len",
    "done",
    "episode_status",
)


def _ordered(fields: list[str], names: Sequence[str]) -> list[str]:
    if names[: len(COLUMNS)] == COLUMNS[: len(names)]:
        return [fields[i] if i < len(fields) else "" for i in _INDICES]
    place = {name: i for i, name in enumerate(names)}
    return [fields[place[name]] if name in place else "" for name in _ORDER]


_INDICES: Final = tuple(COLUMNS.index(name) for name in _ORDER)


def _convert(source: str, rows: list[tuple[int, list[str]]], faults: Faults) -> Iterator[Log]:
    """The rows as arrays; empties the list."""
    taken, rows[:] = rows[:], []
    if not taken:
        return
    try:
        table = _numbers(taken)
        if not np.isfinite(table).all():
            raise ValueError
    except ValueError:
        good = []
        for line, fields in taken:
            try:
                if not all(map(math.isfinite, _numbers([(line, fields)])[0])):
                    raise ValueError("not finite")
                good.append((line, fields))
            except ValueError as error:
                faults.add(source, line, str(error))
        taken = good
        if not taken:
            return
        table = _numbers(taken)
    lines = np.array([line for line, _ in taken])
    number, steps, x, y, yaw, steer, throttle, reward, progress, time, closest, length = table.T
    new = np.ones(len(taken), dtype=np.bool_)
    new[1:] = (np.diff(number) != 0) | (np.diff(steps) != 1)
    status = [fields[14].strip() for _, fields in taken]
    is_prepare = np.array([s == "prepare" if s else n == 1 for s, n in zip(status, steps.tolist(), strict=True)])
    yield Log(
        source=source,
        lines=lines,
        is_first=new | is_prepare,
        is_prepare=is_prepare,
        x=x,
        y=y,
        heading=np.radians(yaw),
        steering_angle=np.radians(steer),
        speed=throttle,
        steps=steps,
        reward=reward,
        progress=progress / 100.0,
        time=time,
        all_wheels_on_track=np.array([fields[10].strip() in ("True", "1") for _, fields in taken]),
        closest_waypoint=closest.astype(np.int64),
        track_length=length,
        done=np.array([fields[13].strip() in ("True", "1") for _, fields in taken]),
        status=status,
    )


def _numbers(taken: list[tuple[int, list[str]]]) -> NDArray[np.float64]:
    """Numeric fields   (R, 12); a ValueError names the text that is none."""
    return np.array([[*map(float, fields[:10]), float(fields[11]), float(fields[12])] for _, fields in taken])
