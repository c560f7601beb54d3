"""The rules of a race against the clock, alone or among objects: laps, resets, penalties, where and how a trial starts.

What happens in a step (off track, immobilized, reversed, lap complete) is judged by the simulator's core;
these rules say what follows from it. Defaults are deepracer-for-cloud's; `RULE_SETS` has others by name.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields, replace
from typing import Any, Final

from racecraft.errors import ConfigError, did_you_mean
from racecraft.sim.simulation import CONTROL_DT

RACE_DIRECTIONS: Final = ("forward", "reverse")
STARTS: Final = ("line", "lap")
RESET_STATUSES: Final = ("crashed", "off_track", "immobilized", "reversed")
"""What puts a car back on the track, at the price of a reset and a penalty."""


def _check_whole(name: str, value: object, low: int, high: int) -> None:
    if isinstance(value, bool) or not isinstance(value, int) or not low <= value <= high:
        raise ConfigError(f"Race rule {name} is {value!r}; allowed is a whole number from {low} to {high}.")


def _check_range(name: str, value: object, low: float, high: float, unit: str) -> None:
    if isinstance(value, bool) or not isinstance(value, int | float) or not low <= value <= high:
        raise ConfigError(f"Race rule {name} is {value!r}; allowed is {low:g} to {high:g} {unit}.")


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
        _check_whole("laps", self.laps, 1, 1000)
        _check_whole("max_resets", self.max_resets, 0, 1_000_000)
        _check_whole("mercy_after", self.mercy_after, 0, 1_000_000)
        _check_range("offtrack_penalty", self.offtrack_penalty, 0.0, 600.0, "s")
        _check_range("collision_penalty", self.collision_penalty, 0.0, 600.0, "s")
        _check_range("immobilized_penalty", self.immobilized_penalty, 0.0, 600.0, "s")
        _check_range("time_limit", self.time_limit, 0.0, 86_400.0, "s")
        _check_range("start_offset", self.start_offset, 0.0, 0.999999, "of a lap")
        _check_range("lateral_jitter", self.lateral_jitter, 0.0, 1.0, "m")
        _check_range("heading_jitter", self.heading_jitter, 0.0, math.pi, "rad")
        if not isinstance(self.is_continuous, bool):
            raise ConfigError(f"Race rule is_continuous is {self.is_continuous!r}; allowed are True and False.")
        for name, choices in (("direction", RACE_DIRECTIONS), ("starts", STARTS)):
            if (value := getattr(self, name)) not in choices:
                hint, allowed = did_you_mean(str(value), choices), " and ".join(choices)
                raise ConfigError(f"Race rule {name} is {value!r}; allowed are {allowed}.", hint=hint)

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
        known = [rule.name for rule in fields(cls)]
        for name in document:
            if name not in known:
                raise ConfigError(f"There is no race rule {name!r}. {did_you_mean(name, known)}".rstrip())
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
        if rules not in RULE_SETS:
            raise ConfigError(
                f"Rules {rules!r} do not exist; allowed are {', '.join(RULE_SETS)}.",
                hint=did_you_mean(rules, RULE_SETS),
            )
        rules = RULE_SETS[rules]
    return replace(rules, **changes)
