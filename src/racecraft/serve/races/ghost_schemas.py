"""What browser and server tell each other about ghosts: cars in a film that were not there."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from racecraft.serve.schemas import Message, RunName

CheckpointChoice = Literal["best", "last"] | Annotated[int, Field(ge=0, le=10**12)]
"""Of a model; a number is that of the camera steps of training behind it."""


class Starter(Message):
    """A model at the start; the same one may stand there twice."""

    model: RunName
    checkpoint: CheckpointChoice = "best"


class Evaluated(Message):
    """The best trial of an evaluation that a model drove before, on the same road."""

    model: RunName
    evaluation: str = Field(max_length=40)
    """When it began, as its folder says: YYYYmmddHHMMSS."""


class EarlierHeat(Message):
    """The best car of a heat that was driven before, on the same road."""

    heat: str = Field(max_length=40)


Ghost = Starter | Evaluated | EarlierHeat | Literal["best-lap"]
"""A model that drives the same race alone, an evaluation's best trial, a car of an earlier heat, or the fastest lap of
this one, lap after lap."""


class EvaluatedCard(Evaluated):
    """An evaluation that may be a ghost."""

    best_lap: float | None
    """s; None where it completed no lap."""
