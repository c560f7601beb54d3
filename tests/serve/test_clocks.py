"""A league on a computer whose clock is set back, or was ahead: what people know of a race is no secret again."""

from __future__ import annotations

from collections.abc import Callable
from datetime import timedelta
from typing import Any

import pytest

from racecraft.serve.problems import Conflict
from racecraft.serve.races import state
from racecraft.serve.store.database import Database
from racecraft.serve.store.tables import Group, Member, Race, User, now
from racecraft.serve.submissions.league import League
from racecraft.serve.submissions.schemas import LeagueRaceChange
from racecraft.sim.vehicle import load_vehicle

HOUR = timedelta(hours=1)
LOOKS: dict[str, Callable[[League, int], Any]] = {
    "list": lambda league, _: league.races(2),
    "page": lambda league, race: league.get(race, None),
    "board": lambda league, race: league.board(race, user_id=None, top=10),
    "announcement": lambda league, race: league.announcement(race, user_id=None),
    "race.json": lambda league, race: league.published(race, user_id=None),
}


@pytest.fixture
def league(database: Database) -> League:
    with database.transaction() as session:
        session.add_all([Group(id=1, title="Class"), User(id=2, name="Teacher", handle="teacher")])
        session.flush()
        session.add(Member(group_id=1, user_id=2, role="organiser"))
    return League(database, lambda _: pytest.fail("nobody asks for a track"))


def race_of(database: Database, *, secret: str) -> int:
    """A public race that closes in an hour."""
    document: dict[str, Any] = {"vehicle": vars(load_vehicle("v5"))}
    about = {"title": "Friday cup", "track": "oval", "ranking": "total", "commitment": "c", "document": document}
    race = Race(owner_id=2, group_id=1, visibility="public", secret=secret, closes=now() + HOUR, **about)
    with database.transaction() as session:
        session.add(race)
        session.flush()
        return race.id


@pytest.mark.parametrize("look", LOOKS)
def test_a_race_that_people_know_to_be_over_stays_over(
    database: Database, league: League, monkeypatch: pytest.MonkeyPatch, look: str
) -> None:
    race = race_of(database, secret="ab" * 32)
    assert league.get(race, None).state == "open"
    monkeypatch.setattr(state, "now", lambda: now() + 2 * HOUR)  # as of a computer that begins two hours ahead
    LOOKS[look](league, race)
    monkeypatch.setattr(state, "now", now)
    assert league.get(race, None).state == "closed"
    assert league.announcement(race, user_id=None).secret == "ab" * 32
    with pytest.raises(Conflict, match="everybody knows its secret"):
        league.change(race, LeagueRaceChange(closes=now() + HOUR), user_id=2)


def test_what_nobody_has_heard_of_and_a_practice_go_by_the_clock(
    database: Database, league: League, monkeypatch: pytest.MonkeyPatch
) -> None:
    unheard, practice = race_of(database, secret="ab" * 32), race_of(database, secret="")
    monkeypatch.setattr(state, "now", lambda: now() + 2 * HOUR)
    assert league.get(practice, None).state == "closed"
    monkeypatch.setattr(state, "now", now)
    assert [league.get(race, None).state for race in (unheard, practice)] == ["open", "open"]
