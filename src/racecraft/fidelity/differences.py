"""Rows that come out otherwise here than in the log: each with both values, and what is known of why."""

from __future__ import annotations

import csv
from collections import Counter
from collections.abc import Iterable
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, Final, Self, TextIO

import numpy as np
from numpy.typing import NDArray

from racecraft.errors import RunError

if TYPE_CHECKING:
    from racecraft.fidelity.logs import Log
    from racecraft.track.track import Track

MAX_KEPT: Final = 20
"""Of each kind; the file has them all."""
_AHEAD: Final = 0.14  # m, of the logged point, from the car's origin
_WHEELS: Final = ((-0.08166, 0.08105), (-0.08166, -0.08105), (0.08231, 0.0796), (0.08231, -0.0796))  # m


@dataclass(frozen=True)
class Difference:
    """One row and one thing about it."""

    file: str
    line: int
    episode: int
    step: int
    what: str
    """``progress``, ``all_wheels_on_track``, ``closest_waypoint``, ``episode_end`` or ``reward``."""
    logged: str
    here: str
    why: str
    """What is known of it, or nothing."""

    def __str__(self) -> str:
        """As a person reads it."""
        why = f" ({self.why})" if self.why else ""
        return f"{self.file}, line {self.line}: {self.what} {self.logged}, here {self.here}{why}"


class Differences:
    """Counts differences, keeps the first of each kind, and writes all of them to a file; a context manager.

    Args:
        path: CSV file to write; none without it.
    """

    def __init__(self, path: str | Path | None = None) -> None:
        self.path = None if path is None else Path(path)
        self.counts: Counter[str] = Counter()
        self.kept: list[Difference] = []
        self._file: TextIO | None = None

    def add(
        self, log: Log, what: str, rows: NDArray[np.intp], logged: Iterable[Any], here: Iterable[Any], why: list[str]
    ) -> None:
        """Note some rows of a log that differ, each with both values."""
        for row, theirs, ours, reason in zip(rows.tolist(), logged, here, why, strict=True):
            number, step = int(log.episode[row]), int(log.steps[row])
            values = (_text(theirs), _text(ours), reason)
            found = Difference(log.source, int(log.lines[row]), number, step, what, *values)
            if self.counts[what] < MAX_KEPT:
                self.kept.append(found)
            self.counts[what] += 1
            self._write(asdict(found).values())

    def is_wanted(self, what: str) -> bool:
        """Whether another difference of this kind would be shown to anybody, so that its reason is worth finding."""
        return self.path is not None or self.counts[what] < MAX_KEPT

    def shown(self, count: int) -> list[Difference]:
        """Some of those kept, of every kind."""
        kinds = [[found for found in self.kept if found.what == what] for what in self.counts]
        return [found for some in kinds for found in some[: max(1, count // len(kinds))]]

    def _write(self, values: Iterable[Any]) -> None:
        if self._file is not None:
            try:
                csv.writer(self._file, lineterminator="\n").writerow(values)
            except OSError as error:
                raise self._failure(error) from error

    def _failure(self, error: OSError) -> RunError:
        return RunError(f"{self.path} cannot be written: {error.strerror or error}.")

    def __enter__(self) -> Self:
        """Begin the file."""
        if self.path is not None:
            try:
                self.path.parent.mkdir(parents=True, exist_ok=True)
                self._file = self.path.open("w", encoding="utf-8", newline="")
            except OSError as error:
                raise self._failure(error) from error
            self._write(field.name for field in fields(Difference))
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Finish the file; what was found stays in it also after an error."""
        if self._file is not None:
            try:
                self._file.close()
            except OSError as failure:
                raise self._failure(failure) from failure


def why_wheels(track: Track, log: Log, rows: NDArray[np.intp], on_track: NDArray[np.bool_]) -> list[str]:
    """Why all wheels are on the track in these rows of the log, or are not, unlike here.

    Args:
        track: Where.
        log: The log.
        rows: Its rows in question   (D,).
        on_track: What the rules here say of them   (D,).
    """
    margins = wheel_margins(track, log.x[rows], log.y[rows], log.heading[rows])
    reasons = []
    for row, is_on, margin in zip(rows.tolist(), on_track.tolist(), margins, strict=True):
        if log.is_prepare[row] or log.is_paused[row]:
            reasons.append("the car was just put back: its wheels were looked up before or after its pose")
            continue
        # Here all are on: the nearest to the border must be off there. Here some are off: the farthest must be on.
        decisive = margin.min()
        side = "inside" if is_on else "outside"
        reasons.append(f"a wheel's centre is {1000 * abs(decisive):.1f} mm {side} the border")
    return reasons


def why_end(track: Track, log: Log, row: int) -> str:
    """Why a car is off the track in this row, or is not, unlike here."""
    margin = wheel_margins(track, log.x[[row]], log.y[[row]], log.heading[[row]])[0].max()
    side = "inside" if margin > 0 else "outside"
    return f"the last wheel's centre is {1000 * abs(margin):.1f} mm {side} the border"


def wheel_margins(
    track: Track, x: NDArray[np.float64], y: NDArray[np.float64], heading: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Distance in m of each wheel's centre from the nearest border, positive on the road   (P, 4).

    Args:
        track: Where.
        x: m, of the logged point   (P,).
        y: m   (P,).
        heading: rad   (P,).
    """
    import shapely

    cos, sin = np.cos(heading)[:, None], np.sin(heading)[:, None]
    forward, left = np.array(_WHEELS).T
    forward = forward - _AHEAD
    places = np.stack([x[:, None] + forward * cos - left * sin, y[:, None] + forward * sin + left * cos], axis=-1)
    if track.is_closed:
        rings = sorted((shapely.Polygon(track.inner), shapely.Polygon(track.outer)), key=lambda ring: -ring.area)
        road = shapely.Polygon(rings[0].exterior, [rings[1].exterior])
    else:
        road = shapely.Polygon(np.concatenate((track.inner, track.outer[::-1])))
    distance = shapely.distance(road.boundary, shapely.points(places))
    return np.asarray(np.where(shapely.contains_xy(road, places[..., 0], places[..., 1]), distance, -distance))


def _text(value: Any) -> str:
    return f"{value:.9g}" if isinstance(value, float) else str(value)
