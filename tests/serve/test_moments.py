"""Moments are the same in every zone: as they are told, as either database keeps them, and as people read them."""

from __future__ import annotations

from collections.abc import Iterator
from datetime import UTC, datetime, timedelta, timezone

import pytest
from pydantic import ValidationError

from racecraft.serve.races.schemas import RaceChange
from racecraft.serve.settings import OWNER
from racecraft.serve.store.database import Database
from racecraft.serve.store.tables import Race
from racecraft.serve.submissions.schemas import LeagueRaceChange, NewLeagueRace

NOON = datetime(2030, 7, 1, 12, tzinfo=UTC)
THERE = timezone(timedelta(hours=5, minutes=45))


@pytest.fixture
def database(database_url: str) -> Iterator[Database]:
    is_sqlite = database_url.startswith("sqlite")
    database = Database(database_url if is_sqlite else f"{database_url}&options=-c%20TimeZone%3DAsia/Kathmandu")
    database.migrate()
    yield database
    database.close()


def test_a_moment_of_another_zone_is_kept_as_the_moment_that_it_is(database: Database) -> None:
    told = NOON.astimezone(THERE)
    race = Race(owner_id=OWNER, title="far away", track="oval", ranking="best-lap", opens=told)
    with database.transaction() as session:
        session.add(race)
    with database.transaction() as session:
        kept = session.get_one(Race, race.id)
    assert kept.opens == NOON
    assert f"{kept.opens:%H:%M}" == "12:00", "what a sentence says is UTC is"


@pytest.mark.parametrize("message", [RaceChange, LeagueRaceChange, NewLeagueRace])
def test_what_is_told_in_any_zone_is_known_in_utc(message: type[RaceChange]) -> None:
    needed = {"title": "far away"} if message is NewLeagueRace else {}
    request = message.model_validate({**needed, "closes": "2030-07-01T17:45:00+05:45"})
    assert request.closes == NOON
    assert request.closes is not None
    assert request.closes.tzinfo is UTC


@pytest.mark.parametrize("moment", ["9999-12-31T23:59:59-12:00", "0001-01-01T00:00:00+14:00"])
def test_moments_that_other_clocks_cannot_show_are_refused(moment: str) -> None:
    with pytest.raises(ValidationError, match="from 2 to 9998"):
        LeagueRaceChange.model_validate({"closes": moment})
