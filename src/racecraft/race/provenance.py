"""By whose rules something was driven: what of a race's conditions is the library's, and what is somebody's own.

    conditions -> *provenance* -> "driven by drfc rules with the standard car v5 on reinvent_2018"
                                  "... with a car of its own (front_friction 1.9 instead of 0.32) ..."

A replay that comes out the same only proves that these actions lead to these laps under its own conditions. With
softer tyres or a shorter penalty they are worth another thing, so whoever shows laps says this beside them.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from contextlib import suppress
from dataclasses import asdict, dataclass
from typing import Any, Final

from racecraft.errors import RacecraftError
from racecraft.race.conditions import STANDARD_CAR, Conditions
from racecraft.race.rules import RULE_SETS, RaceRules
from racecraft.sim.randomization import PRESETS as RANDOMIZATIONS
from racecraft.sim.randomization import Randomization
from racecraft.sim.vehicle import PRESETS as VEHICLES
from racecraft.sim.vehicle import Vehicle
from racecraft.track import Track, load_track, track_names
from racecraft.track.load import GENERATED

CHOICES: Final = frozenset(
    {"laps", "time_limit", "direction", "starts", "start_offset", "lateral_jitter", "heading_jitter"}
)
"""Rules that say what is driven; the others, what mistakes cost, are what a rule set is known by."""
PARTS: Final = ("rules", "vehicle", "track", "randomize", "among")
MAX_NAMED: Final = 6
"""Differences that are named one by one."""


@dataclass(frozen=True, kw_only=True)
class Provenance:
    """Conditions in words."""

    rules: str
    """``by drfc rules``, or ``by rules of its own (...)``."""
    vehicle: str
    """``with the standard car v5``, ``with the car v4``, or ``with a car of its own (...)``."""
    track: str
    """``on`` its name, ``on a track of its own that is called ...``, or on one that is known from the file only."""
    randomize: str
    """``under the randomisation 'light'``, or ``under a randomisation of its own (...)``; empty without."""
    among: str
    """What else stood or drove on the road; empty where nothing did."""
    own: tuple[str, ...]
    """Names of those of the above that are not the library's."""

    @property
    def sentence(self) -> str:
        """All of it, without capital and full stop."""
        return self._driven(())

    @property
    def verdict(self) -> str:
        """The same with what is not the library's in front, as ``, but with a car of its own (...): driven ...``."""
        own = " and ".join(getattr(self, name) for name in self.own)
        return f"{f', but {own}' if own else ''}: {self._driven(self.own)}"

    def to_dict(self) -> dict[str, Any]:
        """As JSON."""
        return {**asdict(self), "own": list(self.own), "sentence": self.sentence}

    def _driven(self, left_out: Collection[str]) -> str:
        parts = [getattr(self, name) for name in PARTS if name not in left_out]
        return " ".join(["driven", *filter(None, parts)])


def provenance(conditions: Conditions) -> Provenance:
    """By whose rules, in whose car and on whose track something was driven."""
    found = {
        "rules": _rules(conditions.rules),
        "vehicle": _vehicle(conditions.vehicle),
        "track": _track(conditions.track),
        "randomize": _randomize(conditions.randomize),
    }
    own = tuple(name for name, (_, is_own) in found.items() if is_own)
    return Provenance(**{name: text for name, (text, _) in found.items()}, among=_among(conditions), own=own)


def track_note(track: Track) -> str:
    """Whether a track is the one that is known by its name."""
    known = None
    if track.name in track_names() or track.name.startswith(GENERATED):  # never a file: the name is a stranger's
        with suppress(RacecraftError):
            known = load_track(track.name)
    if known is None:
        return "known from the file only"
    return "as in the library" if known.digest == track.digest else "not the one of this name in the library"


def vehicle_note(vehicle: Vehicle) -> str:
    """A preset's name, or ``custom``."""
    return next((name for name, preset in VEHICLES.items() if preset == vehicle), "custom")


def _rules(rules: RaceRules) -> tuple[str, bool]:
    costs = {name: _costs(known) for name, known in RULE_SETS.items()}
    name, differing = _nearest(_costs(rules), costs)
    if differing:
        return f"by rules of its own ({differing}, otherwise {name})", True
    return f"by {name} rules", False


def _costs(rules: RaceRules) -> dict[str, Any]:
    return {name: value for name, value in rules.to_dict().items() if name not in CHOICES}


def _vehicle(vehicle: Vehicle) -> tuple[str, bool]:
    known = {STANDARD_CAR: VEHICLES[STANDARD_CAR], **VEHICLES}
    name, differing = _nearest(asdict(vehicle), {name: asdict(one) for name, one in known.items()})
    if differing:
        return f"with a car of its own ({differing}, otherwise {name})", True
    return f"with the {'standard ' if name == STANDARD_CAR else ''}car {name}", False


def _track(track: Track) -> tuple[str, bool]:
    note = track_note(track)
    if note == "as in the library":
        return f"on {track.name}", False
    if note == "known from the file only":
        return f"on {track.name}, a track that is {note}", True
    return f"on a track of its own that is called {track.name}", True


def _randomize(randomize: Randomization) -> tuple[str, bool]:
    if randomize.is_off:
        return "", False
    name, differing = _nearest(asdict(randomize), {name: asdict(known) for name, known in RANDOMIZATIONS.items()})
    if not differing:
        return f"under the randomisation {name!r}", False
    return f"under a randomisation of its own ({differing}, otherwise {name!r})", True


def _among(conditions: Conditions) -> str:
    """Everything else that stands or drives, by number and kind."""
    boxes, bots, others = conditions.objects.obstacles, conditions.objects.bots, conditions.cars_per_race - 1
    parts = []
    if boxes is not None and boxes.count:
        kinds = ("box", "boxes") if boxes.kind == "box" else ("parked car", "parked cars")
        parts.append(f"{boxes.count} {kinds[boxes.count > 1]}")
    if bots is not None and bots.count:
        parts.append(f"{bots.count} {('bot', 'bots')[bots.count > 1]} at {bots.speed:g} m/s")
    if others:
        parts.append(f"{others} other {('car', 'cars')[others > 1]}")
    return f"among {', '.join(parts)}" if parts else ""


def _nearest(given: Mapping[str, Any], known: Mapping[str, Mapping[str, Any]]) -> tuple[str, str]:
    """The most similar of some settings by name, the first of equals, and what differs from it in words."""
    differing = {name: [key for key in given if given[key] != one[key]] for name, one in known.items()}
    name = min(differing, key=lambda name: len(differing[name]))
    keys = differing[name]
    named = [f"{key} {_value(given[key])} instead of {_value(known[name][key])}" for key in keys[:MAX_NAMED]]
    more = [f"{len(keys) - MAX_NAMED} more"] if len(keys) > MAX_NAMED else []
    return name, ", ".join(named + more)


def _value(value: Any) -> str:
    if isinstance(value, tuple | list):
        return " to ".join(map(_value, value))
    return f"{value:g}" if isinstance(value, float) else str(value)
