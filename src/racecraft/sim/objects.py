"""What stands or drives on the track besides the car: AWS's obstacles and bot cars.

    Objects -> *simulation* -> objects around every car, drawn, hit, and told to the reward function

Settings and defaults are those of deepracer-for-cloud (``DR_OA_*``, ``DR_H2B_*``), read by `objects_from_aws`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, fields
from typing import Any, Final

from racecraft import _native
from racecraft.checks import check_choice, check_flag, check_number, check_type, check_whole, make_plain, require
from racecraft.errors import ConfigError, did_you_mean

MAX_OBJECTS: Final = 32
"""On one track, obstacles and bot cars together."""
PLACEMENTS: Final = ("even", "random", "fixed")
OBSTACLE_KINDS: Final = ("box", "car")
OBJECT_KINDS: Final = ("box", "parked_car", "bot_car", "racer", "frozen_racer", "gone_racer")
"""By the number that the column `object_kind` holds. A racer is another agent's car: frozen while it stands as a
penalty (seen, but nobody can run into it), gone once its episode is over (neither seen nor hit)."""
RACE_TYPES: Final = ("time-trial", "object-avoidance", "head-to-bot")

Positions = tuple[tuple[float, int], ...]


def _check_group(name: str, count: Any, placement: Any, positions: Any, min_distance: Any) -> Positions:
    """The positions in their stored form."""
    check_whole(f"{name} count", count, 1, MAX_OBJECTS)
    check_choice(f"{name} placement", placement, PLACEMENTS)
    check_number(f"{name} min_distance", min_distance, 0.0, 1000.0)
    is_list = isinstance(positions, Sequence) and not isinstance(positions, str)
    require(f"{name} positions", positions, is_list, "a list of (fraction of a lap, lane)")
    stored = []
    for position in positions:
        is_pair = isinstance(position, Sequence) and not isinstance(position, str) and len(position) == 2
        require(f"{name} position", position, is_pair, "a pair (fraction of a lap, lane)")
        fraction, lane = position
        check_number(f"{name} position", fraction, 0.0, 1.0)
        check_number(f"{name} lane", lane, -1, 1)
        require(f"{name} lane", lane, lane in (1, -1), "1 (inner) or -1 (outer)")
        stored.append((float(fraction), int(lane)))
    if placement == "fixed" and len(stored) < count:
        raise ConfigError(
            f"{name} count is {count} with {len(stored)} fixed positions; allowed is one position for each.",
            hint="Give more positions, or choose placement 'even' or 'random'.",
        )
    return tuple(stored)


@dataclass(frozen=True, kw_only=True)
class Obstacles:
    """Boxes or parked cars, as in object avoidance."""

    count: int = 6
    """How many (``DR_OA_NUMBER_OF_OBSTACLES``)."""
    kind: str = "box"
    """``box`` (0.4 x 0.3 x 0.25 m) or ``car``, parked (``DR_OA_IS_OBSTACLE_BOT_CAR``)."""
    placement: str = "even"
    """``even`` along the lap in alternating lanes; ``random``, anew with every episode
    (``DR_OA_RANDOMIZE_OBSTACLE_LOCATIONS``); or ``fixed``."""
    positions: Positions = ()
    """Fixed places: fraction of a lap in driving direction, and lane, 1 inner, -1 outer
    (``DR_OA_OBJECT_POSITIONS``)."""
    min_distance: float = 2.0
    """m along the centre line between random places, as far as the track has room
    (``DR_OA_MIN_DISTANCE_BETWEEN_OBSTACLES``)."""

    def __post_init__(self) -> None:
        stored = _check_group("Obstacles", self.count, self.placement, self.positions, self.min_distance)
        object.__setattr__(self, "positions", stored)
        check_choice("Obstacles kind", self.kind, OBSTACLE_KINDS)
        make_plain(self)


@dataclass(frozen=True, kw_only=True)
class Bots:
    """Cars that follow a lane at a constant speed, as in head-to-bot."""

    count: int = 3
    """How many (``DR_H2B_NUMBER_OF_BOT_CARS``)."""
    speed: float = 0.2
    """m/s (``DR_H2B_BOT_CAR_SPEED``)."""
    placement: str = "even"
    """Where they start: as for `Obstacles` (``DR_H2B_RANDOMIZE_BOT_CAR_LOCATIONS``)."""
    positions: Positions = ()
    """Fixed starts, as for `Obstacles`."""
    min_distance: float = 2.0
    """m between random starts (``DR_H2B_MIN_DISTANCE_BETWEEN_BOT_CARS``)."""
    changes_lane: bool = False
    """Whether they change lanes now and then (``DR_H2B_IS_LANE_CHANGE``)."""
    shortest_stay: float = 3.0
    """s in a lane at least (``DR_H2B_LOWER_LANE_CHANGE_TIME``)."""
    longest_stay: float = 5.0
    """s in a lane at most; uniform between (``DR_H2B_UPPER_LANE_CHANGE_TIME``)."""
    change_distance: float = 1.0
    """m over which they change (``DR_H2B_LANE_CHANGE_DISTANCE``)."""

    def __post_init__(self) -> None:
        stored = _check_group("Bots", self.count, self.placement, self.positions, self.min_distance)
        object.__setattr__(self, "positions", stored)
        check_number("Bots speed", self.speed, 0.0, 10.0)
        check_flag("Bots changes_lane", self.changes_lane)
        check_number("Bots shortest_stay", self.shortest_stay, 0.1, 3600.0)
        check_number("Bots longest_stay", self.longest_stay, self.shortest_stay, 3600.0)
        check_number("Bots change_distance", self.change_distance, 0.1, 100.0)
        make_plain(self)


@dataclass(frozen=True, kw_only=True)
class Objects:
    """Everything on the track besides the car; nothing by default."""

    obstacles: Obstacles | None = None
    """Boxes or parked cars."""
    bots: Bots | None = None
    """Driving cars; they drive through obstacles, which no race of AWS's has beside them."""

    def __post_init__(self) -> None:
        if self.obstacles is not None:
            check_type("Objects obstacles", self.obstacles, Obstacles, "use racecraft.sim.Obstacles(...), or None")
        if self.bots is not None:
            check_type("Objects bots", self.bots, Bots, "use racecraft.sim.Bots(...), or None")
        if self.count > MAX_OBJECTS:
            raise ConfigError(f"A track has {self.count} objects; allowed are up to {MAX_OBJECTS}.")

    @property
    def count(self) -> int:
        """How many objects there are, obstacles first, then bots."""
        return sum(group.count for group in (self.obstacles, self.bots) if group is not None)

    @property
    def race_type(self) -> str:
        """``time-trial``, ``object-avoidance`` or ``head-to-bot``."""
        return (
            RACE_TYPES[2] if self.bots is not None else RACE_TYPES[1] if self.obstacles is not None else RACE_TYPES[0]
        )

    def to_dict(self) -> dict[str, Any]:
        """As JSON."""
        return asdict(self)

    @classmethod
    def from_dict(cls, document: Mapping[str, Any]) -> Objects:
        """From what `to_dict` gave.

        Raises:
            ConfigError: It is no mapping, a value is not allowed, or a key is unknown.
        """
        if not isinstance(document, Mapping) or not {"obstacles", "bots"}.issuperset(document):
            raise ConfigError(f"Objects are {str(document)[:200]}; allowed are obstacles and bots.")
        groups: dict[str, Any] = {}
        for name, kind in (("obstacles", Obstacles), ("bots", Bots)):
            values = document.get(name)
            if values is None:
                continue
            known = {field.name for field in fields(kind)}
            if not isinstance(values, Mapping) or not known.issuperset(values):
                raise ConfigError(f"Objects {name} are {values!r}; allowed are the fields of {kind.__name__}.")
            groups[name] = kind(**values)
        return cls(**groups)


