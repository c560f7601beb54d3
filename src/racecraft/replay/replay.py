"""`Replay`: a race as a file, to be shown, compared and driven again.

    evaluation or race -> write_replay -> FILE.replay -> read_replay -> poses, actions, rewards, events; films; verify

docs/replay-file.md describes the file. Reading trusts nothing in it.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from racecraft.checks import check_type, check_whole, require
from racecraft.errors import ConfigError, RacecraftError, ReplayError, printable
from racecraft.json_file import read_bytes
from racecraft.race.announcement import Announcement
from racecraft.race.conditions import Conditions
from racecraft.race.placement import driven_track
from racecraft.race.recording import Recording
from racecraft.race.results import Evaluation, Trial
from racecraft.replay.codec import MAX_BODY_BYTES, MAX_FILE_BYTES, TYPES, pack, pack_column, unpack, unpack_column
from racecraft.replay.header import CarHeader, Header, check_header, conditions_of, header_of, lap_of, race_of
from racecraft.replay.in_picture import is_picture, replay_in
from racecraft.run.atomic import write_file
from racecraft.sim.columns import OBJECT_COLUMNS, OBJECT_HEADER, ROW_COLUMNS, STATUS_NAMES, row_width
from racecraft.sim.objects import OBJECT_KINDS
from racecraft.track.track import Track
from racecraft.track.validate import check_rows
from racecraft.version import VERSION

SUFFIX: Final = ".replay"
MAX_CELLS: Final = 40_000_000
"""Numbers in all rows of a replay: 30 hours of driving, a third of a gigabyte in memory."""
MAX_NUMBER: Final = 1e9
"""Of any number in a row, whatever its unit."""
ACTION_COLUMNS: Final = 2
BLOCK: Final = 4096
TOGETHER: Final = 8
"""Rows and columns that are put together at a time: what a processor's cache holds, and one line of it in each row."""

_STEPS, _TIME, _STATUS = (ROW_COLUMNS.index(name) for name in ("steps", "time", "status"))
_FIRST_KIND: Final = len(ROW_COLUMNS) + len(OBJECT_HEADER) + OBJECT_COLUMNS.index("object_kind")
_PREPARE: Final = STATUS_NAMES.index("prepare")


@dataclass(frozen=True, kw_only=True)
class Replay:
    """A race, or an evaluation's trials side by side, step by step."""

    title: str
    """What was raced, for people."""
    conditions: Conditions
    """Track, rules, vehicle, objects and seed."""
    names: tuple[str, ...]
    """Who drove each car; nobody vouches for a name."""
    cars: tuple[Trial, ...]
    """Laps, results and recording of each car."""
    rewards: tuple[NDArray[np.float64], ...]
    """As stored, of each car  (T,)."""
    race: Announcement | None = None
    """The race that it says it is of; None of an evaluation."""
    written_by: str = VERSION
    """Version of Racecraft: another one may have other rules or physics."""

    @classmethod
    def of(cls, evaluation: Evaluation, *, title: str = "", names: tuple[str, ...] = ()) -> Replay:
        """The replay of an evaluation; its trials are named after their numbers unless names are given.

        Raises:
            ConfigError: It is no evaluation, the title is no text, or the names are not one text for each trial.
        """
        check_type("evaluation", evaluation, Evaluation, "use what racecraft.race.evaluate gives")
        check_type("title", title, str, "use a text")
        trials = evaluation.trials
        are_texts = isinstance(names, list | tuple) and all(isinstance(name, str) for name in names)
        require(
            "names", names, are_texts and len(names) in (0, len(trials)), f"a text for each of {len(trials)} trials"
        )
        return cls(
            title=title,
            conditions=evaluation.conditions,
            names=tuple(names) or tuple(f"trial {trial.index + 1}" for trial in trials),
            cars=trials,
            rewards=tuple(trial.recording.rewards for trial in trials),
        )

    @property
    def evaluation(self) -> Evaluation:
        """Its laps and statistics, as when it was driven."""
        return Evaluation(conditions=self.conditions, trials=self.cars)

    @property
    def num_steps(self) -> int:
        """Steps of the longest car."""
        return max(len(car.recording) for car in self.cars)

    def poses(self, car: int) -> NDArray[np.float64]:
        """X [m], y [m] and heading [rad] of a car's origin at every step, 15 a second, a copy  (T, 3).

        Raises:
            ConfigError: There is no such car; they count from 0, and -1 is the last one.
        """
        return self._car(car).recording.poses.copy()

    def actions(self, car: int) -> NDArray[np.float32]:
        """Steering angle [rad] and speed [m/s] that the driver asked for, a copy  (T, 2); cars as for `poses`."""
        return self._car(car).recording.actions.copy()

    def _car(self, car: int) -> Trial:
        check_whole("car", car, -len(self.cars), len(self.cars) - 1)
        return self.cars[car]

    def events(self) -> Iterator[tuple[int, int, str]]:
        """Car, step and kind of everything that happened, car by car."""
        for index, car in enumerate(self.cars):
            for step, kind in car.recording.events:
                yield index, step, kind


