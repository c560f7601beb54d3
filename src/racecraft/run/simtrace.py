"""The sim-trace: every step of every episode, in the CSV files that DeepRacer's log tools read.

Cars drive side by side, but the files hold one whole episode after the other, as AWS's single car wrote them,
so a car's steps wait in memory until its episode ends. Numbers have full precision, angles are in degrees.
"""

from __future__ import annotations

import csv
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, TextIO

import numpy as np
from numpy.typing import ArrayLike, NDArray

from racecraft.agent import ActionSpace, DiscreteActionSpace
from racecraft.checks import check_path
from racecraft.errors import CheckpointError, RunError
from racecraft.run.episodes import Episode
from racecraft.sim import CONTROL_DT
from racecraft.sim.columns import ROW_COLUMNS, STATUS_NAMES
from racecraft.sim.number_text import number_texts

if TYPE_CHECKING:
    from racecraft.run.aws_log import AwsLog
    from racecraft.track.track import Track

COLUMNS = (
    "episode",
    "steps",
    "X",
    "Y",
    "yaw",
    "steer",
    "throttle",
    "action",
    "reward",
    "done",
    "all_wheels_on_track",
    "progress",
    "closest_waypoint",
    "track_len",
    "tstamp",
    "episode_status",
    "pause_duration",
    "obstacle_crash_counter",
    "wall_clock",
)
WRITTEN = COLUMNS[:18]  # what simulator versions from 5.3 to 5 write; version 6 adds wall_clock
READABLE = (15, 16, 17, 18, 19)  # columns of the five eras
MAX_EPISODE_ROWS = 20_000  # 22 simulated minutes; the middle of a longer episode is left out
MAX_BYTES = 1 << 31  # of all files of a run; beyond it every other iteration is removed
MAX_FILES = 4096  # the same for their number
EPISODES_PER_ITERATION = 20  # of AWS, unless hyperparameters say otherwise
MAX_READ_ROWS = 2_000_000
MAX_LINE = 1 << 14  # characters; a step has up to 300
MAX_STATUS = 40  # characters of a row's episode_status; ours and AWS's have up to 11

_KEPT = (
    "steps",
    "x",
    "y",
    "heading",
    "steering_angle",
    "speed",
    "progress",
    "closest_prev",
    "closest_next",
    "all_wheels_on_track",
    "status",
    "time",
    "track_index",
    "track_length",
)
_KEPT_INDICES = np.array([ROW_COLUMNS.index(name) for name in _KEPT])
STEP_WIDTH = len(_KEPT) + 2  # and the index of the action, and the reward
_COMPACT_EVERY = 512  # steps after which running episodes are packed


