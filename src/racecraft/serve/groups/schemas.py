"""What browser and server tell each other about groups."""

from __future__ import annotations

from datetime import datetime
from typing import Annotated

from pydantic import Field

from racecraft.serve.groups.groups import Part
from racecraft.serve.models.schemas import ModelCard
from racecraft.serve.naming import PLAIN
from racecraft.serve.people.schemas import LoginCard, Name
from racecraft.serve.schemas import Message, RunName

RealName = Annotated[str, Field(max_length=100), PLAIN]
Hours = Annotated[int, Field(ge=1, le=24 * 365)]


Title = Annotated[str, Field(min_length=1, max_length=100, pattern=r"\S"), PLAIN]


class NewGroup(Message):
    """A class, a club, an event."""

    title: Title


class GroupChange(Message):
    """Another title, or whether it is closed: nobody comes in and no race is made; what is left out stays."""

    title: Title | None = None
    is_closed: bool | None = None


class GroupCard(Message):
    """A group that one is in."""

    id: int
    title: str
    part: Part
    racers: int
    closed: datetime | None
    """Since when nobody comes in and no race is made; None while it is open."""


class MemberInfo(Message):
    """Somebody in a group."""

    id: int
    name: str
    role: Part
    real_name: str
    """Empty for who is no organiser."""
    has_card: bool
    comes_by_provider: bool
    """These two are for organisers only as well."""
    is_locked: bool
    has_password: bool
    is_home: bool
    """Whether they came in by this group, so that its organisers print their cards; for organisers only."""


class OpenGroup(Message):
    """How many may come in by a new code, and for how long."""

    uses: int = Field(40, ge=1, le=1000)
    hours: Hours = 24


class JoiningInfo(Message):
    """The code by which people come in."""

    code: str
    uses_left: int
    expires: datetime
    link: str
    picture: str
    """The link to scan, as the address of an image."""


class GroupDetail(GroupCard):
    """A group, whole."""

    members: list[MemberInfo]
    joining: JoiningInfo | None
    """For organisers, while people may come in."""


class NewMember(Message):
    """Somebody to be given a card."""

    name: Name
    real_name: RealName = ""


class NewMembers(Message):
    """A class at once."""

    people: list[NewMember] = Field(min_length=1, max_length=100)


class MemberChange(Message):
    """Another name, as everybody sees it or as only the organisers do."""

    name: Name | None = None
    real_name: RealName | None = None


class PrintCards(Message):
    """Whose cards to print."""

    members: list[Annotated[int, Field(ge=1, lt=2**31)]] = Field(min_length=1, max_length=500)


class PrintedCards(Message):
    """New cards, and who gets none."""

    cards: list[LoginCard]
    left_out: list[str]
    """Names of those who have accounts of their own: a card would be a way to be them."""


class MemberModels(Message):
    """What somebody in the group has made; looked into by ``?of=`` their number."""

    id: int
    name: str
    models: list[ModelCard]


class CopyModel(Message):
    """A member's model into one's own garage."""

    member: Annotated[int, Field(ge=1, lt=2**31)]
    model: RunName
    name: RunName | None = None
