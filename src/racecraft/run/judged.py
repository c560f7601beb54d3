"""A run's evaluations, during training and afterwards, and with them its best lap.

The best lap of a run is the fastest whole lap, penalties included, that it drove in any evaluation on the track it
learns on, or on one of several: those during training, and those by the rules of a race afterwards, unless they were
driven in another car or under a randomisation.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any, Final

from racecraft.checks import is_number
from racecraft.errors import ConfigError, RacecraftError, RunError
from racecraft.json_file import parse_json_line, read_json_object
from racecraft.run.folder import RunFolder, RunInfo
from racecraft.run.history import MAX_LINE

_EVALUATION: Final = b'{"kind": "evaluation"'


@dataclass(frozen=True, kw_only=True)
class Judged:
    """One evaluation."""

    step: int
    """Camera steps of training behind the policy that drove."""
    completion: float | None
    """Mean fraction of the laps begun."""
    best_lap: float | None
    """s, the fastest whole lap with its penalties; None where there was none."""
    stamp: str | None = None
    """Of an evaluation afterwards, when it began; None during training."""


def judged_laps(folder: RunFolder) -> list[Judged]:
    """The evaluations of a run on its own track: those during training in their order, then those afterwards.

    Evaluations that cannot be read are left out.

    Raises:
        RunError: The run itself cannot be read.
    """
    info = folder.read_info()
    known = [*_during_training(folder.history)]
    seen = {judged.step for judged in known}
    for entry in folder.checkpoints.entries():  # all that an imported run may have
        lap = _number(entry.metrics.get("best_lap_s"))
        if entry.step not in seen and (lap is not None or entry.metrics.get("completion") is not None):
            known.append(Judged(step=entry.step, completion=_number(entry.metrics.get("completion")), best_lap=lap))
    return [*known, *_afterwards(folder, info)]


def best_of(judged: Sequence[Judged]) -> Judged | None:
    """The one with the fastest lap, the earliest of equal ones; None where no lap was completed."""
    driven = [one for one in judged if one.best_lap is not None]
    return min(driven, key=lambda one: one.best_lap or math.inf, default=None)


def _during_training(history: Path) -> Iterator[Judged]:
    with suppress(OSError), history.open("rb") as file:
        while line := file.readline(MAX_LINE):
            if not line.startswith(_EVALUATION):
                continue
            with suppress(ValueError, KeyError, TypeError):
                point = parse_json_line(line) or {}
                shares = [share for share in map(_number, point["completions"]) if share is not None]
                laps = [lap for lap in map(_number, point["lap_times"]) if lap is not None]
                mean = _number(sum(shares) / len(shares)) if shares else None
                yield Judged(step=int(point["step"]), completion=mean, best_lap=min(laps, default=None))


def _afterwards(folder: RunFolder, info: RunInfo) -> Iterator[Judged]:
    for path in sorted(folder.path.glob("evaluation-*/evaluation.json")):
        with suppress(ConfigError, RunError, AttributeError, TypeError, ValueError):
            summary = read_json_object(path)
            if _is_own_track(summary, info) and _is_as_learned(summary, info):
                yield Judged(
                    step=int(summary.get("step") or 0),
                    completion=_number(summary.get("mean_completion")),
                    best_lap=_number(summary.get("best_lap_seconds")),
                    stamp=path.parent.name.removeprefix("evaluation-"),
                )


def _is_own_track(summary: dict[str, Any], info: RunInfo) -> bool:
    """Whether an evaluation was driven on the road the run learns on; an older one tells its name alone."""
    told = summary.get("track_digest")
    if told is not None:
        with suppress(RacecraftError):  # tracks that are gone, or others by their names
            return told == info.track_digest or told in _roads(info.track, info.track_digest)
        return False
    return Path(str(summary.get("track", ""))).stem in {Path(part).stem for part in info.track.split(" + ")}


def _is_as_learned(summary: dict[str, Any], info: RunInfo) -> bool:
    """Whether a lap of an evaluation compares with those in training; older ones do not tell, and count."""
    conditions, driven = summary.get("conditions") or {}, summary.get("driven") or {}
    learned, car = info.settings.get("vehicle") or {}, conditions.get("vehicle") or {}
    return not driven.get("randomize") and all(car.get(name, value) == value for name, value in learned.items())


@lru_cache(maxsize=64)
def _roads(names: str, digest: str) -> frozenset[str]:
    """Digests of the tracks that a run learns on, of which it keeps the joint one.

    Raises:
        RacecraftError: There are none of these names now, or others.
    """
    from racecraft.track import joint_digest, load_tracks  # which few runs ask for

    tracks = load_tracks(names)
    if joint_digest(tracks) != digest:
        raise RunError(f"Track {names!r} has changed since.")
    return frozenset(track.digest for track in tracks)


def _number(value: Any) -> float | None:
    return float(value) if is_number(value) and value >= 0 else None