NO_OBJECTS: Final = Objects()


def objects_for_race(race_type: str, *, settings: Mapping[str, Any] | None = None) -> Objects:
    """The objects of a race type, with defaults as deepracer-for-cloud has them.

    Args:
        race_type: ``time-trial``, ``object-avoidance`` or ``head-to-bot``; AWS's spelling is understood, too.
        settings: Fields of `Obstacles` or of `Bots`, whichever the race has.

    Raises:
        ConfigError: No such race type, or a setting is not allowed.
    """
    name = str(race_type).lower().replace("_", "-")
    check_choice("Race type", name, RACE_TYPES)
    given = dict(settings or {})
    if name == "time-trial":
        if given:
            raise ConfigError(f"A time trial has no objects, but {', '.join(given)} was set.")
        return NO_OBJECTS
    kind: type[Obstacles] | type[Bots] = Obstacles if name == "object-avoidance" else Bots
    for key in given:
        known = [field.name for field in fields(kind)]
        if key not in known:
            raise ConfigError(f"{kind.__name__} have no setting {key!r}.", hint=did_you_mean(key, known))
    group = kind(**given)
    return Objects(obstacles=group) if isinstance(group, Obstacles) else Objects(bots=group)


def objects_from_aws(settings: Mapping[str, Any]) -> Objects:
    """The objects that AWS's settings describe by their race type.

    Args:
        settings: Name to value, as in ``training_params.yaml`` (``RACE_TYPE``, ``NUMBER_OF_OBSTACLES``) or in
            deepracer-for-cloud's ``run.env`` (``DR_RACE_TYPE``, ``DR_OA_NUMBER_OF_OBSTACLES``); what means nothing in
            this race is left alone.

    Raises:
        ConfigError: Names the setting and its value.
    """
    is_named = isinstance(settings, Mapping) and all(isinstance(name, str) for name in settings)
    require("settings", settings, is_named, "a dict of AWS's names and values")
    named = {aws_object_setting(name): (name, value) for name, value in settings.items()}
    race_type = str(named.get("RACE_TYPE", ("", "TIME_TRIAL"))[1])
    given: dict[str, Any] = {}
    for setting, (race, field, read) in _AWS.items():
        name, value = named.get(setting, ("", ""))
        text = ";".join(map(str, value)) if isinstance(value, list) else str(value)
        if race_type == race and text != "":
            try:
                given[field] = read(text)
            except ValueError as error:
                raise ConfigError(f"{name} is {text!r}; {error}.") from error
    if given.get("positions"):
        given["placement"] = "fixed"
        given["count"] = len(given["positions"])
    elif given.pop("is_random", False):
        given["placement"] = "random"
    given.pop("is_random", None)
    if given.get("count") == 0:
        return NO_OBJECTS
    return objects_for_race(race_type, settings=given)


