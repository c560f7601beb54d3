"""What browser and server tell each other about sweeps."""

from __future__ import annotations

from typing import Any, Literal

from pydantic import Field

from racecraft.serve.schemas import Message, RunName

MAX_TEXT = 20_000


class NewSweep(Message):
    """A sweep."""

    name: RunName
    text: str = Field(max_length=MAX_TEXT)
    """TOML, as `racecraft sweep` reads it; a reward is a preset's name or a model's, whose reward it then is."""


class SweepFigure(Message):
    """A mean over the seeds that came so far, with the interval that holds the true mean with 95 %."""

    mean: float | None
    low: float | None
    high: float | None
    count: int


class SweepPlace(Message):
    """A setting on the leaderboard."""

    place: int
    setting: str
    words: dict[str, Any]
    seeds: int
    laps_after: SweepFigure
    """Camera steps after which all cars of an evaluation came round."""
    best_lap: SweepFigure
    is_tied: bool
    """Whether the difference to the first place could be chance."""


class SweepRun(Message):
    """One of its trainings."""

    model: str
    setting: str
    seed: int
    state: Literal["waiting", "queued", "running", "done", "stopped", "failed"]
    machine: str
    """Where it runs or ran, where there are several."""


class SweepCard(Message):
    """A sweep among others."""

    name: str
    goal: Literal["laps", "lap_time"]
    settings: int
    seeds: int
    done: int
    """Trainings that have ended."""
    under_way: int
    """Those that run or wait for their turn."""


class SweepDetail(SweepCard):
    """A sweep, whole."""

    places: list[SweepPlace]
    runs: list[SweepRun]
    notes: list[str]
    """What was said of files and parents when it was made."""
