"""What browser and server tell each other about heats and ladders."""

from __future__ import annotations

from datetime import datetime
from typing import Annotated, Literal

from pydantic import Field

from racecraft.contest.terms import MAX_GRID
from racecraft.serve.races.schemas import RaceKind, Seconds
from racecraft.serve.schemas import Message, RunName

Title = Annotated[str, Field(max_length=100)]
Vehicle = Literal["v4", "v5", "v6"]
Objects = Literal["none", "boxes", "bots"]


class Starter(Message):
    """A model at the start; the same one may stand there twice."""

    model: RunName
    checkpoint: Literal["best", "last"] = "best"


class NewHeat(Message):
    """A race of two to eight models on one road, who see and hit each other."""

    models: list[Starter] = Field(min_length=2, max_length=MAX_GRID)
    """In the order of the grid."""
    title: Title = ""
    track: str = Field("reinvent_2018", max_length=200)
    direction: Literal["forward", "reverse"] = "forward"
    laps: int = Field(1, ge=1, le=20)
    objects: Objects = "none"
    """What else is on the road."""
    count: int = Field(3, ge=1, le=20)
    """How many boxes or bot cars."""
    offtrack_penalty: Seconds = 5.0
    collision_penalty: Seconds = 5.0
    max_resets: int = Field(100, ge=0, le=10_000)
    vehicle: Vehicle = "v5"
    """Everybody's, whatever they were trained with."""
    seed: int | None = Field(None, ge=0, le=2**32 - 1)
    """Of the start and the objects; by default drawn."""


class NewLadder(Message):
    """Many races between models, two at a time, and what they say about each model's strength."""

    models: list[Starter] = Field(min_length=2, max_length=20)
    title: Title = ""
    kind: RaceKind | Literal["head-to-model"] = "head-to-model"
    tracks: list[Annotated[str, Field(max_length=200)]] = Field(min_length=1, max_length=10)
    schedule: Literal["round-robin", "swiss"] = "round-robin"
    """Everyone meets everyone at every start, or each meets one of about the same strength in each round."""
    starts: int = Field(4, ge=1, le=20)
    """On each track."""
    laps: int = Field(1, ge=1, le=10)
    vehicle: Vehicle = "v5"
    seed: int | None = Field(None, ge=0, le=2**32 - 1)


class HeatRow(Message):
    """A car that has arrived, or not."""

    place: int | None
    name: str
    car: int
    """On the grid, from 0."""
    score: float | None
    """s for all laps; None for one that did not complete them."""
    gap: float | None
    """s behind the first."""
    best: float | None
    """s of its fastest lap."""
    laps: int
    off_tracks: int
    crashes: int
    resets: int
    penalty: float
    """s"""


class LadderPlace(Message):
    """A model in the table."""

    place: int
    name: str
    rating: float
    """What its strength is believed to be; a model that has not raced has 25."""
    deviation: float
    """Its uncertainty: one standard deviation."""
    wins: int
    draws: int
    losses: int


class LadderMatch(Message):
    """Two models compared."""

    number: int
    track: str
    start: int
    models: list[str]
    places: list[int]
    seconds: list[float | None]


class ContestCard(Message):
    """A heat or a ladder."""

    id: str
    is_ladder: bool
    kind: str
    """``head-to-model``, ``grid``, or what a ladder compares by."""
    title: str
    tracks: list[str]
    models: list[str]
    state: Literal["queued", "running", "done", "failed", "cancelled"]
    created: datetime
    winner: str | None
    driven: int
    """Races of a ladder that are decided."""
    error: str


class ContestDetail(ContestCard):
    """The same, whole."""

    laps: int
    vehicle: str
    seed: int
    direction: str
    schedule: str
    """Of a ladder."""
    starts: int
    """Of a ladder, on each track."""
    heat: list[HeatRow]
    ladder: list[LadderPlace]
    matches: list[LadderMatch]
    has_video: bool