def write_replay(replay: Replay, path: str | Path) -> Path:
    """Write a replay file; equal replays give equal bytes.

    Raises:
        ConfigError: It is no replay, or the path is none.
        ReplayError: It is too long, or holds a number that is NaN or infinite.
        OSError: The file cannot be written.
    """
    check_type("path", path, (str, PathLike), "use a file's path")
    write_file(Path(path), pack_replay(replay))
    return Path(path)


def pack_replay(replay: Replay) -> bytes:
    """A replay as the bytes of its file.

    Raises:
        ConfigError: It is no replay.
        ReplayError: It is too long, or holds a number that is NaN or infinite.
    """
    check_type("replay", replay, Replay, "make one with Replay.of(evaluation)")
    track = replay.conditions.track
    if sum(car.recording.rows.size for car in replay.cars) > MAX_CELLS:
        raise ReplayError(f"The race is too long for a replay file: more than {MAX_CELLS:,} numbers.")
    columns: list[bytes] = []
    header: dict[str, Any] = {
        "title": replay.title[:200],
        "racecraft": replay.written_by[:200],
        "track": {
            "name": track.name[:200],
            "waypoints": len(track.centerline),
            "repeats": list(track.repeats),
            "types": _pack(np.hstack([track.centerline, track.inner, track.outer]), columns),
        },
        **header_of(replay.conditions),
        "race": None if replay.race is None else replay.race.to_dict(),
        "cars": [],
    }
    for name, car, rewards in zip(replay.names, replay.cars, replay.rewards, strict=True):
        recording = car.recording
        rows = np.delete(recording.rows, _TIME, axis=1)
        header["cars"].append(
            {
                "name": name[:200],
                "steps": len(recording),
                "status": car.status,
                "completion": car.completion,
                "laps": [vars(lap) for lap in car.laps],
                "types": _pack(np.column_stack([recording.actions, rewards, rows]), columns),
            }
        )
    return pack(header, columns)


def read_replay(path: str | Path, *, max_numbers: int = MAX_CELLS) -> Replay:
    """Read a replay file, or the one inside a picture to send around; it may come from a stranger.

    Args:
        path: The file.
        max_numbers: That all its rows may have, for who has less memory to spare; so much less the file may hold, too.

    Raises:
        ConfigError: `max_numbers` is none.
        ReplayError: It is damaged, hostile, too long, or of another version.
    """
    check_whole("max_numbers", max_numbers, 1)
    share = max_numbers / MAX_CELLS
    try:
        data = read_bytes(path, max_bytes=int(share * MAX_FILE_BYTES))
    except ConfigError as error:
        raise ReplayError(str(error)) from error
    name = Path(path).name
    if is_picture(data):
        data = replay_in(data, name=name)
    document, body = unpack(data, name=name, max_bytes=int(share * MAX_BODY_BYTES))
    del data
    return _replay(check_header(document, name=name), body, name=name, max_numbers=max_numbers)


def _replay(header: Header, body: memoryview, *, name: str, max_numbers: int) -> Replay:
    columns = _Columns(body, name)
    lines = columns.table(header.track.waypoints, header.track.types)
    try:
        track = Track(header.track.name, lines[:, :2], lines[:, 2:4], lines[:, 4:], tuple(header.track.repeats))
        check_rows({"centerline": track.centerline, "inner": track.inner, "outer": track.outer}, name=track.name)
    except RacecraftError as error:
        raise ReplayError(f"The track in {name} is not one: {error}") from error
    if header.track.repeats and max(header.track.repeats) >= len(track.centerline):
        raise ReplayError(f"The track in {name} repeats a waypoint that it does not have.")
    conditions = conditions_of(header, track, name=name)
    width = row_width(conditions.num_objects)
    if len(header.cars) % conditions.cars_per_race:
        raise ReplayError(f"{name} has {len(header.cars)} cars, {conditions.cars_per_race} of which share a road.")
    if sum(car.steps for car in header.cars) * width > max_numbers:
        raise ReplayError(f"{name} holds more than {max_numbers:,} numbers.")
    driven = driven_track(track, conditions.rules)
    cars, rewards = [], []
    for index, car in enumerate(header.cars):
        if len(car.types) != ACTION_COLUMNS + width:  # the reward takes the place of the time
            raise ReplayError(f"Car {index} of {name} has {len(car.types)} columns; its objects ask for {width + 2}.")
        actions = columns.table(car.steps, car.types[:ACTION_COLUMNS])
        rewards.append(columns.table(car.steps, car.types[ACTION_COLUMNS : ACTION_COLUMNS + 1])[:, 0])
        rows = columns.table(car.steps, car.types[ACTION_COLUMNS + 1 :], left_out=_TIME)
        cars.append(_trial(index, car, actions, rows, driven, name=name, number=index % conditions.cars_per_race))
    columns.check_end()
    return Replay(
        title=printable(header.title),
        conditions=conditions,
        names=tuple(printable(car.name) for car in header.cars),
        cars=tuple(cars),
        rewards=tuple(rewards),
        race=race_of(header, name=name),
        written_by=printable(header.racecraft),
    )


