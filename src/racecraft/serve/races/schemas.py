"""What browser and server tell each other about races."""

from __future__ import annotations

from datetime import datetime
from typing import Annotated, Any, Final, Literal

from pydantic import Field

from racecraft.film.ghost import MAX_GHOSTS
from racecraft.serve.conditions import AskedRanges, AskedVehicle
from racecraft.serve.evaluations.schemas import RoadObject
from racecraft.serve.naming import PLAIN
from racecraft.serve.races.ghost_schemas import CheckpointChoice, Ghost
from racecraft.serve.road import OnRoad, Seconds
from racecraft.serve.schemas import Message, Moment, RunName
from racecraft.serve.tracks.schemas import TrackGeometry, TrackSector
from racecraft.sim.objects import MAX_OBJECTS

RaceKind = Literal["time-trial", "object-avoidance", "head-to-bot"]
Ranking = Literal["total", "best", "average"]
RaceState = Literal["upcoming", "open", "closed"]
Title = Annotated[str, Field(min_length=1, max_length=100, pattern=r"\S"), PLAIN]

MAX_CARS: Final = 12
"""Of a replay."""


class RuleSet(Message):
    """Rules by a name, and of them those that whoever holds a race may choose one by one."""

    name: str
    laps: int
    offtrack_penalty: float
    """s"""
    collision_penalty: float
    """s"""
    max_resets: int
    time_limit: float
    """s; 0 for none."""


class RaceSettings(OnRoad):
    """By which rules models race, in which car and among what: what races, heats and ladders are asked alike."""

    rules: Literal["drfc", "worker", "droa", "live"] = "drfc"
    """A set of rules; single ones may differ."""
    offtrack_penalty: Seconds | None = None
    """By default the rules', as all that follow."""
    collision_penalty: Seconds | None = None
    max_resets: int | None = Field(None, ge=0, le=10_000)
    time_limit: float | None = Field(None, ge=0.0, le=86_400.0, allow_inf_nan=False)
    """s on the clock, penalties included, that end a trial; 0 for none."""
    direction: Literal["forward", "reverse"] = "forward"
    vehicle: AskedVehicle = "v5"
    """Everybody's, whatever they were trained with."""
    randomize: AskedRanges = "none"
    """What differs from what the models know; the same for all."""
    seed: int | None = Field(None, ge=0, le=2**32 - 1)
    """Of starts and objects; by default drawn."""


class RankedSettings(RaceSettings):
    """The same, and what places go by where models are not only compared two at a time."""

    ranking: Ranking = "total"
    minimum_laps: int | None = Field(None, ge=1, le=20)
    """That a trial must have for a score; always all for the total, by default three in a row for the average, one for
    the best."""


class NewRace(RankedSettings):
    """A race; but for the title every field has a good default."""

    title: Title
    description: str = Field("", max_length=500)
    kind: RaceKind = "time-trial"
    track: str = Field("reinvent_2018", max_length=200)
    laps: int | None = Field(None, ge=1, le=20)
    """By default the rules'."""
    objects: int = Field(6, ge=1, le=MAX_OBJECTS)
    """Boxes or bot cars, where the kind has them."""
    trials: int = Field(5, ge=1, le=15)
    """Of each entry, from as many places of the lap; the median of their scores counts."""
    seed: int | None = Field(None, ge=0, le=2**32 - 1)
    """Of starts and objects, for practice: everybody knows it. By default both are drawn from a secret."""
    opens: Moment | None = None
    """By default now."""
    closes: Moment | None = None


class RaceChange(Message):
    """What may change while a race is on."""

    title: Title | None = None
    description: str | None = Field(None, max_length=500)
    closes: Moment | None = None
    is_over: Literal[True] | None = None
    """To end it now, by the server's clock: that of whoever asks may be wrong."""