class SimTraceWriter:
    """Writes ``<iteration>-iteration.csv`` files into a folder, so many episodes to each, as AWS's tools count them.

    Args:
        folder: Made when the first episode is written.
        num_envs: N, the number of cars.
        tracks: The simulation's tracks, in its order; they tell which waypoint is the closest.
        action_space: What the actions mean.
        episodes_per_iteration: Episodes to a file; 0 for all in one.
        episodes: Continue after so many episodes: whatever files hold of later ones is removed.
        log: Is told every row, too.
        max_bytes: Of all files together. When they grow past it, every other iteration is removed and not
            written any more, so that what remains still covers the whole run.
    """

    def __init__(
        self,
        folder: Path,
        *,
        num_envs: int,
        tracks: Sequence[Track],
        action_space: ActionSpace,
        episodes_per_iteration: int = EPISODES_PER_ITERATION,
        episodes: int = 0,
        log: AwsLog | None = None,
        max_bytes: int = MAX_BYTES,
    ) -> None:
        self.folder = folder
        self.episodes_per_iteration = episodes_per_iteration
        self.iteration = self._iteration_of(episodes)
        self.max_bytes = max_bytes
        self._action_space = action_space
        self._waypoints = [track.waypoints for track in (*tracks, *(track.reversed() for track in tracks))]
        self._log = log
        self._stride = 1
        self._file: TextIO | None = None
        self._steps: list[NDArray[np.float64]] = []  # (N, STEP_WIDTH) each
        self._first = [0] * num_envs  # index into _steps where a car's episode begins
        self._packed: list[list[NDArray[np.float64]]] = [[] for _ in range(num_envs)]  # its steps before _steps
        self._sizes = self._cut(episodes)  # bytes of the files there are, by iteration

    def write(
        self,
        rows: NDArray[np.float64],
        *,
        actions: ArrayLike,
        rewards: ArrayLike,
        ended: Iterable[Episode] = (),
    ) -> None:
        """Note one step of every car, and write the episodes it ended.

        Args:
            rows: The judged rows of the step   (N, len(ROW_COLUMNS)).
            actions: What the policy gave   (N,) indices or (N, 2) in [-1, 1].
            rewards: Rewards of the step   (N,).
            ended: The episodes that end with it, as `EpisodeCounter.update` returns them.
        """
        step = np.zeros((len(rows), STEP_WIDTH))
        step[:, : len(_KEPT)] = rows[:, _KEPT_INDICES]
        step[:, -1] = rewards
        if isinstance(self._action_space, DiscreteActionSpace):
            step[:, -2] = actions
        self._steps.append(step)
        for episode in ended:
            table = self._take(episode.env)
            iteration = self._iteration_of(episode.number)
            if iteration != self.iteration:
                self.close()
                self.iteration = iteration
            lines = self._lines(table, episode)
            if iteration % self._stride == 0:
                self._write("".join(f"{','.join(line)}\n" for line in lines))
            if self._log is not None:
                self._log.write_episode(lines, episode, iteration=iteration)
        if len(self._steps) >= _COMPACT_EVERY:
            self._compact()

    def abandon(self, mask: NDArray[np.bool_]) -> None:
        """Drop what the cars of the mask (N,) have driven since their last whole episode."""
        for env in np.flatnonzero(mask).tolist():
            self._first[env] = len(self._steps)
            self._packed[env] = []

    def state(self) -> dict[str, NDArray[np.float64]]:
        """The steps of the episodes under way, so that a resumed run logs them whole: plain arrays by name."""
        self._compact()
        tables = [table for packed in self._packed for table in packed]
        lengths = [sum(map(len, packed)) for packed in self._packed]
        return {
            "trace/steps": np.concatenate([np.zeros((0, STEP_WIDTH)), *tables]),
            "trace/lengths": np.array(lengths, np.float64),
        }

    def load_state(self, state: Mapping[str, NDArray[Any]]) -> None:
        """Continue from what ``state`` gave.

        Raises:
            CheckpointError: It is of another number of cars, or damaged.
        """
        steps, lengths = state["trace/steps"], state["trace/lengths"].astype(np.int64)
        fits = len(lengths) == len(self._first) and steps.shape == (lengths.sum(), STEP_WIDTH) and (lengths >= 0).all()
        if not fits:
            raise CheckpointError(
                f"The state of the sim-trace is of {len(lengths)} cars and {steps.shape} steps, "
                f"expected {len(self._first)} cars and {STEP_WIDTH} numbers a step."
            )
        self._steps.clear()
        self._first = [0] * len(lengths)
        self._packed = [[table] if len(table) else [] for table in np.split(steps, np.cumsum(lengths)[:-1])]

    def flush(self) -> None:
        """Hand every episode that has ended to the system."""
        try:
            if self._file is not None:
                self._file.flush()
        except OSError as error:
            raise RunError(f"{self.folder} cannot be written: {error.strerror or error}.") from error

    def close(self) -> None:
        """Finish the current file. Episodes that have not ended are not written."""
        if self._file is None:
            return
        try:
            self._file.close()
            self._sizes[self.iteration] = self._path(self.iteration).stat().st_size
            self._thin()
        except OSError as error:
            raise RunError(f"{self.folder} cannot be written: {error.strerror or error}.") from error
        finally:
            self._file = None

    def _take(self, env: int) -> NDArray[np.float64]:
        """The steps of a car's episode   (T, STEP_WIDTH); the next one begins after them."""
        recent = [step[env] for step in self._steps[self._first[env] :]]
        table = np.concatenate([*self._packed[env], recent]) if recent else np.concatenate(self._packed[env])
        self._first[env] = len(self._steps)
        self._packed[env] = []
        return table

    def _compact(self) -> None:
        """Let go of steps of ended episodes: keep only each running one's own, of bounded length."""
        for env, first in enumerate(self._first):
            recent = [step[env] for step in self._steps[first:]]
            if recent and sum(map(len, self._packed[env])) < MAX_EPISODE_ROWS:
                self._packed[env].append(np.array(recent))
            self._first[env] = 0
        self._steps.clear()

    def _iteration_of(self, episode: int) -> int:
        return episode // self.episodes_per_iteration if self.episodes_per_iteration else 0

    def _path(self, iteration: int) -> Path:
        return self.folder / f"{iteration}-iteration.csv"

    def _cut(self, episodes: int) -> dict[int, int]:
        """Remove what a killed run has logged after its last checkpoint; sizes of what remains, by iteration."""
        sizes: dict[int, int] = {}
        try:
            for path in self.folder.glob("*-iteration.csv"):
                iteration = path.name.removesuffix("-iteration.csv")
                if not iteration.isdecimal():
                    continue
                if int(iteration) > self.iteration:
                    path.unlink()
                    continue
                if int(iteration) == self.iteration:
                    _cut_file(path, episodes)
                if size := path.stat().st_size:
                    sizes[int(iteration)] = size
        except OSError as error:
            raise RunError(f"{self.folder} cannot be written: {error.strerror or error}.") from error
        return sizes

    def _lines(self, table: NDArray[np.float64], episode: Episode) -> list[tuple[str, ...]]:
        """An episode's rows, their fields as text, with AWS's ``prepare`` row before the first."""
        column = dict(zip(_KEPT, table.T, strict=False))
        if isinstance(self._action_space, DiscreteActionSpace):
            indices = table[:, -2].astype(int)
            names = [str(index) for index in indices]
            steer, throttle = map(number_texts, np.array(self._action_space.to_degrees())[indices].T)
        else:
            steer, throttle = number_texts(np.degrees(column["steering_angle"])), number_texts(column["speed"])
            names = [f"[{angle} {speed}]" for angle, speed in zip(steer, throttle, strict=True)]
        heading = column["heading"]
        texts = (
            number_texts(column["steps"]),
            number_texts(column["x"]),
            number_texts(column["y"]),
            number_texts(np.degrees(np.arctan2(np.sin(heading), np.cos(heading)))),
            steer,
            throttle,
            names,
            number_texts(table[:, -1]),
            ["False"] * (len(table) - 1) + ["True"],
            map(repr, (column["all_wheels_on_track"] > 0).tolist()),
            ["100" if text == "100.0" else text for text in number_texts(100 * np.minimum(column["progress"], 1))],
            map(repr, self._closest(column).tolist()),
            number_texts(column["track_length"]),
            number_texts(np.round(episode.start_time + column["time"], 3)),
            [STATUS_NAMES[code] for code in column["status"].astype(int)],
        )
        rows = list(zip(*texts, strict=True))
        _, *pose_and_action, _, _, wheels, progress, closest, length, _, _ = rows[0]
        before = repr(round(episode.start_time + float(column["time"][0]) - CONTROL_DT, 3))
        prepare = (
            "1.0",
            *pose_and_action,
            "0.0",
            "False",
            wheels,
            progress,
            closest,
            length,
            before,
            "prepare",
        )
        if column["steps"][0] == 2.0:  # a flying lap has nothing to prepare
            rows.insert(0, prepare)
        number, pauses = str(episode.number), _pauses([row[-1] for row in rows])
        return [(number, *row, repr(pause), "0") for row, pause in zip(rows, pauses, strict=True)]

    def _closest(self, column: dict[str, NDArray[np.float64]]) -> NDArray[np.int64]:
        """Index of the closest waypoint: the nearer of the one behind and the one ahead   (T,)."""
        waypoints = self._waypoints[int(column["track_index"][0])]
        behind, ahead = column["closest_prev"].astype(np.int64), column["closest_next"].astype(np.int64)
        car = np.column_stack([column["x"], column["y"]])
        is_ahead = np.linalg.norm(waypoints[ahead] - car, axis=1) < np.linalg.norm(waypoints[behind] - car, axis=1)
        return np.where(is_ahead, ahead, behind)

    def _write(self, text: str) -> None:
        try:
            if self._file is None:
                self.folder.mkdir(parents=True, exist_ok=True)
                path, is_begun = self._path(self.iteration), self.iteration in self._sizes
                self._file = path.open("a" if is_begun else "w", encoding="utf-8", newline="", buffering=1 << 16)
                if not is_begun:
                    self._file.write(",".join(WRITTEN) + "\n")
            self._file.write(text)
        except OSError as error:
            raise RunError(f"{self.folder} cannot be written: {error.strerror or error}.") from error

    def _thin(self) -> None:
        """Remove every other iteration while the files are larger or more than allowed."""
        while (sum(self._sizes.values()) > self.max_bytes or len(self._sizes) > MAX_FILES) and len(self._sizes) > 1:
            self._stride *= 2
            for iteration in [iteration for iteration in self._sizes if iteration % self._stride]:
                self._path(iteration).unlink(missing_ok=True)
                del self._sizes[iteration]
            if self._stride > max(1, self.iteration):
                return


