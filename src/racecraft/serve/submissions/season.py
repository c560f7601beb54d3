"""A group's season: what everybody did in its races that are over, and points where they lead to no other one."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Final

import sqlalchemy as sa
from sqlalchemy.orm import Session, aliased

from racecraft.serve.races.races import state_of
from racecraft.serve.store.tables import Race, User
from racecraft.serve.submissions.finalists import last_board_of

POINTS: Final = (25, 18, 15, 12, 10, 8, 6, 4, 2, 1)
"""By place, as Formula 1 gives them since 2010."""
DEEPEST: Final = 100  # places of a race that are looked at
PUBLIC_RACES: Final = 20
"""A stranger's question costs so many boards and no more."""


@dataclass(frozen=True, kw_only=True)
class SeasonRace:
    """What somebody did in a race."""

    race: int
    title: str
    place: int
    points: int
    """0 in qualifying, whose final gives them."""
    gap: float | None
    """Behind the first, as a fraction of its score; None of a final in which two meet at a time."""


@dataclass
class SeasonStanding:
    """Somebody's season so far."""

    user: int
    name: str
    results: list[SeasonRace] = field(default_factory=list)
    """The earliest race first."""

    @property
    def points(self) -> int:
        """In all races."""
        return sum(one.points for one in self.results)

    @property
    def races(self) -> int:
        """In which they have points."""
        return sum(one.points > 0 for one in self.results)

    @property
    def wins(self) -> int:
        """That gave points."""
        return sum(one.points == POINTS[0] for one in self.results)


def read_season(session: Session, group_id: int, *, public: bool = False) -> list[SeasonStanding]:
    """Who has how many points in a group, most first; of equals who has won more. Practice is none of it.

    Who has deleted their account is none of it either, also where they were in a final, whose places stay as driven.

    Args:
        session: To read in.
        group_id: Whose.
        public: Only of races that everybody may see, and of the latest `PUBLIC_RACES` of them.
    """
    later = aliased(Race)
    leads_on = sa.exists().where(later.after_id == Race.id, later.deleted.is_(None)).label("leads_on")
    held = sa.select(Race, leads_on).where(Race.group_id == group_id, Race.deleted.is_(None), Race.secret != "")
    if public:
        held = held.where(Race.visibility == "public")
    over = [(race, leads) for race, leads in session.execute(held.order_by(Race.id)) if state_of(race) == "closed"]
    found: dict[int, SeasonStanding] = {}
    for race, gives_none in over[-PUBLIC_RACES:] if public else over:
        board = last_board_of(session, race, top=DEEPEST)
        for row in board.rows:
            if row.place is None:
                continue
            points = POINTS[row.place - 1] if row.place <= len(POINTS) and not gives_none else 0
            behind = row.score_ms / board.first_ms - 1.0 if row.score_ms and board.first_ms else None
            result = SeasonRace(race=race.id, title=race.title, place=row.place, points=points, gap=behind)
            found.setdefault(row.user, SeasonStanding(row.user, row.name)).results.append(result)
    gone = session.scalars(sa.select(User.id).where(User.id.in_(found), User.deleted.is_not(None)))
    for user in gone:
        del found[user]
    return sorted(found.values(), key=lambda one: (-one.points, -one.wins, one.user))