class RaceCard(Message):
    """A race in the calendar."""

    id: int
    title: str
    description: str
    kind: RaceKind
    track: str
    laps: int
    ranking: Ranking
    minimum_laps: int
    trials: int
    """Of each entry; the median of their scores counts."""
    is_old: bool
    """Whether it was driven under the old rules: once, from the line, each in the car that it was trained with."""
    opens: datetime
    closes: datetime | None
    created: datetime
    state: RaceState
    entries: int
    models: int
    running: int
    """Entries that are not decided yet."""
    leader: str | None
    leader_score: float | None


class Standing(Message):
    """A model's best entry and its place."""

    place: int | None
    """None when too few laps were completed."""
    entry: int
    model: str
    user: str
    score: float | None
    """s"""
    gap: float | None
    """s behind the first."""
    scores: list[float | None]
    """s of each trial; None with too few laps."""
    lap_times: list[list[float]]
    """s, of each trial."""
    best_lap: float | None
    laps: int
    """Completed."""
    completion: float
    off_tracks: int
    crashes: int
    resets: int
    penalty: float
    """s"""
    attempts: int
    """Entries of this model."""
    entered: datetime
    video: str | None
    """Its address, once it may be seen."""
    has_replay: bool
    is_verified: bool | None
    """Whether it came out the same when it was driven again; None if that is not known."""
    verdict: str
    """What came out otherwise."""


class Undecided(Message):
    """An entry that is driven or waits, or that failed."""

    entry: int
    model: str
    state: Literal["queued", "running", "failed", "cancelled"]
    created: datetime
    error: dict[str, Any] | None


class RaceDetail(RaceCard):
    """A race, whole."""

    rules: dict[str, Any]
    objects: dict[str, Any]
    vehicle: AskedVehicle
    """Of an old race empty for the one that each model was trained with."""
    randomize: AskedRanges
    seed: int | None
    """None where it is drawn from a secret."""
    commitment: str
    """SHA-256 of the secret and of what was announced, published from the beginning; empty of an old race."""
    secret: str
    """64 hexadecimal digits, once the race is over."""
    is_withheld: bool
    """Whether replays and videos wait for its end, as they would show where it starts."""
    standings: list[Standing]
    undecided: list[Undecided]


class Enter(Message):
    """Enter models."""

    models: list[RunName] = Field(min_length=1, max_length=50)
    checkpoint: CheckpointChoice = "best"
    """Of each of them."""
    ghosts: list[Ghost] = Field(default_factory=list, max_length=MAX_GHOSTS)
    """Cars in each one's film that were not there."""


class ReplayCar(Message):
    """One trial of an entry: x, y, heading every 1/15 s in whole mm and mrad, and the steps that ended its laps."""

    entry: int
    model: str
    trace: list[list[int]]
    laps: list[int]
    objects: list[RoadObject]
    """Boxes and bot cars of its own road, step by step; none where all share one."""


class ReplayGhost(Message):
    """A car that was not there, to be compared with those that were."""

    name: str
    is_lap: bool
    """Whether it is the fastest lap of what is shown, again with every lap of the first car."""
    trace: list[list[int]]
    """x, y, heading every 1/15 s in whole mm and mrad, from the cars' first step on; nothing while it is not there."""


class MissingCar(Message):
    """An entry whose drive cannot be shown: its replay is gone or damaged."""

    entry: int
    model: str


class RaceReplay(Message):
    """The same trial of some entries side by side."""

    trial: int
    """From 0."""
    geometry: TrackGeometry
    is_reversed: bool
    """Whether they drive against the geometry's direction."""
    sectors: list[TrackSector]
    """In driving direction; none where the steps are too coarse to say why one is faster."""
    objects: list[RoadObject]
    """Boxes and bot cars of the road that all share, step by step; none where each drove on its own."""
    cars: list[ReplayCar]
    """At least one."""
    missing: list[MissingCar]
    """That were asked for, too."""
    ghosts: list[ReplayGhost]
