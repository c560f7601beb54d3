"""What a race's row says of it: what was announced, and what it is now."""

from __future__ import annotations

from typing import TYPE_CHECKING

from racecraft.race.announcement import Announcement
from racecraft.serve.store.tables import Race, now

if TYPE_CHECKING:  # jobs do without messages
    from racecraft.serve.races.schemas import RaceState


def announcement_of(race: Race) -> Announcement:
    """A race as it was made, with its secret."""
    return Announcement(document=race.document, commitment=race.commitment, secret=race.secret)


def is_withheld(race: Race) -> bool:
    """Whether nobody may see yet where it starts."""
    return bool(race.secret) and state_of(race) != "closed"


def state_of(race: Race) -> RaceState:
    """Whether a race can be entered now."""
    moment = now()
    if not race.commitment:
        return "closed"  # nobody can enter what was driven under the old rules
    if moment < race.opens:
        return "upcoming"
    return "closed" if race.closes is not None and moment >= race.closes else "open"
