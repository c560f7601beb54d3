"""What browser and server tell each other about searches for better numbers."""

from __future__ import annotations

from datetime import datetime
from typing import Annotated, Literal

from pydantic import Field

from racecraft.serve.schemas import Message, RunName

Finite = Annotated[float, Field(allow_inf_nan=False)]
Number = Annotated[str, Field(min_length=1, max_length=64, pattern=r"^[^\W\d]\w*$")]
Goal = Literal["laps", "lap_time"]


class SearchedNumber(Message):
    """A hyperparameter, or a constant of the reward function, and between which bounds it is searched."""

    name: Number
    low: Finite
    high: Finite


class TunableNumber(SearchedNumber):
    """One that may be searched."""

    kind: Literal["hyperparameter", "constant"]
    is_log: bool
    """Whether factors count, not differences."""
    is_whole: bool
    default: float
    """What the model has, where the search begins."""
    is_usual: bool
    """Whether it is searched when nobody says which."""


class NewTuning(Message):
    """A search; every field has a good default."""

    search: list[SearchedNumber] | None = Field(None, max_length=32)
    goal: Goal = "laps"
    """``laps``: the fewest camera steps until every lap is completed; ``lap_time``: the fastest lap."""
    minutes: float = Field(10.0, gt=0, le=7 * 24 * 60, allow_inf_nan=False)
    trials: int = Field(0, ge=0, le=10_000)
    """At most so many; 0 for as many as the minutes hold."""
    trial_steps: int = Field(40_000, ge=1, le=10**8)
    """Camera steps after which a trial ends."""


class TuningTrial(Message):
    """One trial."""

    number: int
    state: str
    """``running``, ``complete``, ``pruned`` (it lagged behind), ``out of time`` or ``fail``."""
    value: float | None
    """What the search makes small: camera steps or seconds."""
    params: dict[str, float]
    completion: float | None
    best_lap: float | None
    steps: int | None
    error: str
    can_be_kept: bool
    """Whether it has a policy that a model can be made of."""


class TuningCard(Message):
    """A search and what it found so far."""

    id: str
    job: str
    state: Literal["queued", "running", "done", "failed", "cancelled"]
    created: datetime
    started: datetime | None
    finished: datetime | None
    goal: Goal
    minutes: float
    trials_wanted: int
    trial_steps: int
    space: list[TunableNumber]
    trials: list[TuningTrial]
    """In the order they began; the first one is what the model has."""
    best: int | None
    """Number of the best trial."""
    importances: dict[str, float]
    """How much each number mattered, adding up to 1; empty with too few trials."""
    notes: list[str]
    """What was said of the model's files when it began."""
    error: str


class KeepTrial(Message):
    """Make a model of a trial."""

    trial: int | None = Field(None, ge=0, le=10**6)
    """The best one by default."""
    name: RunName | None = None
