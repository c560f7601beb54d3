"""What browser and server tell each other about finals in which two meet at a time."""

from __future__ import annotations

from typing import Any, Literal

from racecraft.serve.schemas import Message


class FinalistInfo(Message):
    """Somebody who drives in it."""

    seed: int
    """From 1, the best in qualifying."""
    name: str
    model: str
    """That they qualified with."""
    place: int | None
    """Once all duels are decided."""
    is_me: bool


class DuelRacer(Message):
    """One of the two of a duel."""

    seed: int | None
    """None for whom an earlier duel has yet to find."""
    source: int | None
    """The duel that they come from; None for who begins with this one."""
    score: float | None
    """s, the mean of both heats; None before, and without enough laps in both."""
    completion: float | None
    """Fraction of the distance of both heats; None before."""


class DuelInfo(Message):
    """Two who meet, in two heats: each is in front once."""

    number: int
    """From 0, in the order in which they are driven."""
    round: int
    """From 0."""
    is_for_third: bool
    racers: list[DuelRacer]
    winner: int | None
    """Its seed, once it is decided."""


class FinalPage(Message):
    """A final: who drives, and all its duels, as far as they are decided."""

    race: int
    form: Literal["head-to-head", "bracket"]
    best: int
    """How many of the first of qualifying drive, at most."""
    qualifying: int | None
    """The race that it follows, and its title."""
    qualifying_title: str
    is_qualified: bool
    """Whether that is over and judged, so that this can be driven."""
    state: Literal["waiting", "queued", "running", "done", "failed", "cancelled"]
    error: dict[str, Any] | None
    """Why it could not be driven to its end."""
    finalists: list[FinalistInfo]
    """None until it is begun."""
    duels: list[DuelInfo]
