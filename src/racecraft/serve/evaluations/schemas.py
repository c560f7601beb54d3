"""Messages about what a run's files say: laps, corners, maps, saliency, and the choices of the page for a new model."""

from __future__ import annotations

from typing import Any, Literal

from pydantic import Field

from racecraft.serve.conditions import AskedRanges, AskedVehicle
from racecraft.serve.road import OnRoad, Seconds
from racecraft.serve.schemas import Message
from racecraft.serve.tracks.schemas import TrackSector
from racecraft.sim.objects import MAX_OBJECTS

# ---- races against the clock


class EvaluateModel(OnRoad):
    """Race a model against the clock."""

    track: str | None = Field(None, max_length=200)
    laps: int = Field(3, ge=1, le=100)
    num_trials: int = Field(5, ge=1, le=100)
    rules: str = "drfc"
    checkpoint: str | int = "best"
    seed: int = Field(0, ge=0, le=2**32 - 1)
    as_car: bool = False
    """Drive the exported file through a physical car's own steps."""
    direction: Literal["forward", "reverse"] | None = None
    """By default as it was trained."""
    vehicle: AskedVehicle | None = None
    """By default the one that it was trained with."""
    randomize: AskedRanges = "none"
    """What differs from what the model knows."""
    offtrack_penalty: Seconds | None = None
    """By default the rules', as the two that follow."""
    collision_penalty: Seconds | None = None
    max_resets: int | None = Field(None, ge=0, le=10_000)
    race: Literal["time-trial", "object-avoidance", "head-to-bot"] | None = None
    """What is on the road; by default what the model was trained among."""
    objects: int | None = Field(None, ge=1, le=MAX_OBJECTS)
    """Boxes or bot cars; by default as many as the race has."""


class EvaluationTerms(Message):
    """All that an evaluation was driven under, besides its road."""

    rules: dict[str, Any]
    objects: dict[str, Any]
    vehicle: AskedVehicle
    randomize: AskedRanges
    seed: int


class EvaluationCard(Message):
    """One evaluation's result."""

    stamp: str
    track: str
    summary: dict[str, Any]
    laps: list[dict[str, Any]]
    """AWS's metrics, a lap each."""
    picture: str | None
    video: str | None
    telemetry: str | None
    as_car: bool
    """Whether it was driven as a physical car drives."""
    held: EvaluationTerms | None
    """None of one from before that was written down."""
    commands: str | None
    """If it was driven as a car: a picture: what was commanded, against what became of it."""


class Telemetry(Message):
    """Every step of an evaluation's best trial, as columns."""

    columns: dict[str, list[float | int | str]]


# ---- laps


class LapTrace(Message):
    """One lap of an evaluation; all lists have one entry a control step."""

    number: int
    status: str
    is_complete: bool
    seconds: float
    penalty_seconds: float
    start: float
    """Place along the centre line that `share` counts from, metres."""
    time: list[float]
    share: list[float]
    x: list[float]
    y: list[float]
    heading: list[float]
    speed: list[float]
    """Driven."""
    throttle: list[float]
    """Asked for."""
    steering: list[float]
    """Asked for, radians, left positive."""
    puts: list[int]
    """Steps in which it stands where it was put after a mistake."""
    reward: list[float | None]
    """What the reward function of its training pays for every step; null where it is not asked, see `RewardOfLaps`."""
    objects: list[RoadObject]
    """Boxes and other cars, as far as the replay beside the trace says."""
    passages: list[LapPassage | None]
    """Through every sector; null where it did not get through."""


class RoadObject(Message):
    """Something on the road: lists have one entry where it stands, else one a control step."""

    kind: str
    """``box``, ``parked_car``, ``bot_car`` or another car of the race."""
    x: list[float]
    y: list[float]
    heading: list[float]


class LapPassage(Message):
    """A lap through a sector."""

    seconds: float
    entry_speed: float
    slowest: float
    exit_speed: float


class RewardOfLaps(Message):
    """Whose rewards an evaluation's laps have."""

    stretch: int
    """Of the training, whose function was asked."""
    stretches: int
    """How many there are."""
    is_afresh: bool
    """The function remembers what happened before, and was called without the training's memory."""
    error: str | None
    """Why there are none."""


class EvaluationLaps(Message):
    """All laps of an evaluation."""

    reward: RewardOfLaps

    track: str
    length: float
    is_reversed: bool
    sectors: list[TrackSector]
    laps: list[LapTrace]


# ---- maps and saliency


class TrainingMaps(Message):
    """What a training did where, on a grid of P places along and O across the track; null where no car was."""

    iterations: list[int]
    """All that there are."""
    shown: list[int]
    episodes: int
    rows: int
    grid: list[list[list[float]]]
    """Corners of the cells  (P + 1, O + 1, 2)."""
    visits: list[list[int]]
    reward: list[list[float | None]]
    speed: list[list[float | None]]
    steering: list[list[float | None]]
    action: list[list[int]]
    """Taken most, or -1."""
    usage: list[float]
    """Share of every action."""
    exits: list[list[float]]


class SaliencyPicture(Message):
    """What a policy looked at in one moment."""

    method: Literal["Grad-CAM"]
    layer: str
    step: int
    """Of the checkpoint that was asked."""
    height: int
    width: int
    frame: str
    """The camera's image, grey, a byte a pixel, base64."""
    saliency: str
    """0 to 255 a pixel, base64."""
    policy: list[float]
    """Probabilities of actions, or mean steering and speed from -1 to 1."""
    target: int
    is_discrete: bool


class RoadBelief(Message):
    """What perception believes of one picture; lengths and angles are the lens's, as in `racecraft perceive --json`."""

    on_road: bool
    offset_m: float
    """Left of the road's middle positive."""
    offset_error_m: float
    """As all errors the mean distance to the truth that is expected."""
    heading_rad: float
    heading_error_rad: float
    heading_ahead_rad: float
    """Against where the road leads over the next 40 cm."""
    heading_ahead_error_rad: float
    middle: list[float | None]
    middle_error: list[float | None]
    half_width_m: float
    curvature_per_m: dict[str, float]
    distance_m: float | None
    """To what is in the way; null where nothing is."""
    distance_between_m: list[float] | None
    line_rows: list[int]
    """Rows of the picture in which the road's middle is seen."""
    line_columns: list[float]
    line_error: list[float]
    regions: list[list[float]]
    """Probability of road at `region_rows` and `region_columns`."""
    region_rows: list[int]
    region_columns: list[int]
    height: int
    width: int
    frame: str
    """The camera's image, grey, a byte a pixel, base64."""


LapTrace.model_rebuild()
