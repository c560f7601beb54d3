"""Reads sim-traces of any era as a stream of whole episodes: CSV files, or ``SIM_TRACE_LOG`` lines inside larger logs.

    for log in read_logs(paths):  # some ten thousand rows at a time
        ...

Memory does not grow with the file. Rows that cannot be read are counted and named, and end their episode; so does a
jump that no car can drive, where somebody moved it by hand.
"""

from __future__ import annotations

import codecs
import gzip
import io
import re
import zlib
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from operator import itemgetter
from pathlib import Path
from typing import BinaryIO, Final, TextIO

import numpy as np
from numpy.typing import NDArray

from racecraft.errors import RunError, typed
from racecraft.json_file import open_regular
from racecraft.run.simtrace import COLUMNS, READABLE
from racecraft.sim.simulation import CONTROL_DT

MARK: Final = "SIM_TRACE_LOG:"
BATCH_ROWS: Final = 20_000
MAX_EPISODE_ROWS: Final = 100_000
"""Rows of an episode kept together; a longer one is continued as another."""
MAX_LINE: Final = 10_000  # characters; a row has 300
MAX_STATUS: Final = 20  # characters
MAX_NUMBER: Final = 1e12
MAX_NOTES: Final = 20
FASTEST: Final = 8.0
"""m/s that no car drives: twice what the fastest is asked for. The original's logs of driving have 3.7 at the most."""
MOVED: Final = 0.01
"""m between two rows: a car that drives, and so looks about where it goes."""
GIVE_APART: Final = "Where several workers wrote into one log by turns, give each one's rows as a file of its own."
_NEEDED: Final = COLUMNS[:14]  # up to track_len; tstamp is the fifteenth of all eras
_NUMBERS: Final = ("episode", "steps", "X", "Y", "yaw", "steer", "throttle", "reward", "progress", "tstamp")
_TRUTHS: Final = {
    word: truth
    for truth, words in ((1.0, ("True", "1", "1.0")), (0.0, ("False", "0", "0.0")))
    for known in words
    for word in {known, known.lower(), known.upper()}
}
"""How logs write a yes or no: spreadsheets save TRUE, JavaScript true, tables of numbers 1.0."""
_BRACKETS: Final = re.compile(r"\[[^\]]*\]")
_AFTER_TRACE: Final = re.compile(r"[\t\"\\].*")
"""What may follow a row where logs were exported: other columns, or the end of a JSON string."""
_SYNONYMS: Final = {
    "x": "X",
    "y": "Y",
    "steering_angle": "steer",
    "speed": "throttle",
    "on_track": "all_wheels_on_track",
}
"""Names of deepracer-utils for AWS's."""


@dataclass(frozen=True)
class Log:
    """Some whole episodes of a log, SI units and radians. Arrays   (R,)."""

    source: str
    lines: NDArray[np.int64]  # of the file, from 1
    is_first: NDArray[np.bool_]  # the row begins an episode
    is_prepare: NDArray[np.bool_]
    is_paused: NDArray[np.bool_]  # the car stands for a penalty
    is_moved: NDArray[np.bool_]  # somebody put the car there, without a word: the row begins an episode, too
    episode: NDArray[np.int64]
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
            self.notes.append(f"{source}, line {line}: {text[:200]}")


def read_logs(paths: Iterable[str | Path], faults: Faults) -> Iterator[Log]:
    """Whole episodes of every file, in order. A file's source is its name; its path where others have the same name.

    Raises:
        RunError: A file is missing, holds no sim-trace, or most of its rows are broken.
    """
    files = list(map(Path, paths))
    named = Counter(path.name for path in dict.fromkeys(files))
    for path in files:
        yield from _read_file(path, path.name if named[path.name] == 1 else str(path), faults)


def _read_file(path: Path, source: str, faults: Faults) -> Iterator[Log]:
    rows: list[tuple[int, Sequence[str]]] = []
    good, broken_before = 0, faults.count
    if path.is_dir():
        raise RunError(f"{path} is a folder; logs are files.", hint=f"Name those in it: {typed(path)}/*.csv")
    try:
        with open_regular(path) as raw, _decoded(raw) as file:
            for log in _batches(source, file, rows, faults):
                good += len(log)
                yield log
    except (OSError, EOFError, zlib.error) as error:
        text = getattr(error, "strerror", None) or error
        raise RunError(f"{path} cannot be read: {text}.") from error
    broken = faults.count - broken_before
    if good == 0 and broken == 0:
        raise RunError(
            f"{path} holds no sim-trace: neither rows of {READABLE[0]} to {READABLE[-1]} columns nor {MARK} lines.",
            hint="A training's sim-traces lie in training-simtrace/, an evaluation's in evaluation-*/.",
        )
    if broken > good:
        raise RunError(f"{path} has {broken:,} broken rows and {good:,} good ones. {faults.notes[-1]}.")


