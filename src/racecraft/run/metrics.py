"""AWS's metrics files: ``TrainingMetrics.json`` of all episodes, ``EvaluationMetrics-*.json`` of trials."""

from __future__ import annotations

import json
import time
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Literal, get_args

from racecraft.checks import is_number
from racecraft.errors import RunError
from racecraft.json_file import read_json_object
from racecraft.run.atomic import write_file
from racecraft.run.episodes import Episode

VERSION = 2.0
MAX_BYTES = 1 << 28
STATUS_LABELS = {
    "prepare": "Prepare",
    "in_progress": "In progress",
    "lap_complete": "Lap complete",
    "crashed": "Crashed",
    "off_track": "Off track",
    "immobilized": "Immobilized",
    "reversed": "Reversed",
    "time_up": "Time Up",
    "pause": "Pause",
    "park": "Park",
}
MAX_EPISODES = 100_000  # 20 MB; beyond it every other training episode is left out
WRITE_SHARE = 0.01  # at most this share of the time goes into writing the file again

Phase = Literal["training", "evaluation"]


class TrainingMetrics:
    """The results of all episodes of a run, on disk within seconds.

    Args:
        path: The file; an old one is continued up to ``episodes``.
        best_model_metric: What makes a checkpoint the best: progress, reward or laptime.
        episodes_per_iteration: After how many episodes AWS's trial counter begins again.
        episodes: Keep this many training episodes of an old file, and the evaluations among them, as a
            resumed run does from its checkpoint on. 0 starts anew.
        clock: Simulated s; nothing of an old file is kept that ended later. An evaluation before the first training
            episode can only be told by it.
        interval_s: Seconds between two writings, at least.
    """

    def __init__(
        self,
        path: Path,
        *,
        best_model_metric: str = "progress",
        episodes_per_iteration: int = 20,
        episodes: int = 0,
        clock: float | None = None,
        interval_s: float = 1.0,
    ) -> None:
        self.path = path
        self.best_model_metric = best_model_metric
        self.episodes_per_iteration = episodes_per_iteration
        self.interval_s = interval_s
        kept = read_metrics(path)["metrics"] if (episodes or clock) and path.exists() else []
        end = float("inf") if clock is None else 1000 * clock
        self._lines = [
            (line["episode"], line["phase"], json.dumps(line))
            for line in kept
            if _is_ours(line) and line["episode"] <= episodes and line["metric_time"] <= end
        ]
        self._stride = 1
        self._episodes = episodes
        self._dirty = True
        self._next_write = 0.0

    def add(self, episode: Episode, *, phase: Phase = "training") -> None:
        """Note an episode; an evaluation has the number of the training episode before it, as at AWS."""
        if phase == "training":
            self._episodes = episode.number + 1
        line = {
            "reward_score": round(episode.reward),
            "metric_time": round(1000 * episode.end_time),
            "start_time": round(1000 * episode.start_time),
            "elapsed_time_in_milliseconds": round(1000 * episode.end_time) - round(1000 * episode.start_time),
            "episode": self._episodes,
            "trial": (self._episodes - 1) % self.episodes_per_iteration + 1,
            "phase": phase,
            "completion_percentage": _percent(episode.progress),
            "episode_status": STATUS_LABELS[episode.status],
        }
        if phase == "evaluation" or episode.number % self._stride == 0:
            self._lines.append((line["episode"], phase, json.dumps(line)))
            self._dirty = True
        if len(self._lines) > MAX_EPISODES:
            self._thin()
        if time.monotonic() >= self._next_write:
            self.write()

    def write(self) -> None:
        """Bring the file up to date.

        Raises:
            RunError: It cannot be written.
        """
        if not self._dirty:
            return
        begin = time.monotonic()
        end = f'"version": {VERSION}, "best_model_metric": {json.dumps(self.best_model_metric)}'
        lines = ", ".join(text for _, _, text in self._lines)
        _write(self.path, f'{{"metrics": [{lines}], {end}}}')
        now = time.monotonic()
        self._next_write = now + max(self.interval_s, (now - begin) / WRITE_SHARE)
        self._dirty = False

    def _thin(self) -> None:
        """Halve the training episodes, evenly over the run, so that the file stays one that tools can read."""
        count = len(self._lines)
        while len(self._lines) > 0.75 * count and self._stride < self._episodes:
            self._stride *= 2
            self._lines = [line for line in self._lines if line[1] == "evaluation" or (line[0] - 1) % self._stride == 0]


@dataclass(frozen=True)
class Trial:
    """One lap, or attempt at one, of an evaluation; the fields of AWS's file."""

    completion_percentage: int
    """Of the lap, 0 to 100."""
    metric_time: int
    """Simulated ms at the end."""
    start_time: int
    """Simulated ms at the start."""
    elapsed_time_in_milliseconds: int
    """With penalties."""
    episode_status: str
    """One of STATUS_LABELS."""
    crash_count: int
    immobilized_count: int
    off_track_count: int
    reversed_count: int
    reset_count: int
    trial: int
    """From 1."""


def write_evaluation_metrics(path: Path, trials: Iterable[Trial]) -> None:
    """Write the results of an evaluation in AWS's format.

    Raises:
        RunError: The file cannot be written.
    """
    _write(path, json.dumps({"metrics": [asdict(trial) for trial in trials]}))


def read_metrics(path: Path) -> dict[str, Any]:
    """A metrics file of either kind.

    Raises:
        RunError: It is not one.
    """
    try:
        document = read_json_object(path, max_bytes=MAX_BYTES)
    except ValueError as error:
        raise RunError(str(error)) from error
    lines = document.get("metrics")
    if not isinstance(lines, list) or not all(isinstance(line, dict) and "trial" in line for line in lines):
        raise RunError(f"{path} is not a metrics file: it has no list of trials under 'metrics'.")
    return document


def _is_ours(line: dict[str, Any]) -> bool:
    """Whether a line is one that a training writes, and not of an evaluation's file or a stranger's archive."""
    numbers = (line.get("episode"), line.get("metric_time"))
    return all(map(is_number, numbers)) and line.get("phase") in get_args(Phase)


def _percent(progress: float) -> int:
    """Whole percent of the lap, rounded down as at AWS; 1e-9 forgives the last bit of a full lap."""
    return max(0, min(100, int(100 * progress + 1e-9)))


def _write(path: Path, text: str) -> None:
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        write_file(path, text.encode(), durable=False)
    except OSError as error:
        raise RunError(f"{path} cannot be written: {error.strerror or error}.") from error
