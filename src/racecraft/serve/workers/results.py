"""What a worker may say came of a job: what pages compute with is of the type that they compute with."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Final, Self

from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from racecraft.contest.terms import MAX_GRID
from racecraft.errors import RunError
from racecraft.serve.contests.schemas import HeatRow, LadderMatch, LadderPlace

Number = Annotated[float, Field(ge=0.0, le=1e15)]


class _Told(BaseModel):
    """What else is told is for whoever reads it."""

    model_config = ConfigDict(strict=True, extra="ignore")


class _Trained(_Told):
    reason: str | None = None
    steps: Number | None = None


class _Raced(_Told):
    lap_seconds: list[list[Number]] | None = None
    mean_completion: Number | None = None
    resets: Number | None = None
    off_track_count: Number | None = None
    crash_count: Number | None = None
    penalty_seconds: Number | None = None


class _Arrived(HeatRow):
    car: int = Field(ge=0, lt=MAX_GRID)


class _Heat(_Told):
    heat: list[_Arrived] = Field(min_length=1, max_length=MAX_GRID)


class _Match(LadderMatch):
    number: int = 0

    @model_validator(mode="after")
    def _check_places(self) -> Self:
        if len(self.places) != len(self.models):
            raise ValueError("a place for each model")
        return self


class _Ladder(_Told):
    ladder: list[LadderPlace]
    matches: list[_Match]


RESULTS: Final[Mapping[str, type[_Told]]] = {"train": _Trained, "race": _Raced, "heat": _Heat, "ladder": _Ladder}
"""By kind of job."""


def check_result(kind: str, result: Mapping[str, Any] | None) -> None:
    """Refuse what pages could not show.

    Args:
        kind: Of the job.
        result: What is said to have come of it.

    Raises:
        RunError: It is not what comes of such a job.
    """
    if kind not in RESULTS:
        return
    try:
        RESULTS[kind].model_validate(dict(result or {}))
    except ValidationError as error:
        where = ".".join(str(part) for part in error.errors()[0]["loc"])[:80]
        raise RunError(f"This is not what comes of a job of kind {kind!r}: it is wrong at {where!r}.") from error