def _pauses(statuses: Sequence[str]) -> list[float]:
    """Seconds that the car still stands after each row: AWS's ``pause_duration``.

    It counts down the penalty after a mistake; where mistakes end the episode, as in training, it is 0.
    """
    left, pauses = 0, []
    for status in reversed(statuses):
        pauses.append(round(left * CONTROL_DT, 3))
        left = left + 1 if status == "pause" else 0
    return pauses[::-1]


def _cut_file(path: Path, episodes: int) -> None:
    """Keep the header and the rows of the first so many episodes of a run."""
    with path.open("rb+") as file:
        if not file.readline().endswith(b"\n"):
            file.truncate(0)  # killed before even the header was out
        while line := file.readline():
            number = line.split(b",", 1)[0]
            if not line.endswith(b"\n") or not number.isdigit() or int(number) >= episodes:
                file.truncate(file.tell() - len(line))
                return


def read_simtrace(path: str | Path, *, max_rows: int = MAX_READ_ROWS) -> dict[str, NDArray[Any]]:
    """The columns of a sim-trace file of any era, by name.

    Args:
        path: A CSV file with 15 to 19 columns; the header may be missing.
        max_rows: Longer files are refused.

    Returns:
        Arrays   (R,): whole numbers int64, ``done`` and ``all_wheels_on_track`` bool, ``episode_status`` str,
        ``action`` int64, or float64 (R, 2) of steering and speed; everything else float64.

    Raises:
        RunError: Not readable, not a sim-trace, or too long; names the line.
    """
    check_path("path", path, "use a file's path")
    path = Path(path)
    rows: list[list[str]] = []
    names: list[str] | None = None
    try:
        with path.open(encoding="utf-8-sig", newline="") as file:
            for row in csv.reader(short_lines(file)):
                if names is None:
                    names = row if row[:1] == ["episode"] else list(COLUMNS[: len(row)])
                    if len([name for name in names if name in COLUMNS]) not in READABLE:
                        raise RunError(f"{path} has {len(row)} columns, a sim-trace has 15 to 19.")
                    if names is row:
                        continue
                if len(row) != len(names):
                    line = len(rows) + 2
                    raise RunError(f"{path} has {len(row)} columns in line {line}, expected {len(names)}.")
                if len(rows) >= max_rows:
                    raise RunError(f"{path} has more than {max_rows:,} rows.")
                rows.append(row)
    except OSError as error:
        raise RunError(f"{path} cannot be read: {error.strerror or error}.") from error
    except (UnicodeDecodeError, csv.Error) as error:
        raise RunError(f"{path} is not a sim-trace: {error}.") from error
    if names is None:
        raise RunError(f"{path} is empty.")
    columns = dict(zip(names, zip(*rows, strict=True) if rows else [()] * len(names), strict=True))
    try:
        return {name: _parse(name, columns[name]) for name in names if name in COLUMNS}
    except (ValueError, OverflowError) as error:
        raise RunError(f"{path} is not a sim-trace: {error}.") from error


