"""What browser and server tell each other about races."""

from __future__ import annotations

from datetime import datetime
from typing import Annotated, Any, Literal

from pydantic import AwareDatetime, Field

from racecraft.serve.schemas import Message, RunName
from racecraft.serve.tracks.schemas import TrackGeometry

RaceKind = Literal["time-trial", "object-avoidance", "head-to-bot"]
Ranking = Literal["total", "best", "average"]
RaceState = Literal["upcoming", "open", "closed"]
Title = Annotated[str, Field(min_length=1, max_length=100, pattern=r"\S")]
Seconds = Annotated[float, Field(ge=0.0, le=600.0, allow_inf_nan=False)]


class NewRace(Message):
    """A race; but for the title every field has a good default."""

    title: Title
    description: str = Field("", max_length=500)
    kind: RaceKind = "time-trial"
    track: str = Field("reinvent_2018", max_length=200)
    direction: Literal["forward", "reverse"] = "forward"
    laps: int = Field(3, ge=1, le=20)
    ranking: Ranking = "total"
    minimum_laps: int = Field(1, ge=1, le=20)
    """Laps in a row that an average is taken over, and that have to be completed."""
    offtrack_penalty: Seconds = 5.0
    collision_penalty: Seconds = 5.0
    max_resets: int = Field(100, ge=0, le=10_000)
    objects: int = Field(6, ge=1, le=20)
    """Boxes or bot cars, where the kind has them."""
    bot_speed: float = Field(0.2, ge=0.0, le=4.0, allow_inf_nan=False)
    """m/s"""
    vehicle: Literal["", "v4", "v5", "v6"] = ""
    seed: int = Field(0, ge=0, le=2**32 - 1)
    opens: AwareDatetime | None = None
    """By default now."""
    closes: AwareDatetime | None = None


class RaceChange(Message):
    """What may change while a race is on."""

    title: Title | None = None
    description: str | None = Field(None, max_length=500)
    closes: AwareDatetime | None = None


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
    lap_times: list[float]
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
    """Path below the model's files."""
    picture: str | None
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
    vehicle: str
    seed: int
    standings: list[Standing]
    undecided: list[Undecided]


class Enter(Message):
    """Enter models."""

    models: list[RunName] = Field(min_length=1, max_length=50)
    checkpoint: Literal["best", "last"] = "best"


class ReplayCar(Message):
    """A car of a race: x, y, heading every 1/15 s in whole mm and mrad, and the steps that ended its laps."""

    entry: int
    model: str
    trace: list[list[int]]
    laps: list[int]


class RaceReplay(Message):
    """Some entries of a race side by side."""

    geometry: TrackGeometry
    cars: list[ReplayCar]
