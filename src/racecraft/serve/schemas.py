"""What the console's browser and server tell each other; the OpenAPI, and so the web client's types, come from here.

Units as everywhere: metres, seconds, radians, fractions from 0 to 1. AWS's degrees and percent stay in AWS's files.
"""

from __future__ import annotations

from typing import Annotated

from pydantic import AfterValidator, BaseModel, ConfigDict, Field

from racecraft.run.folder import checked_name

RunName = Annotated[
    str,
    AfterValidator(checked_name),
    Field(json_schema_extra={"minLength": 1, "maxLength": 64, "pattern": r"^[A-Za-z0-9][A-Za-z0-9._-]*$"}),
]


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