def short_lines(file: TextIO) -> Iterator[str]:
    """The lines of a stranger's file of steps; one of millions of fields would fill the memory.

    Raises:
        csv.Error: One is too long.
    """
    while line := file.readline(MAX_LINE + 1):
        if len(line) > MAX_LINE:
            raise csv.Error(f"a line has more than {MAX_LINE:,} characters")
        yield line


def _parse(name: str, texts: tuple[str, ...]) -> NDArray[Any]:
    """A column's values; a ValueError says what is wrong."""
    if name == "episode_status":
        if (longest := max(map(len, texts), default=0)) > MAX_STATUS:  # every row of the array would be as long
            raise ValueError(f"{name} has {longest:,} characters; allowed are {MAX_STATUS}")
        return np.array(texts, dtype=np.str_)
    if name in ("done", "all_wheels_on_track"):
        if wrong := set(texts) - {"True", "False", "0", "1"}:
            raise ValueError(f"{name} is {min(wrong)[:40]!r}; allowed is True or False")
        return np.array([text in ("True", "1") for text in texts], dtype=np.bool_)
    if name == "action" and any(text.startswith("[") for text in texts):
        return np.array([text.strip("[]").replace(",", " ").split() for text in texts], dtype=np.float64).reshape(-1, 2)
    values = np.array(texts, dtype=np.float64)
    if not np.isfinite(values).all():
        raise ValueError(f"{name} is not a finite number in every row")
    if name in ("episode", "steps", "action", "closest_waypoint", "obstacle_crash_counter"):
        whole = values.astype(np.int64)
        if not np.array_equal(whole, values):
            raise ValueError(f"{name} is not a whole number in every row")
        return whole
    return values
