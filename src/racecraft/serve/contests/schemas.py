"""What browser and server tell each other about heats and ladders."""

from __future__ import annotations

from datetime import datetime
from typing import Annotated, Any, Literal

from pydantic import Field

from racecraft.contest.terms import MAX_GRID
from racecraft.film.ghost import MAX_GHOSTS
from racecraft.serve.conditions import AskedRanges, AskedVehicle
from racecraft.serve.naming import PLAIN
from racecraft.serve.races.ghost_schemas import Ghost, Starter
from racecraft.serve.races.schemas import RaceKind, RaceSettings, RankedSettings, Ranking
from racecraft.serve.schemas import Message
from racecraft.sim.objects import MAX_OBJECTS

Title = Annotated[str, Field(max_length=100), PLAIN]
Among = Literal["none", "boxes", "bots"]


class NewHeat(RankedSettings):
    """A race of two to eight models on one road, who see and hit each other."""

    models: list[Starter] = Field(min_length=2, max_length=MAX_GRID)
    """In the order of the grid."""
    title: Title = ""
    track: str = Field("reinvent_2018", max_length=200)
    laps: int = Field(1, ge=1, le=20)
    objects: Among = "none"
    """What else is on the road."""
    count: int = Field(3, ge=1, le=MAX_OBJECTS)
    """How many boxes or bot cars."""
    secret: bool = False
    """Draw the starts and objects from a secret instead of a seed; its commitment is told first."""
    ghosts: list[Ghost] = Field(default_factory=list, max_length=MAX_GHOSTS)
    """Cars in the film that were not there."""


class NewLadder(RaceSettings):
    """Many races between models, two at a time, and what they say about each model's strength."""

    models: list[Starter] = Field(min_length=2, max_length=20)
    title: Title = ""
    kind: RaceKind | Literal["head-to-model"] = "head-to-model"
    tracks: list[Annotated[str, Field(max_length=200)]] = Field(min_length=1, max_length=100)
    """Each by its name, ``library``, ``generated:0..9`` with the generator's options, or ``all``."""
    schedule: Literal["round-robin", "swiss"] = "round-robin"
    """Everyone meets everyone at every start, or each meets one of about the same strength in each round."""
    starts: int = Field(4, ge=1, le=100)
    """On each track."""
    rounds: int = Field(0, ge=0, le=200)
    """Of ``swiss``; 0 for one for every start, and as many as find the best."""
    laps: int = Field(1, ge=1, le=20)
    time_limit: float | None = Field(180.0, ge=0.0, le=86_400.0, allow_inf_nan=False)
    """s on the clock that end a race; 0 for none."""
    objects: Among | None = None
    """What else is on the road that two share; the other kinds have their own."""
    count: int | None = Field(None, ge=1, le=MAX_OBJECTS)
    """How many boxes or bot cars; 6 and 3 otherwise."""


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
    """As they were asked for."""
    is_road_as_it_was: bool
    """Of a heat: whether its track has not been drawn anew since, as far as that is known."""
    direction: str
    """In which they are driven."""
    models: list[str]
    """With the checkpoint where it is not the best: ``heron@last``."""
    state: Literal["queued", "running", "done", "failed", "cancelled"]
    created: datetime
    winner: str | None
    driven: int
    """Races of a ladder that are decided."""
    planned: int
    """Races that a ladder has; 0 of a heat, and where it is not known."""
    error: str


class ContestDetail(ContestCard):
    """The same, whole."""

    laps: int
    rules: dict[str, Any]
    """All that it is held by."""
    objects: dict[str, Any]
    """What stands or drives on the road besides the models."""
    vehicle: AskedVehicle
    randomize: AskedRanges
    seed: int | None
    """None where it is drawn from a secret."""
    commitment: str
    """SHA-256 of the secret and of what the heat is held by, told from the beginning; empty where there is none."""
    secret: str
    """64 hexadecimal digits, told when the heat is over; empty until then, and where there is none."""
    ghosts: list[Ghost]
    """Of a heat's film."""
    ranking: Ranking
    """Of a heat: what places go by."""
    minimum_laps: int
    """Of a heat: that a car must have for a score."""
    schedule: str
    """Of a ladder."""
    starts: int
    """Of a ladder, on each track."""
    rounds: int
    """Of a Swiss ladder; 0 for as many as there need be."""
    heat: list[HeatRow]
    ladder: list[LadderPlace]
    matches: list[LadderMatch]
    has_video: bool
