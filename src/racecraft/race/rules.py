"""The rules of a race against the clock, alone or among objects: laps, resets, penalties, where and how a trial starts.

What happens in a step (off track, immobilized, reversed, lap complete) is judged by the simulator's core;
these rules say what follows from it. Defaults are deepracer-for-cloud's; `RULE_SETS` has others by name.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields, replace
from typing import Any, Final

from racecraft.checks import check_choice, check_flag, check_number, check_type, check_whole
from racecraft.errors import ConfigError, did_you_mean
from racecraft.sim.simulation import CONTROL_DT

RACE_DIRECTIONS: Final = ("forward", "reverse")
STARTS: Final = ("line", "lap")
RESET_STATUSES: Final = ("crashed", "off_track", "immobilized", "reversed")
"""What puts a car back on the track, at the price of a reset and a penalty."""


@dataclass(frozen=True, kw_only=True)
class RaceRules:
    """What a trial is and what mistakes cost."""

    laps: int = 3
    """Laps to a trial, 1 to 1000."""
    is_continuous: bool = True
    """Laps flow on without a stop; otherwise, and always on an open track, each has a standing start."""
    max_resets: int = 100
    """Resets before the next mistake ends the trial; counted anew with every standing start."""
    offtrack_penalty: float = 5.0
    """s that the car stands after leaving the track, or after driving the wrong way."""
    collision_penalty: float = 5.0
    """s that the car stands after a crash."""
    immobilized_penalty: float = 0.0
    """s that the car stands after having been stuck; the original asks for none."""
    mercy_after: int = 3
    """Crashes into the same object after which a car is put past it instead of behind it; 0 for never."""
    time_limit: float = 0.0
    """s on the clock, penalties included, that end a trial; 0 for none, 180 in AWS's live events."""
    starts: str = "line"
    """``line``: all trials start at `start_offset`, trial 0 exactly, the others off by the jitter. ``lap``: every one
    starts, off by the jitter, somewhere on the lap, drawn from the seed. An open track starts at its beginning."""
    start_offset: float = 0.0
    """Fraction of a lap from the first waypoint to the line that trials start at."""
    direction: str = "forward"
    """``forward``, or ``reverse`` to race against the route."""
    lateral_jitter: float = 0.02
    """m: how far to either side the start may lie."""
    heading_jitter: float = math.radians(2.0)
    """rad: how far to either side the start may point."""

    def __post_init__(self) -> None:
        for name, least, most in (("laps", 1, 1000), ("max_resets", 0, 1_000_000), ("mercy_after", 0, 1_000_000)):
            check_whole(f"Race rule {name}", getattr(self, name), least, most, is_plain=True)
        limits = {
            "offtrack_penalty": 600.0,
            "collision_penalty": 600.0,
            "immobilized_penalty": 600.0,
            "time_limit": 86_400.0,
            "start_offset": 0.999999,
            "lateral_jitter": 1.0,
            "heading_jitter": math.pi,
        }
        for name, high in limits.items():
            check_number(f"Race rule {name}", getattr(self, name), 0.0, high, is_plain=True)
        check_flag("Race rule is_continuous", self.is_continuous)
        check_choice("Race rule direction", self.direction, RACE_DIRECTIONS)
        check_choice("Race rule starts", self.starts, STARTS)

    def penalty(self, status: str) -> float:
        """Seconds that a car stands after a mistake.

        Args:
            status: ``off_track``, ``reversed``, ``crashed`` or ``immobilized``.
        """
        if status == "crashed":
            return self.collision_penalty
        if status == "immobilized":
            return self.immobilized_penalty
        return self.offtrack_penalty

    def penalty_steps(self, status: str) -> int:
        """The same in control steps, rounded to the nearest."""
        return round(self.penalty(status) / CONTROL_DT)

    def to_dict(self) -> dict[str, Any]:
        """Plain values, for a run folder or the command line."""
        return asdict(self)

    @classmethod
    def from_dict(cls, document: Mapping[str, Any]) -> RaceRules:
        """From what `to_dict` gave; what is missing has its default.

        Raises:
            ConfigError: There is no such rule, or a value is outside its range.
        """
        _check_names(document)
        return cls(**document)


RULE_SETS: Final[dict[str, RaceRules]] = {
    "drfc": RaceRules(),
    "worker": RaceRules(laps=10, is_continuous=False, max_resets=0, offtrack_penalty=2.0),
    "droa": RaceRules(max_resets=10_000, offtrack_penalty=1.0, collision_penalty=1.0),
    "live": RaceRules(laps=15, max_resets=10_000, offtrack_penalty=2.0, time_limit=180.0),
    "first_lap": RaceRules(laps=1, is_continuous=False, max_resets=0),
}
"""Rules by name.

``drfc``: deepracer-for-cloud's defaults.
``worker``: AWS's simulation worker when nothing is set: ten standing laps, of which none forgives a mistake.
``droa``: DeepRacer on AWS.
``live``: three minutes, as in a final.
``first_lap``: does the car get round once, with nobody to put it back? Evaluation during training asks that.
"""

RACE_STARTS: Final[dict[str, Any]] = {
    "starts": "lap",
    "lateral_jitter": 0.1,
    "heading_jitter": math.radians(5.0),
}
"""Where entries of a race start, whatever set of rules it is held by: nobody can prepare for one place alone."""


def race_rules(rules: str | RaceRules, changes: dict[str, Any]) -> RaceRules:
    """A rule set for a race, with single rules changed: its entries start all over the lap.

    Raises:
        ConfigError: There are no such rules, or a value is outside its range.
    """
    return rules_by_name(rules, {**RACE_STARTS, **changes})


def rules_by_name(rules: str | RaceRules, changes: dict[str, Any]) -> RaceRules:
    """A rule set, with single rules changed.

    Raises:
        ConfigError: There are no such rules, or a value is outside its range.
    """
    if isinstance(rules, str):
        check_choice("rules", rules, RULE_SETS)
        rules = RULE_SETS[rules]
    check_type("rules", rules, RaceRules, f"use {', '.join(RULE_SETS)} or racecraft.RaceRules(...)")
    _check_names(changes)
    return replace(rules, **changes)


def _check_names(document: Mapping[str, Any]) -> None:
    known = [rule.name for rule in fields(RaceRules)]
    for name in document:
        if name not in known:
            raise ConfigError(f"There is no race rule {name!r}. {did_you_mean(name, known)}".rstrip())
