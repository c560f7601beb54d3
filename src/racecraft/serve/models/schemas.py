"""Messages about models."""

from __future__ import annotations

from datetime import datetime
from typing import Annotated, Any, Literal

from pydantic import Field

from racecraft.serve.conditions import AskedRanges, AskedVehicle
from racecraft.serve.evaluations.schemas import RoadObject
from racecraft.serve.jobs.schemas import JobInfo
from racecraft.serve.road import OnRoad
from racecraft.serve.schemas import Message, RunName
from racecraft.serve.tracks.schemas import TrackGeometry
from racecraft.training.regimes import TIME_TRIAL
from racecraft.training.settings import DEFAULT_TRACK


class Tuning(Message):
    """Racecraft's own way of learning, turned a little; by AWS's names, within wider ranges."""

    lr: float | None = Field(None, ge=1e-6, le=1e-2)
    beta_entropy: float | None = Field(None, ge=0, le=1)
    discount_factor: float | None = Field(None, ge=0.5, le=0.9999)
    num_epochs: int | None = Field(None, ge=1, le=20)
    batch_size: int | None = Field(None, ge=16, le=512)
    loss_type: Literal["huber", "mean squared error"] | None = None


class NewModel(OnRoad):
    """Everything about a new model; every field has a good default."""

    name: RunName | None = None
    track: str = Field(DEFAULT_TRACK, max_length=200)
    more_tracks: list[Annotated[str, Field(max_length=200)]] = Field(default_factory=list, max_length=200)
    """On which it learns at the same time."""
    direction: Literal["forward", "reverse", "alternate"] = "forward"
    reward: str = Field(TIME_TRIAL.reward, max_length=140_000)
    """Name of a preset, or the source of a reward function."""
    actions: str = TIME_TRIAL.actions
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
    """``time-trial``, ``object-avoidance``, ``head-to-bot`` or ``head-to-head``."""
    opponents: list[RunName] = Field(default_factory=list, max_length=7)
    """Models that drive the other cars of a head-to-head race; by default the policy as it is and as it was."""
    cars: int | None = Field(None, ge=2, le=8)
    """To a head-to-head race, the learner's included; 2 otherwise."""
    objects: int | None = Field(None, ge=1, le=32)
    """How many boxes or bot cars; 6 and 3 otherwise."""
    randomize: AskedRanges = "none"
    """What differs from episode to episode: a preset, or ranges by their quantity."""
    algorithm: str = Field("", max_length=40)
    """``ppo`` or ``sac``, which needs a continuous action space; by default the metadata's."""
    critic: str = Field(TIME_TRIAL.critic, max_length=40)
    """What the critic sees while training: ``privileged`` state, that and the ``lap``'s place, or the ``camera``."""
    network: str = ""
    vehicle: AskedVehicle = ""
    """``v4``, ``v5``, ``v6`` or parameters of one's own; those left out are v5's."""
    seed: int = Field(0, ge=0, le=2**32 - 1)
    until: str = Field(TIME_TRIAL.until, max_length=200)
    tags: list[Annotated[str, Field(min_length=1, max_length=40)]] = Field(default_factory=list, max_length=20)
    train: bool = True
    """Start training at once."""


class MedalTimes(Message):
    """Lap times to reach on a road in a car, s."""

    author: float
    """What our line driver really drives."""
    gold: float
    silver: float
    bronze: float


class ModelCard(Message):
    """A model in the garage."""

    name: str
    track: str
    """The first that it learns on."""
    num_tracks: int
    race: str
    """``time-trial``, ``object-avoidance``, ``head-to-bot`` or ``head-to-head``."""
    created: datetime
    status: Literal["training", "queued", "stopped", "finished", "failed", "new"]
    tags: list[str]
    steps: int
    seconds: float
    completion: float | None
    """Of the best checkpoint's evaluation."""
    best_lap: float | None
    """s; the fastest whole lap with its penalties of all evaluations on its track, in training and afterwards."""
    medals: MedalTimes | None
    """On its track in its car and direction, where they are known; of one that learns on several, none."""
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


class ExportNotes(Message):
    """What a model would be as the archive of a physical car."""

    step: int
    """Camera steps of training behind it."""
    network: str
    notes: list[str]
    """Sentences on what a car does otherwise than the simulator."""


