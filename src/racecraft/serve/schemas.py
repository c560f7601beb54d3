"""What the console's browser and server tell each other; the OpenAPI, and so the web client's types, come from here.

Units as everywhere: metres, seconds, radians, fractions from 0 to 1. AWS's degrees and percent stay in AWS's files.
"""

from __future__ import annotations

from datetime import datetime
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field

RunName = Annotated[str, Field(min_length=1, max_length=64, pattern=r"^[A-Za-z0-9][A-Za-z0-9._-]*$")]


class Message(BaseModel):
    """Base of all messages: unknown fields are refused."""

    model_config = ConfigDict(extra="forbid")


class Problem(Message):
    """The one shape of every error."""

    code: str
    message: str
    hint: str = ""
    line: int | None = None
    field: str | None = None


class ProblemReply(Message):
    """An error reply."""

    error: Problem


class Console(Message):
    """What this console is."""

    version: str
    runs: str
    cores: int
    user: str


# ---- tracks


class TrackFacts(Message):
    """A track in the gallery."""

    name: str
    title: str
    length: float
    mean_width: float
    min_radius: float | None
    direction: str
    is_closed: bool
    is_own: bool
    corners: int
    outline: list[list[float]]
    """Centre line for a thumbnail, at most 120 points (x, y)."""


class TrackGeometry(Message):
    """Everything to draw a track; three lines of the same number of points (x, y), closed ones without a repeat."""

    name: str
    length: float
    is_closed: bool
    center: list[list[float]]
    inner: list[list[float]]
    outer: list[list[float]]


# ---- actions and rewards


class Action(Message):
    """One discrete action; AWS's units, as racers know them."""

    steering_angle: float
    speed: float


class ActionPreset(Message):
    """A named action space."""

    name: str
    description: str
    kind: Literal["discrete", "continuous"]
    actions: list[Action]
    steering_angle: list[float] | None = None
    speed: list[float] | None = None


class RewardPreset(Message):
    """A reward function that ships with Racecraft."""

    name: str
    description: str
    source: str


class Param(Message):
    """One key of params, for completion and help."""

    name: str
    type: str
    unit: str
    description: str


class RewardCheck(Message):
    """Check a reward function and paint it along a track."""

    source: str = Field(max_length=140_000)
    track: str = Field(max_length=200)
    run: RunName | None = None
    """Of a model whose last laps are to be paid anew."""


class RewardProblem(Message):
    """A mistake in a reward function, with its place."""

    line: int
    column: int
    severity: str
    message: str
    hint: str


class RewardSituation(Message):
    """What the function pays in a situation."""

    name: str
    description: str
    reward: float | None
    error: str | None
    printed: str


class RewardPainting(Message):
    """What the function pays along a track: at places on a grid along and across, driving ahead at a usual speed."""

    places: list[float]
    """Metres along the centre line  (P,)."""
    offsets: list[float]
    """Share of half the width, left positive  (O,)."""
    points: list[list[list[float]]]
    """x, y of each  (P, O, 2)."""
    rewards: list[list[float | None]]
    """(P, O)"""


class RewardLap(Message):
    """A lap that was driven, and what the function would have paid for every step of it."""

    number: int
    status: str
    points: list[list[float]]
    rewards: list[float | None]


class RewardVerdict(Message):
    """What is known about a reward function in under a second."""

    ok: bool
    problems: list[RewardProblem]
    situations: list[RewardSituation]
    painting: RewardPainting | None
    laps: list[RewardLap] = []
    """Of the model that was asked for, where it was evaluated on this track."""


# ---- models


class Tuning(Message):
    """Racecraft's own way of learning, turned a little; by AWS's names, within wider ranges."""

    lr: float | None = Field(None, ge=1e-6, le=1e-2)
    beta_entropy: float | None = Field(None, ge=0, le=1)
    discount_factor: float | None = Field(None, ge=0.5, le=0.9999)
    num_epochs: int | None = Field(None, ge=1, le=20)
    batch_size: int | None = Field(None, ge=16, le=512)
    loss_type: Literal["huber", "mean squared error"] | None = None


