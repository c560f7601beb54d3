"""What the console's browser and server tell each other; the OpenAPI, and so the web client's types, come from here.

Units as everywhere: metres, seconds, radians, fractions from 0 to 1. AWS's degrees and percent stay in AWS's files.
"""

from __future__ import annotations

from datetime import UTC, datetime
from typing import Annotated

from pydantic import AfterValidator, AwareDatetime, BaseModel, ConfigDict, Field

from racecraft.errors import ConfigError
from racecraft.run.folder import checked_name

RunName = Annotated[
    str,
    AfterValidator(checked_name),
    Field(json_schema_extra={"minLength": 1, "maxLength": 64, "pattern": r"^[A-Za-z0-9][A-Za-z0-9._-]*$"}),
]


def _in_utc(moment: datetime) -> datetime:
    """The same moment in UTC, which has no year 0 or 10000.

    Raises:
        ConfigError: It is of one of those, or so close to it that another zone's clock shows it.
    """
    if not 1 < moment.year < 9999:
        raise ConfigError(f"A moment is of a year from 2 to 9998, not {moment.year}.")
    return moment.astimezone(UTC)


Moment = Annotated[AwareDatetime, AfterValidator(_in_utc)]
"""Told in any zone, it is known in UTC from there on."""


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