class Demonstration(Message):
    """A lap of a model's best checkpoint among what it met while it learned, driven to be looked at."""

    step: int
    """Of the checkpoint."""
    seconds: float | None
    """Of the lap, where it was completed."""
    poses: list[list[int]]
    """X, y [mm], heading [mrad], speed [mm/s], steering [mrad] and share of the lap [1/1000], every 1/15 s."""
    objects: list[RoadObject]
    """Boxes and other cars of its road, step by step."""
    road: int
    """Number of the track, from 0."""
    roads: list[str]
    """All the tracks that it learned on."""
    geometry: TrackGeometry


class EvolutionLap(Message):
    """A lap that a model drove while it learned, or the attempt at one, from the same start as all others."""

    step: int
    """Camera steps of training before it."""
    stretch: int
    """Number of the part of the training that it comes from."""
    seconds: float | None
    """Of a whole lap."""
    completion: float
    """Share of the lap driven."""
    poses: list[list[int]]
    """X, y [mm] and heading [mrad] every 1/15 s."""


class Evolution(Message):
    """How a model came to drive as it does."""

    laps: list[EvolutionLap]
    """Those that beat all before them, in the order trained, and the best checkpoint's last."""
    film: str | None
    """Address of the film, where one was made."""


class Checkpoint(Message):
    """A saved state of a policy."""

    step: int
    stretch: int
    """Number of the part of the training that it comes from."""
    is_best: bool
    completion: float | None
    best_lap: float | None


class TrainingStretch(Message):
    """A part of a training in which nothing was changed."""

    number: int
    """From 1."""
    step: int
    """Camera steps of training before it."""
    began: datetime
    changes: list[str]
    """Against the one before: ``reward``, ``actions``, ``model_metadata``, ``hyperparameters``, ``track``, ``vehicle``,
    ``settings``."""
    reward: str
    """Source of the reward function."""
    settings: dict[str, Any]
    """Track, vehicle, actions, hyperparameters and everything else."""
    best_lap: float | None
    """s, of its own evaluations, in training and afterwards."""
    completion: float | None
    """Of the best of them."""
    evaluations: int
    """How many that are."""


class ModelDetail(ModelCard):
    """A model, whole."""

    reward: str
    model_metadata: dict[str, Any]
    hyperparameters: dict[str, Any] | None
    settings: dict[str, Any]
    seed: int
    checkpoints: list[Checkpoint]
    stretches: list[TrainingStretch]
    """In the order trained; one at least. A step belongs to the last one that began before it."""
    job: JobInfo | None
    notes: str
    """What its people wrote about it, plain text."""


class ModelChange(Message):
    """Rename or tag a model, or write about it."""

    name: RunName | None = None
    tags: list[Annotated[str, Field(min_length=1, max_length=40)]] | None = Field(None, max_length=20)
    notes: str | None = Field(None, max_length=20_000)


class CloneModel(Message):
    """A copy of a model's settings under another name."""

    name: RunName | None = None
    step: int | None = Field(None, ge=0)
    """Of a checkpoint: the copy begins with its weights, and with what its stretch of training learned with."""


class TrainOn(Message):
    """Train, or go on training."""

    until: str | None = Field(None, max_length=200)
    reward: str | None = Field(None, max_length=140_000)
    """A changed reward function, from here on."""


class HistoryPage(Message):
    """Points of a training's curves, and the offset that the next page or the live stream begins at."""

    points: list[dict[str, Any]]
    offset: int


class NumberChoice(Message):
    """A number that can be set."""

    name: str
    default: float
    low: float
    high: float
    safe_low: float
    """Values that people do well with."""
    safe_high: float
    is_whole: bool
    is_logarithmic: bool
    """Steps feel even when each is the same factor."""
    allowed: list[float] | None = None
    """Where only some values are."""


class Choices(Message):
    """All that a new model can be made of; what is refused by this version is left out."""

    networks: list[str]
    vehicles: list[str]
    sensors: list[str]
    algorithms: list[str]
    races: list[str]
    critics: list[str]
    randomizations: list[str]
    cars: dict[str, dict[str, float]]
    """Parameters of each of the vehicles."""
    ranges: dict[str, dict[str, tuple[float, float]]]
    """Every quantity's range, of each of the randomizations."""
    hyperparameters: list[NumberChoice]
    aws: dict[str, Any]
    """AWS's hyperparameters by default."""
    fast: dict[str, Any]
    """Racecraft's own, by the same names."""
    paces: dict[str, float]
    """Camera steps a second that this machine trains, by type of race, from the latest training of each."""
