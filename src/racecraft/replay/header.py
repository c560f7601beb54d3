"""The header of a replay file, checked field by field: what a stranger's file may say, and how much of it."""

from __future__ import annotations

from dataclasses import asdict
from typing import Annotated, Any, Final, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from racecraft.errors import ConfigError, RacecraftError, ReplayError
from racecraft.race.announcement import Announcement
from racecraft.race.conditions import Conditions
from racecraft.race.results import Lap
from racecraft.race.rules import RaceRules
from racecraft.sim.camera import CameraSpec
from racecraft.sim.columns import STATUS_NAMES
from racecraft.sim.objects import Objects
from racecraft.sim.randomization import Randomization
from racecraft.sim.vehicle import Vehicle
from racecraft.track.track import Track

MAX_CARS: Final = 1000
MAX_LAPS: Final = 100_000
MAX_STEPS: Final = 10_000_000
MAX_WAYPOINTS: Final = 65_535
"""As many as the core's tracks have."""

Name = Annotated[str, Field(max_length=200)]
Count = Annotated[int, Field(ge=0, le=2**53)]
Seconds = Annotated[float, Field(ge=0.0, le=1e9, allow_inf_nan=False)]
Fraction = Annotated[float, Field(ge=0.0, le=1.0, allow_inf_nan=False)]
Types = list[Literal["u1", "i2", "i4", "f4", "f8"]]
Settings = dict[Name, Any]


class _Strict(BaseModel):
    model_config = ConfigDict(strict=True, extra="forbid", frozen=True)


class LapHeader(_Strict):
    """As `racecraft.race.Lap`."""

    number: Annotated[int, Field(ge=1, le=MAX_LAPS)]
    status: Name
    start_time: Seconds
    time: Seconds
    completion: Fraction
    off_track_count: Count
    crash_count: Count
    immobilized_count: Count
    reversed_count: Count
    resets: Count
    penalty_seconds: Seconds


class CarHeader(_Strict):
    """One car and where its columns are."""

    name: Name
    steps: Annotated[int, Field(ge=1, le=MAX_STEPS)]
    status: Name
    completion: Fraction
    laps: Annotated[list[LapHeader], Field(max_length=MAX_LAPS)]
    types: Annotated[Types, Field(max_length=1000)]
    """Of the columns, in their order: actions, reward, and those of a judged row."""


class TrackHeader(_Strict):
    """The track; its lines are the file's first six columns."""

    name: Name
    waypoints: Annotated[int, Field(ge=2, le=MAX_WAYPOINTS)]
    repeats: Annotated[list[Count], Field(max_length=1000)]
    types: Annotated[Types, Field(min_length=6, max_length=6)]
    """Of the columns: x and y of the centre line, of the inner and of the outer border."""


class RaceHeader(_Strict):
    """The race that it is of, as `racecraft.race.announcement.Announcement`."""

    document: Settings
    commitment: Name
    secret: Name


class Header(_Strict):
    """Everything but the numbers of the steps."""

    title: Name
    racecraft: Name
    track: TrackHeader
    seed: Annotated[int, Field(ge=0, le=2**64 - 1)]
    rules: Settings
    vehicle: Settings
    camera: Settings | None
    objects: Settings
    randomize: Settings
    cars_per_race: Annotated[int, Field(ge=1, le=8)]
    """Cars that share a road, in the order of the grid; `cars` has one such race after the other."""
    race: RaceHeader | None = None
    """None of an evaluation."""
    cars: Annotated[list[CarHeader], Field(min_length=1, max_length=MAX_CARS)]


def check_header(document: dict[str, Any], *, name: str) -> Header:
    """The header, or one sentence about the first thing that is wrong with it.

    Raises:
        ReplayError: Names the field.
    """
    try:
        return Header.model_validate(document)
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(str(part) for part in first["loc"])
        raise ReplayError(f"The header of {name} is wrong at {where[:100]}: {first['msg']}.") from error


def header_of(conditions: Conditions) -> dict[str, Any]:
    """What a header says about the conditions of a race, the track aside."""
    return {
        "seed": conditions.seed,
        "rules": conditions.rules.to_dict(),
        "vehicle": asdict(conditions.vehicle),
        "camera": None if conditions.camera is None else asdict(conditions.camera),
        "objects": conditions.objects.to_dict(),
        "randomize": {name: list(ends) for name, ends in asdict(conditions.randomize).items()},
        "cars_per_race": conditions.cars_per_race,
    }


def conditions_of(header: Header, track: Track, *, name: str) -> Conditions:
    """The way back.

    Raises:
        ReplayError: A setting is not one of ours, or outside of what is allowed.
    """
    try:
        return Conditions(
            track=track,
            rules=RaceRules.from_dict(header.rules),
            seed=header.seed,
            vehicle=Vehicle(**header.vehicle),
            camera=None if header.camera is None else CameraSpec(**header.camera),
            objects=Objects.from_dict(header.objects),
            randomize=Randomization(**header.randomize),
            cars_per_race=header.cars_per_race,
        )
    except (RacecraftError, TypeError) as error:
        raise ReplayError(f"The settings in {name} are not allowed: {error}") from error


def race_of(header: Header, *, name: str) -> Announcement | None:
    """The race that a replay says it is of.

    Raises:
        ReplayError: Its announcement is none, or its commitment is not that of its secret.
    """
    try:
        return None if header.race is None else Announcement.from_dict(header.race.model_dump())
    except ConfigError as error:
        raise ReplayError(f"The race in {name} is not one: {error}") from error


def lap_of(header: LapHeader) -> Lap:
    """A lap."""
    if header.status not in STATUS_NAMES:
        raise ReplayError(f"A lap's status is {header.status!r}; allowed are {', '.join(STATUS_NAMES)}.")
    return Lap(**header.model_dump())
