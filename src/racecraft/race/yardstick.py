"""Where a time would have placed in AWS's official races on the same track: percentiles of the entrants' times.

    evaluation -> its time, as the race timed it -> percentile between the known ones -> "faster than about 93 %"

The table holds facts only: month, entrants and eight points of the distribution of each official time trial, no
names. All its times are of one lap: no entrant averaged more than 4 m/s, whatever the race was ranked by.
"""

from __future__ import annotations

import csv
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, Final

import numpy as np

from racecraft.errors import ConfigError
from racecraft.race.results import Evaluation
from racecraft.sim.vehicle import PRESETS as VEHICLES
from racecraft.track.track import Track

PERCENTILES: Final = (1.0, 5.0, 10.0, 25.0, 50.0, 75.0, 90.0)
"""Per cent of the entrants that were as fast or faster; the table also has the fastest time of all."""
TIMINGS: Final = {
    "BEST_LAP_TIME": "best lap",
    "AVG_LAP_TIME": "mean lap",
    "TOTAL_TIME": "total time, per lap",
}
"""What races were ranked by, and what of an evaluation is set against it."""
SAME_LENGTH: Final = 0.02
"""A track belongs to a race if it has the name and, within this fraction, the length."""
MONTHS: Final = (
    *("January", "February", "March", "April", "May", "June"),
    *("July", "August", "September", "October", "November", "December"),
)
ALIASES: Final = {
    # the same road with other scenery
    "Monaco_building": "Monaco",
    "Singapore": "Singapore_building",
    "Singapore_f1": "Singapore_building",
    "Spain_track_f1": "Spain_track",
    # raced under the name without the direction; both ran counter-clockwise
    "2022_reinvent_champ_ccw": "2022_reinvent_champ",
    "2024_reinvent_champ_ccw": "2024_reinvent_champ",
}
"""Names of route files to the name in the table. ``X_ccw`` also stands for ``X`` where that ran counter-clockwise."""
CLOCKWISE: Final = frozenset({"Spain_track", "FS_June2020", "July_2020", "Albert", "Belille", "Aragon", "Monaco"})
"""Tracks in the table that were raced clockwise."""


@dataclass(frozen=True, kw_only=True)
class OfficialRace:
    """One official time trial."""

    track: str
    """Name of the track, as AWS's route files have it."""
    length: float
    """m"""
    month: str
    """``2020-03``"""
    entrants: int
    """Racers with a time."""
    timing: str
    """What it was ranked by, of `TIMINGS`."""
    best: float
    """Fastest time, s."""
    times: tuple[float, ...]
    """Times at `PERCENTILES`, s."""

    @property
    def title(self) -> str:
        """``race of March 2020``."""
        year, month = self.month.split("-")
        return f"race of {MONTHS[int(month) - 1]} {year}"

    def share_beaten(self, time: float) -> tuple[float, str]:
        """Share of the entrants that a time beats, per cent, and how sure that is.

        Between two known percentiles the share runs straight over the logarithm of the time. Outside of them only a
        bound is known.

        Args:
            time: s

        Returns:
            The share, and ``about``, ``at most`` (slower than nine of ten) or ``all`` (faster than the fastest).
        """
        if not time > 0.0:
            raise ConfigError(f"A time of {time!r} s cannot be placed; allowed is more than 0.")
        if time < self.best:
            return 100.0, "all"
        if time > self.times[-1]:
            return 100.0 - PERCENTILES[-1], "at most"
        first = min(100.0 / self.entrants, PERCENTILES[0])
        slower = float(np.interp(np.log(time), np.log([self.best, *self.times]), [first, *PERCENTILES]))
        return 100.0 - slower, "about"


@dataclass(frozen=True, kw_only=True)
class Placing:
    """A time among those of an official race."""

    race: OfficialRace
    time: float
    """s, of the evaluation, as the race timed it."""
    share_beaten: float
    """Per cent of the entrants."""
    certainty: str
    """As `OfficialRace.share_beaten` says."""

    @property
    def sentence(self) -> str:
        """For people."""
        race = self.race
        what = f"{TIMINGS[race.timing].capitalize()} {self.time:.2f} s"
        entrants = f"the {race.entrants:,} entrants of the {race.title} on {race.track}"
        if self.certainty == "all":
            return f"{what}: faster than all of {entrants} (fastest {race.best:.2f} s)."
        if self.certainty == "at most":
            return f"{what}: slower than 90 % of {entrants}."
        share = f"{self.share_beaten:.1f}" if self.share_beaten >= 98.95 else f"{self.share_beaten:.0f}"
        return f"{what}: faster than about {share} % of {entrants}."

    def to_dict(self) -> dict[str, Any]:
        """As JSON."""
        return {
            "track": self.race.track,
            "month": self.race.month,
            "entrants": self.race.entrants,
            "timing": self.race.timing,
            "seconds": self.time,
            "share_beaten_percent": round(self.share_beaten, 2),
            "certainty": self.certainty,
            "sentence": self.sentence,
        }


def official_races(track: Track, *, direction: str = "forward") -> list[OfficialRace]:
    """Official time trials on a track in a direction, the one with most entrants first; empty for most tracks."""
    if direction != "forward":
        return []
    name = ALIASES.get(track.name, track.name)
    base, _, turn = name.rpartition("_")
    if turn in ("cw", "ccw") and (turn == "cw") == (base in CLOCKWISE):
        name = base
    found = [race for race in _table() if race.track == name]
    found = [race for race in found if abs(track.length - race.length) <= SAME_LENGTH * race.length]
    return sorted(found, key=lambda race: -race.entrants)


def placings(evaluation: Evaluation) -> list[Placing]:
    """Where an evaluation would have placed in every official race on its track, most entrants first.

    Races ranked by the best lap take the evaluation's best lap; the others, penalties included, the mean of the laps
    of the trials that were finished. A car that is none of the original's has no place among them, nor one that
    randomisation makes another.
    """
    rules, conditions, found = evaluation.rules, evaluation.conditions, []
    if conditions.vehicle not in VEHICLES.values() or conditions.randomize.changes_car:
        return []
    for race in official_races(evaluation.track, direction=rules.direction):
        if race.timing == "BEST_LAP_TIME":
            time = evaluation.best_lap
        else:
            time = evaluation.total_time / rules.laps if evaluation.total_time is not None else None
        if time is not None:
            share, certainty = race.share_beaten(time)
            found.append(Placing(race=race, time=time, share_beaten=share, certainty=certainty))
    return found


@cache
def _table() -> tuple[OfficialRace, ...]:
    with (Path(__file__).parent / "official_races.csv").open(encoding="utf-8", newline="") as file:
        return tuple(
            OfficialRace(
                track=row["track"],
                length=float(row["length"]),
                month=row["month"],
                entrants=int(row["entrants"]),
                timing=row["timing"],
                best=float(row["best"]),
                times=tuple(float(row[f"p{percent:.0f}"]) for percent in PERCENTILES),
            )
            for row in csv.DictReader(file)
        )