def _decoded(raw: BinaryIO) -> TextIO:
    is_gzip = raw.read(2) == b"\x1f\x8b"
    raw.seek(0)
    stream: BinaryIO = io.BufferedReader(gzip.GzipFile(fileobj=raw)) if is_gzip else raw
    mark = stream.peek(2)[:2] if hasattr(stream, "peek") else b""
    encoding = "utf-16" if mark in (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE) else "utf-8-sig"
    return io.TextIOWrapper(stream, encoding=encoding, errors="replace")


def _batches(source: str, file: TextIO, rows: list[tuple[int, Sequence[str]]], faults: Faults) -> Iterator[Log]:
    """Fields of every trace row, handed on whenever enough whole episodes are there."""
    names: Sequence[str] | None = None  # of a CSV file
    order = _ORDERS[READABLE[-1]]
    episode = ""
    for number, line in _lines(file):
        if line.startswith(MARK):
            fields = _split(_AFTER_TRACE.sub("", line[len(MARK) :].rstrip()))
            if len(fields) not in READABLE:
                faults.add(source, number, f"{len(fields)} columns, a sim-trace has 15 to 19")
                continue
            pick = _ORDERS[len(fields)]
        elif "episode" in line and {"episode", "steps"} <= set(header := _header(line)):
            names = header
            missing = [name for name in (*_NEEDED, "tstamp") if name not in names]
            if missing:
                raise RunError(f"{source} lacks the column {missing[0]!r}; it has {', '.join(names)[:400]}.")
            order = _order(names)
            continue
        else:
            if "episode" in line or number == 1:
                _require_commas(source, line)
            if names is None and number > 1:
                continue  # some other line of a larger log
            fields = _split(line)
            if names is None:
                if len(fields) not in READABLE or not fields[0].strip().isdecimal():
                    continue
                names, order = COLUMNS[: len(fields)], _ORDERS[len(fields)]
            if len(fields) != len(names):
                if line.strip():
                    faults.add(source, number, f"{len(fields)} columns, expected {len(names)}")
                continue
            pick = order
        picked = pick(fields)
        if picked[0] != episode:
            if len(rows) >= BATCH_ROWS:
                yield from _convert(source, rows, faults)
            episode = picked[0]
        elif len(rows) >= MAX_EPISODE_ROWS:
            yield from _convert(source, rows, faults)
        rows.append((number, picked))
    yield from _convert(source, rows, faults)


def _lines(file: TextIO) -> Iterator[tuple[int, str]]:
    """Lines with their numbers: of one that holds marked rows each of these, of one too long for a row its start."""
    number, rest, is_told = 1, "", False  # rest: what may go on in the next piece of the same line
    while piece := file.readline(MAX_LINE):
        is_whole = piece.endswith("\n")
        before, *rows = (rest + piece).split(MARK)
        if not rows and not is_told:
            yield number, before
        goes_on = bool(rows) and not is_whole and len(rows[-1]) < MAX_LINE
        for row in rows[: len(rows) - goes_on]:
            yield number, MARK + row
        rest = "" if is_whole else MARK + rows[-1] if goes_on else piece[1 - len(MARK) :]
        number, is_told = number + is_whole, not is_whole
    if rest.startswith(MARK):
        yield number, rest


def _header(line: str) -> list[str]:
    names = [name.strip(' "') for name in line.strip().split(",")]
    return [_SYNONYMS.get(name, name) for name in names]


def _require_commas(source: str, line: str) -> None:
    """Refuse a header, or a first row, that is whole but for what stands between its columns.

    A spreadsheet that writes no commas there reads none either, and so may have taken a number's point for something
    else: 3.141 for three thousand, or for a day. The numbers of such a file are not to be trusted.
    """
    for separator, name in ((";", "semicolons"), ("\t", "tabs")):
        names = [part.strip(' "') for part in line.strip().split(separator)]
        if {"episode", "steps"} <= set(names) or (len(names) in READABLE and names[0].isdecimal()):
            raise RunError(
                f"{source} has {name} between its columns; a sim-trace has commas there, and points in its numbers.",
                hint="Give the file as it was logged: a spreadsheet that saves it so may have changed numbers, too.",
            )


def _split(line: str) -> list[str]:
    line = line.strip()
    if "[" in line:  # a continuous action: [steering speed], by whatever it is parted
        line = _BRACKETS.sub("0", line)
    if '"' in line:  # quotes that some tools put round every field
        line = line.replace('"', "")
    return line.split(",")


_ORDER: Final = (*_NUMBERS, "all_wheels_on_track", "closest_waypoint", "track_len", "done", "episode_status")


