"""What browser and server tell each other about people."""

from __future__ import annotations

from datetime import datetime
from typing import Annotated, Literal

from pydantic import Field

from racecraft.serve.people.keys import Scope
from racecraft.serve.people.people import Person, Role
from racecraft.serve.schemas import Message

Name = Annotated[str, Field(min_length=1, max_length=64)]
Password = Annotated[str, Field(max_length=1000)]
Secret = Annotated[str, Field(min_length=1, max_length=200)]


class Me(Message):
    """Who is signed in."""

    id: int
    name: str
    role: Role
    has_password: bool
    may_organise: bool


class Door(Message):
    """What a browser finds at the door."""

    is_league: Literal[True] = True
    me: Me | None
    provider: str | None
    """What the button says through whom people sign in; None where through nobody."""


class SignIn(Message):
    """By password."""

    name: Name
    password: Password


class ShowCard(Message):
    """By card."""

    secret: Secret


class NewReset(Message):
    """Whose password is forgotten."""

    person: Name


class ResetLink(Message):
    """By which somebody gives themselves a new password, once."""

    name: str
    link: str


class ResetPassword(Message):
    """A new password, by such a link's secret."""

    secret: Secret
    password: Password


class Device(Message):
    """A program that wants to be let in: what it keeps, and what it shows."""

    secret: str
    code: str
    link: str
    seconds: int


class TakeToken(Message):
    """The program asks whether it is let in."""

    secret: Secret


class TakenToken(Message):
    """Its token; empty while nobody has let it in."""

    token: str


class LetIn(Message):
    """The code that a program shows."""

    code: str = Field(min_length=1, max_length=40)


class ToProvider(Message):
    """Where a browser goes to sign in."""

    to: str


class FromProvider(Message):
    """What a browser brings back from there."""

    code: str = Field("", max_length=4096)
    state: str = Field("", max_length=200)
    error: str = Field("", max_length=200)
    iss: str = Field("", max_length=500)


class Arrived(Message):
    """Who came back; None of who has to choose a name."""

    me: Me | None
    is_linked: bool
    """Whether the provider was added to an account."""


class Newcomer(Message):
    """The name that everybody is to see."""

    name: Name


class ProviderLink(Message):
    """How somebody comes in through the provider."""

    label: str
    since: datetime | None
    """None of who does not."""
    may_unlink: bool


class Join(Message):
    """By a group's code, under a name of one's own."""

    code: str = Field(min_length=1, max_length=40)
    name: Name


class JoinOn(Message):
    """The same for who has an account."""

    code: str = Field(min_length=1, max_length=40)


class LoginCard(Message):
    """A card to print or to keep: whoever shows it is let in as its owner."""

    id: int
    name: str
    link: str
    picture: str
    """The link to scan, as the address of an image."""


class Joined(Message):
    """Who came in, and the card to come back with."""

    me: Me
    card: LoginCard


class AccountChange(Message):
    """Another name."""

    name: Name


class NewPassword(Message):
    """A first password, or another one."""

    old: Password = ""
    new: Password


class Farewell(Message):
    """Of who removes their account: that it is they."""

    password: Password = ""


class NewToken(Message):
    """A token for a program."""

    title: str = Field("racecraft", min_length=1, max_length=64)
    scopes: list[Scope] = Field(["read", "submit"], min_length=1, max_length=2)
    days: int = Field(90, ge=1, le=365)


class SessionInfo(Message):
    """A browser that is signed in."""

    id: str
    created: datetime
    expires: datetime | None
    is_this: bool


class TokenInfo(Message):
    """A token, without its secret."""

    id: int
    title: str
    scopes: list[str]
    created: datetime
    expires: datetime


class MadeToken(Message):
    """A token's secret, shown once."""

    id: int
    secret: str


def me_of(person: Person) -> Me:
    """Who is signed in, as the browser sees it."""
    return Me(
        id=person.id,
        name=person.name,
        role=person.role,
        has_password=person.has_password,
        may_organise=person.may_organise,
    )