def aws_object_setting(name: str) -> str:
    """The name in ``training_params.yaml``: ``OBJECT_POSITIONS`` for ``DR_OA_OBJECT_POSITIONS``."""
    for prefix in ("DR_OA_", "DR_H2B_", "DR_"):
        name = name.removeprefix(prefix)
    return name


def has_aws_meaning(race_type: str, name: str) -> bool:
    """Whether a setting places objects in a race of AWS's type."""
    setting = aws_object_setting(name)
    return setting in _AWS and _AWS[setting][0] == race_type


def parse_positions(text: str) -> Positions:
    """AWS's ``"0.23,-1;0.46,1"``: fraction of a lap and lane, of one object after the other.

    Raises:
        ValueError: It is not that.
    """
    try:
        pairs = [part.split(",") for part in text.strip().strip('"').split(";") if part.strip()]
        return tuple((float(fraction), int(float(lane))) for fraction, lane in pairs)
    except (ValueError, OverflowError) as error:
        raise ValueError('allowed is "fraction,lane;fraction,lane", for example "0.23,-1;0.46,1"') from error


def _truth(text: str) -> bool:
    if text.strip().lower() not in ("true", "false"):
        raise ValueError("allowed are True and False")
    return text.strip().lower() == "true"


def _whole(text: str) -> int:
    digits = text.strip()
    if not (digits.isascii() and digits.isdigit() and len(digits) < 10):
        raise ValueError("allowed is a whole number")
    return int(digits)


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError as error:
        raise ValueError("allowed is a number") from error


def _obstacle_kind(text: str) -> str:
    return "car" if _truth(text) else "box"


_OA, _H2B = "OBJECT_AVOIDANCE", "HEAD_TO_BOT"
_AWS: Final[dict[str, tuple[str, str, Any]]] = {
    "NUMBER_OF_OBSTACLES": (_OA, "count", _whole),
    "MIN_DISTANCE_BETWEEN_OBSTACLES": (_OA, "min_distance", _number),
    "RANDOMIZE_OBSTACLE_LOCATIONS": (_OA, "is_random", _truth),
    "IS_OBSTACLE_BOT_CAR": (_OA, "kind", _obstacle_kind),
    "OBJECT_POSITIONS": (_OA, "positions", parse_positions),
    "NUMBER_OF_BOT_CARS": (_H2B, "count", _whole),
    "MIN_DISTANCE_BETWEEN_BOT_CARS": (_H2B, "min_distance", _number),
    "RANDOMIZE_BOT_CAR_LOCATIONS": (_H2B, "is_random", _truth),
    "BOT_CAR_SPEED": (_H2B, "speed", _number),
    "IS_LANE_CHANGE": (_H2B, "changes_lane", _truth),
    "LOWER_LANE_CHANGE_TIME": (_H2B, "shortest_stay", _number),
    "UPPER_LANE_CHANGE_TIME": (_H2B, "longest_stay", _number),
    "LANE_CHANGE_DISTANCE": (_H2B, "change_distance", _number),
}


def native_objects(objects: Objects) -> _native.ObjectRule:
    """The core's form."""
    bots = objects.bots or Bots()
    kind = "bot_car" if objects.bots else "box"
    obstacle_kind = "parked_car" if objects.obstacles and objects.obstacles.kind == "car" else "box"
    return _native.ObjectRule(
        _native_group(objects.obstacles, obstacle_kind),
        _native_group(objects.bots, kind),
        speed=bots.speed,
        changes_lane=bots.changes_lane,
        shortest_stay=bots.shortest_stay,
        longest_stay=bots.longest_stay,
        change_distance=bots.change_distance,
    )


def _native_group(group: Obstacles | Bots | None, kind: str) -> _native.ObjectGroup:
    if group is None:
        return _native.ObjectGroup(OBJECT_KINDS.index(kind), 0, 0, 2.0, [], [])
    fractions = [fraction for fraction, _ in group.positions]
    lanes = [float(lane) for _, lane in group.positions]
    placement = PLACEMENTS.index(group.placement)
    return _native.ObjectGroup(OBJECT_KINDS.index(kind), group.count, placement, group.min_distance, fractions, lanes)
