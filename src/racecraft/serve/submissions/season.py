"""A group's season: points for places in all its races that are over and lead to no other one."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import sqlalchemy as sa
from sqlalchemy.orm import Session, aliased

from racecraft.serve.races.races import state_of
from racecraft.serve.store.tables import Race
from racecraft.serve.submissions.finalists import board_of

POINTS: Final = (25, 18, 15, 12, 10, 8, 6, 4, 2, 1)
"""By place, as Formula 1 gives them since 2010."""


@dataclass
class SeasonStanding:
    """Somebody's season so far."""

    user: int
    name: str
    points: int = 0
    races: int = 0
    """In which they have points."""
    wins: int = 0


def read_season(session: Session, group_id: int) -> list[SeasonStanding]:
    """Who has how many points in a group, most first; of equals who has won more. Practice gives none."""
    later = aliased(Race)
    leads_on = sa.exists().where(later.after_id == Race.id, later.deleted.is_(None))
    held = sa.select(Race).where(Race.group_id == group_id, Race.deleted.is_(None), Race.secret != "", ~leads_on)
    found: dict[int, SeasonStanding] = {}
    for race in session.scalars(held.order_by(Race.id)).all():
        if state_of(race) != "closed":
            continue
        for row in board_of(session, race, user_id=None, top=len(POINTS)).rows:
            if row.place is not None and row.place <= len(POINTS):
                one = found.setdefault(row.user, SeasonStanding(row.user, row.name))
                one.points += POINTS[row.place - 1]
                one.races += 1
                one.wins += row.place == 1
    return sorted(found.values(), key=lambda one: (-one.points, -one.wins, one.user))