def _trial(
    index: int,
    car: CarHeader,
    actions: NDArray[np.float64],
    rows: NDArray[np.float64],
    track: Track,
    *,
    name: str,
    number: int,
) -> Trial:
    rows[:, _TIME] = rows[:, _STEPS] * (1.0 / 15.0)  # as the core counts it
    status = rows[:, _STATUS]
    if car.status not in STATUS_NAMES or not _are_below(len(STATUS_NAMES), status):
        raise ReplayError(f"Car {index} of {name} has a status that does not exist.")
    if not all(_are_below(len(OBJECT_KINDS), kinds) for kinds in rows[:, _FIRST_KIND :: len(OBJECT_COLUMNS)].T):
        raise ReplayError(f"Car {index} of {name} meets an object of a kind that does not exist.")
    if status[0] != _PREPARE:
        raise ReplayError(f"Car {index} of {name} does not begin with its start.")
    rows.flags.writeable = False
    return Trial(
        index=index,
        laps=tuple(lap_of(lap) for lap in car.laps),
        status=car.status,
        completion=car.completion,
        recording=Recording(track, rows, _clock(rows), actions.astype(np.float32), number),
    )


def _are_below(count: int, column: NDArray[np.float64]) -> bool:
    """Whether all are whole, and from 0 to below count."""
    return bool(((column >= 0) & (column < count) & (column == np.rint(column))).all())


def _clock(rows: NDArray[np.float64]) -> NDArray[np.float64]:
    """Seconds since the trial began: a standing start begins where the clock stood  (T,)."""
    time, starts = rows[:, _TIME], np.flatnonzero(rows[:, _STATUS] == _PREPARE)
    began = np.append(0.0, np.cumsum(time[starts[1:] - 1]))
    return np.asarray(np.repeat(began, np.diff(starts, append=len(rows))) + time)


def _pack(table: NDArray[Any], columns: list[bytes]) -> list[str]:
    """Append a table's columns and say their types."""
    packed = [pack_column(column) for column in np.asarray(table, dtype=np.float64).T]
    columns.extend(data for _, data in packed)
    return [kind for kind, _ in packed]


class _Columns:
    """Takes columns from the body, one after the other, and never more than there is."""

    def __init__(self, body: memoryview, name: str) -> None:
        self._rest = body
        self._name = name

    def table(self, length: int, kinds: list[Any], *, left_out: int | None = None) -> NDArray[np.float64]:
        """The next columns side by side, with one of zeros at `left_out`, which the file does not have  (length, K)."""
        size = length * sum(TYPES[kind] for kind in kinds)
        if size > len(self._rest):
            raise ReplayError(f"{self._name} ends before its numbers do: {size - len(self._rest):,} bytes are missing.")
        out = np.zeros((length, len(kinds) + (left_out is not None)))
        places = [place for place in range(out.shape[1]) if place != left_out]
        for first in range(0, len(kinds), TOGETHER):
            columns = [self._column(length, kind) for kind in kinds[first : first + TOGETHER]]
            for row in range(0, length, BLOCK):
                rows = slice(row, row + BLOCK)
                for place, column in zip(places[first : first + TOGETHER], columns, strict=True):
                    out[rows, place] = column[rows]
        return out

    def _column(self, length: int, kind: str) -> NDArray[Any]:
        data, self._rest = self._rest[: length * TYPES[kind]], self._rest[length * TYPES[kind] :]
        column = unpack_column(kind, data)
        largest = max(float(column.max()), -float(column.min()))
        if largest > MAX_NUMBER:
            raise ReplayError(f"{self._name} holds the number {largest:g}; allowed is {MAX_NUMBER:g}.")
        return column

    def check_end(self) -> None:
        if len(self._rest):
            raise ReplayError(f"{self._name} holds {len(self._rest):,} bytes more than its header speaks of.")
