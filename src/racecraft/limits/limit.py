"""The limit of a track for a car: known from the table or the user's cache, or computed.

track, vehicle -> table of the library's tracks -> the user's cache -> solver and line driver (seconds)
"""

from __future__ import annotations

import csv
import hashlib
import json
import os
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from racecraft.errors import TrackError
from racecraft.limits.medals import Medals
from racecraft.sim.vehicle import Vehicle
from racecraft.track.track import Track

if TYPE_CHECKING:
    from racecraft.limits.driver import DrivenLap
    from racecraft.limits.ideal import IdealLap

SPACING: Final = 0.05
"""m between samples of the road."""
MARGINS: Final = ((1.0, 0.02), (0.97, 0.03), (0.94, 0.04), (0.9, 0.06), (0.8, 0.08))
"""Grip the line is planned with over the car's, and m kept from the borders: the first to be driven well wins."""
TABLE: Final = Path(__file__).parent / "library.csv"
VERSION: Final = 1
"""Of the method; part of the keys, so that a better one computes anew."""
MAX_CACHE_BYTES: Final = 10_000


@dataclass(frozen=True, kw_only=True, eq=False)
class TrackLimit:
    """How fast a car can lap a track, all four wheels on the road."""

    ideal: float
    """s, flying lap of the car's equations with free commands: the limit."""
    driven: float
    """s, what our line driver really drives in the simulator, at 15 Hz: the author's time."""
    line: IdealLap | None = None
    """The ideal lap, where it was just computed."""
    lap: DrivenLap | None = None
    """The driven lap, where it was just driven."""

    @property
    def medals(self) -> Medals:
        """The times to reach."""
        return Medals.from_author(self.driven)

    def above(self, seconds: float) -> float:
        """How far a lap time is above the limit, as a fraction of it."""
        return seconds / self.ideal - 1.0

    def sentence(self, seconds: float) -> str:
        """A lap time against the limit and the medals, for people."""
        medals = self.medals
        won, missed = medals.won_by(seconds), medals.next_after(seconds)
        share = f"{100 * abs(self.above(seconds)):.0f} %"
        if seconds < self.ideal:
            distance = f"{share} below the limit of {self.ideal:.2f} s with all wheels on the road: corners were cut"
        else:
            distance = f"{share} above the limit of {self.ideal:.2f} s"
        medal = f"{won} medal" if won else "no medal yet"
        goal = f"; {missed} takes {getattr(medals, missed):.2f} s" if missed else ""
        return f"{seconds:.2f} s is {distance}: {medal}{goal}."

    def to_dict(self) -> dict[str, Any]:
        """As JSON."""
        return {"ideal_seconds": self.ideal, "driven_seconds": self.driven, "medals": vars(self.medals)}


def track_limit(track: Track, vehicle: Vehicle) -> TrackLimit:
    """The limit of a track in its driving direction, computed if it is not known yet.

    Raises:
        TrackError: The track is open, or no lap was found or could be driven.
        ConfigError: It has to be computed, and casadi is not installed.
    """
    known = known_limit(track, vehicle)
    if known is None:
        known = compute_limit(track, vehicle)
        _remember(limit_key(track, vehicle), known)
    return known


def known_limit(track: Track, vehicle: Vehicle) -> TrackLimit | None:
    """The limit if the table or the cache has it: takes no time."""
    key = limit_key(track, vehicle)
    return _table().get(key) or _recall(key)


def compute_limit(track: Track, vehicle: Vehicle) -> TrackLimit:
    """Compute the limit and drive the line.

    Raises:
        TrackError: The track is open, or no lap was found or could be driven.
        ConfigError: casadi is not installed.
    """
    # what solves and drives is imported late: every training imports this file, and SciPy takes its time
    from racecraft.limits.driver import drive_line
    from racecraft.limits.ideal import ideal_lap, smooth_lap
    from racecraft.limits.road import smooth_road

    road = smooth_road(track, spacing=SPACING)
    ideal = ideal_lap(road, vehicle)
    smooth: IdealLap | None = None
    best: DrivenLap | None = None
    for grip, margin in MARGINS:
        weaker = replace(
            vehicle,
            front_friction=max(0.05, grip * vehicle.front_friction),
            rear_friction=max(0.05, grip * vehicle.rear_friction),
            drive_acceleration=max(0.1, grip * vehicle.drive_acceleration),
            brake_acceleration=max(0.1, grip * vehicle.brake_acceleration),
        )
        try:
            smooth = smooth_lap(road.narrowed(margin), weaker, start=smooth)
        except TrackError:
            break  # no road is left between the margins
        lap = drive_line(track, smooth, vehicle)
        if lap is not None and (best is None or lap.time < best.time):
            best = lap
        elif best is not None:
            break  # slower lines will not be faster
    if best is None:
        raise TrackError(
            f"The line for track {track.name!r} was found, {ideal.time:.2f} s, but could not be driven with all wheels "
            "on the road."
        )
    return TrackLimit(ideal=round(ideal.time, 3), driven=round(best.time, 3), line=ideal, lap=best)


def limit_key(track: Track, vehicle: Vehicle) -> str:
    """What a limit belongs to: the road in its direction, the car and the method."""
    values = np.array(vehicle.values(), dtype="<f8").tobytes()
    return hashlib.sha256(f"{VERSION} {track.digest} ".encode() + values).hexdigest()[:32]


@cache
def _table() -> dict[str, TrackLimit]:
    with TABLE.open(encoding="utf-8", newline="") as file:
        return {
            row["key"]: TrackLimit(ideal=float(row["ideal"]), driven=float(row["driven"]))
            for row in csv.DictReader(file)
        }


def _cache_file(key: str) -> Path:
    root = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(root) / "racecraft" / "limits" / f"{key}.json"


def _recall(key: str) -> TrackLimit | None:
    """What the cache has; a file that is not as expected is as good as none."""
    try:
        path = _cache_file(key)
        if path.stat().st_size > MAX_CACHE_BYTES:
            return None
        data = json.loads(path.read_text(encoding="utf-8"))
        ideal, driven = float(data["ideal"]), float(data["driven"])
    except (OSError, RuntimeError, ValueError, KeyError, TypeError, RecursionError):
        return None
    return TrackLimit(ideal=ideal, driven=driven) if 0.0 < ideal <= 1e4 and 0.0 < driven <= 1e4 else None


def _remember(key: str, limit: TrackLimit) -> None:
    """Write the cache; a home that cannot be written to is no reason to fail."""
    try:
        path = _cache_file(key)
        path.parent.mkdir(parents=True, exist_ok=True)
        part = path.with_suffix(f".{os.getpid()}")
        part.write_text(json.dumps({"ideal": limit.ideal, "driven": limit.driven}), encoding="utf-8")
        part.replace(path)
    except (OSError, RuntimeError):
        return