class NewModel(Message):
    """Everything about a new model; every field has a good default."""

    name: RunName | None = None
    track: str = Field("reinvent_2018", max_length=200)
    direction: Literal["forward", "reverse", "alternate"] = "forward"
    reward: str = Field("racing", max_length=140_000)
    """Name of a preset, or the source of a reward function."""
    actions: str = "default"
    """Name of a preset."""
    model_metadata: dict[str, Any] | None = None
    """AWS's document; replaces actions."""
    hyperparameters: dict[str, Any] | None = None
    """AWS's document; Racecraft's own settings otherwise."""
    tuning: Tuning | None = None
    """Without hyperparameters: what is to differ from Racecraft's own settings."""
    sensors: list[Annotated[str, Field(max_length=40)]] | None = Field(None, max_length=4)
    """AWS's names; the front camera otherwise. Not beside model_metadata, which says it itself."""
    race: str = Field("time-trial", max_length=40)
    """``time-trial``, ``object-avoidance`` or ``head-to-bot``."""
    objects: int | None = Field(None, ge=1, le=32)
    """How many boxes or bot cars; 6 and 3 otherwise."""
    bot_speed: float | None = Field(None, ge=0, le=4)
    lane_changes: bool = False
    randomize: str = Field("none", max_length=40)
    """A preset of what differs from episode to episode."""
    algorithm: str = Field("", max_length=40)
    """``ppo`` or ``sac``, which needs a continuous action space; by default the metadata's."""
    critic: str = Field("privileged", max_length=40)
    """What the critic sees while training: ``privileged`` state, that and the ``lap``'s place, or the ``camera``."""
    network: str = ""
    vehicle: str = ""
    seed: int = Field(0, ge=0, le=2**32 - 1)
    until: str = Field("5 laps", max_length=200)
    tags: list[Annotated[str, Field(min_length=1, max_length=40)]] = Field(default_factory=list, max_length=20)
    train: bool = True
    """Start training at once."""


class ModelCard(Message):
    """A model in the garage."""

    name: str
    track: str
    created: datetime
    status: Literal["training", "queued", "stopped", "finished", "failed", "new"]
    tags: list[str]
    steps: int
    seconds: float
    completion: float | None
    """Of the best checkpoint's evaluation."""
    best_lap: float | None
    evaluations: int
    """Races by the rules, not those during training."""
    picture: str | None
    """Address of its racing line."""
    until: str


class ImportedModel(Message):
    """A model made from files of others, and what became of them."""

    model: ModelCard
    kind: str
    """What was imported."""
    used: dict[str, str]
    """Files and settings that were understood, and what each became."""
    unused: dict[str, str]
    """Files and settings that have no effect, and why."""
    unknown: dict[str, str]
    """Settings that nobody knows, and a suggestion."""
    notes: list[str]


class ModelDetail(ModelCard):
    """A model, whole."""

    reward: str
    model_metadata: dict[str, Any]
    hyperparameters: dict[str, Any] | None
    settings: dict[str, Any]
    seed: int
    checkpoints: list[Checkpoint]
    job: JobInfo | None


class Checkpoint(Message):
    """A saved state of a policy."""

    step: int
    is_best: bool
    completion: float | None
    best_lap: float | None


class ModelChange(Message):
    """Rename or tag a model."""

    name: RunName | None = None
    tags: list[Annotated[str, Field(min_length=1, max_length=40)]] | None = Field(None, max_length=20)


class CloneModel(Message):
    """A copy of a model's settings under another name."""

    name: RunName | None = None


class TrainOn(Message):
    """Train, or go on training."""

    until: str | None = Field(None, max_length=200)
    reward: str | None = Field(None, max_length=140_000)
    """A changed reward function, from here on."""


class HistoryPage(Message):
    """Points of a training's curves, and the offset that the next page or the live stream begins at."""

    points: list[dict[str, Any]]
    offset: int


# ---- evaluations


class EvaluateModel(Message):
    """Race a model against the clock."""

    track: str | None = Field(None, max_length=200)
    laps: int = Field(3, ge=1, le=100)
    num_trials: int = Field(5, ge=1, le=100)
    rules: str = "drfc"
    checkpoint: str | int = "best"
    seed: int = Field(0, ge=0, le=2**32 - 1)


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


class Telemetry(Message):
    """Every step of an evaluation's best trial, as columns."""

    columns: dict[str, list[float | int | str]]


# ---- jobs


class JobInfo(Message):
    """A job."""

    id: str
    kind: str
    run: str
    state: Literal["queued", "running", "done", "failed", "cancelled"]
    attempts: int
    created: datetime
    started: datetime | None
    finished: datetime | None
    result: dict[str, Any] | None
    error: dict[str, Any] | None


ModelDetail.model_rebuild()
