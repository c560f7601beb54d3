"""What browser and server tell each other about comments."""

from __future__ import annotations

from datetime import datetime
from typing import Annotated

from pydantic import Field

from racecraft.serve.schemas import Message, RunName

Text = Annotated[str, Field(min_length=1, max_length=1000, pattern=r"\S")]


class NewComment(Message):
    """Something about a racer's model, which its owner reads."""

    member: Annotated[int, Field(ge=1, lt=2**31)]
    model: RunName
    text: Text


class CommentInfo(Message):
    """What somebody has said about a model."""

    id: int
    model: str
    author: str
    is_mine: bool
    """Whether who looks has written it."""
    text: str
    created: datetime
