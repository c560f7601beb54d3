"""What browser and server tell each other about what may be used."""

from __future__ import annotations

from pydantic import Field

from racecraft.serve.schemas import Message


class QuotaInfo(Message):
    """So much may be used; null where nothing is said, and what is said of more people counts."""

    minutes: int | None = Field(None, ge=0, le=1_000_000)
    """Of training, in 24 hours."""
    models: int | None = Field(None, ge=0, le=1_000_000)
    places: int | None = Field(None, ge=0, le=1_000_000)
    """Jobs that wait or run, without submissions to races."""


class UsageInfo(Message):
    """So much is used."""

    minutes: float
    models: int
    places: int


class OwnQuota(Message):
    """What one may use and does."""

    limits: QuotaInfo
    used: UsageInfo


class MemberUsage(Message):
    """The same of a racer, as their organiser sees it."""

    id: int
    said: QuotaInfo
    """Of this person alone."""
    limits: QuotaInfo
    used: UsageInfo


class GroupQuota(Message):
    """What a group's racers may use and do."""

    each: QuotaInfo
    """Each of them."""
    together: QuotaInfo
    """All of them; said by an admin."""
    used: UsageInfo
    """By all of them."""
    racers: list[MemberUsage]