def _order(names: Sequence[str]) -> Callable[[list[str]], tuple[str, ...]]:
    """Picks the fields of _ORDER, the last of which the oldest logs do not have."""
    places = [list(names).index(name) for name in _ORDER if name in names]
    pick = itemgetter(*places)
    return pick if len(places) == len(_ORDER) else lambda fields: (*pick(fields), "")


_ORDERS: Final = {count: _order(COLUMNS[:count]) for count in READABLE}


def _convert(source: str, rows: list[tuple[int, Sequence[str]]], faults: Faults) -> Iterator[Log]:
    """The rows as arrays; empties the list."""
    taken, rows[:] = rows[:], []
    if not taken:
        return
    try:
        table = _numbers(taken)
        if not (np.abs(table) < MAX_NUMBER).all():
            raise ValueError
    except ValueError:
        good = []
        for line, fields in taken:
            try:
                if not (np.abs(_numbers([(line, fields)])) < MAX_NUMBER).all():
                    raise ValueError("a number is not finite, or absurd")
                good.append((line, fields))
            except ValueError as error:
                faults.add(source, line, str(error))
        taken = good
        if not taken:
            return
        table = _numbers(taken)
    lines = np.array([line for line, _ in taken])
    number, steps, x, y, yaw, steer, throttle, reward, progress, time, closest, length, wheels, done = table.T
    new = np.ones(len(taken), dtype=np.bool_)
    new[1:] = (np.diff(number) != 0) | (np.diff(steps) != 1)
    status = [fields[14].strip()[:MAX_STATUS] for _, fields in taken]
    is_prepare = np.array([s == "prepare" if s else n == 1 for s, n in zip(status, steps.tolist(), strict=True)])
    is_paused = np.array([s in ("pause", "park") for s in status], dtype=np.bool_)
    is_moved = _jumps(x, y, time) & ~new
    for told in (is_prepare, is_paused):
        is_moved[told] = is_moved[1:][told[:-1]] = False
    if not any(status) and _is_in_radians(x, y, yaw, new):
        yaw, steer = np.degrees(yaw), np.degrees(steer)
    yield Log(
        source=source,
        lines=lines,
        is_first=new | is_prepare | is_moved,
        is_prepare=is_prepare,
        is_paused=is_paused,
        is_moved=is_moved,
        episode=number.astype(np.int64),
        x=x,
        y=y,
        heading=np.radians(yaw),
        steering_angle=np.radians(steer),
        speed=throttle,
        steps=steps,
        reward=reward,
        progress=progress / 100.0,
        time=time,
        all_wheels_on_track=wheels > 0.0,
        closest_waypoint=closest.astype(np.int64),
        track_length=length,
        done=done > 0.0,
        status=status,
    )


def _is_in_radians(
    x: NDArray[np.float64], y: NDArray[np.float64], yaw: NDArray[np.float64], new: NDArray[np.bool_]
) -> bool:
    """Whether the way that was driven says so of the angles, as in logs of 2019; later ones have degrees."""
    dx, dy = np.diff(x), np.diff(y)
    moved = (np.hypot(dx, dy) > MOVED) & ~new[1:]
    way, logged = np.arctan2(dy, dx)[moved], yaw[:-1][moved]
    in_radians, in_degrees = (np.abs(np.exp(1j * angle) - np.exp(1j * way)) for angle in (logged, np.radians(logged)))
    return len(way) > 0 and bool(np.median(in_radians) < np.median(in_degrees))


def _jumps(x: NDArray[np.float64], y: NDArray[np.float64], time: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Rows that no car can have driven to from the one before, whichever stamps its step lasted between   (R,)."""
    lasted = np.diff(time, prepend=time[:1])
    longest = np.maximum.reduce([lasted, np.roll(lasted, 1), np.roll(lasted, -1), np.full(len(x), CONTROL_DT)])
    moved = np.hypot(np.diff(x, prepend=x[:1]), np.diff(y, prepend=y[:1]))
    return np.asarray(moved > FASTEST * longest)


def _numbers(taken: list[tuple[int, Sequence[str]]]) -> NDArray[np.float64]:
    """Numeric fields and the two truths   (R, 14); a ValueError names the text that is none."""
    return np.array(
        [
            [
                *map(float, fields[:10]),
                float(fields[11]),
                float(fields[12]),
                _truth(fields[10], "all_wheels_on_track"),
                _truth(fields[13], "done"),
            ]
            for _, fields in taken
        ]
    )


def _truth(text: str, name: str) -> float:
    """1.0 or 0.0; a ValueError names the text that is neither yes nor no."""
    truth = _TRUTHS.get(text.strip())
    if truth is None:
        raise ValueError(f"{name} is {text.strip()[:40]!r}, neither True nor False")
    return truth
