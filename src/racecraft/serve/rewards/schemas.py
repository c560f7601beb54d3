"""Messages about reward functions and the actions they pay for."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from racecraft.serve.schemas import Message, RunName


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


class PresetPictures(Message):
    """What the rewards that ship with Racecraft pay along one small track."""

    points: list[list[list[float]]]
    """(P, O, 2)"""
    rewards: dict[str, list[list[float]]]
    """By preset  (P, O)."""


class RewardCheck(Message):
    """Check a reward function and paint it along a track."""

    source: str = Field(max_length=140_000)
    track: str = Field(max_length=200)
    more_tracks: list[Annotated[str, Field(max_length=200)]] = Field(default_factory=list, max_length=200)
    """That are learned on, too, as of a new model: it is tried on each."""
    run: RunName | None = None
    """Of a model whose last laps are to be paid anew."""
    of: RunName | None = None
    """Of a model that is to learn from it: it is tried among the objects and cars that the model trains with."""
    race: str = Field("time-trial", max_length=40)
    """Without such a model, the race that it is to learn for; as of a new model, like the two that follow."""
    objects: int | None = Field(None, ge=1, le=32)
    cars: int | None = Field(None, ge=2, le=8)


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
    """What the function pays along a track: on a grid along and across, driving ahead at a usual speed."""

    places: list[float]
    """Metres along the centre line  (P,)."""
    offsets: list[float]
    """Share of half the width, left positive  (O,)."""
    points: list[list[list[float]]]
    """x, y of each  (P, O, 2)."""
    rewards: list[list[float | None]]
    """(P, O)"""
    objects: list[list[float]]
    """x, y of the boxes and other cars, which stand where an episode has them at its beginning  (K, 2)."""


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
    laps: list[RewardLap] = Field(default=[])
    """Of the model that was asked for, where it was evaluated on this track."""
