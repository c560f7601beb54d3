"""Sessions of browsers: until when each is good, and which one makes room."""

from __future__ import annotations

from datetime import timedelta

import pytest
import sqlalchemy as sa

from racecraft.serve.people.keys import MAX_SESSIONS, Keys
from racecraft.serve.people.people import add_person
from racecraft.serve.settings import OWNER
from racecraft.serve.store.database import Database
from racecraft.serve.store.tables import Session, now


@pytest.fixture
def keys(database: Database) -> Keys:
    return Keys(database)


def later(database: Database, by: timedelta) -> None:
    """As if every session had been opened so much earlier."""
    with database.transaction() as session:
        for row in session.scalars(sa.select(Session)):
            row.created -= by
            row.expires = None if row.expires is None else row.expires - by


def test_a_session_is_good_until_it_expires_and_is_then_forgotten(database: Database, keys: Keys) -> None:
    short, long, endless = (keys.open_session(OWNER, days=days) for days in (1, 3, None))
    assert keys.open_sessions([short, long, endless, "none"]) == {short, long, endless}
    later(database, timedelta(days=2))
    assert [keys.session_user(one) for one in (short, long, endless)] == [None, OWNER, OWNER]
    assert keys.open_sessions([short, long, endless]) == {long, endless}
    assert [one.is_this for one in keys.sessions(OWNER, this=long)] == [False, True]
    keys.open_session(OWNER)
    with database.transaction() as session:
        assert session.scalar(sa.select(sa.func.count()).select_from(Session)) == 3
        assert not list(session.scalars(sa.select(Session).where(Session.expires < now())))


def test_the_oldest_of_too_many_browsers_makes_room(database: Database, keys: Keys) -> None:
    with database.transaction() as session:
        other = add_person(session, "Ada", role="racer")
    theirs = keys.open_session(other)
    opened = []
    for _ in range(MAX_SESSIONS + 2):
        later(database, timedelta(seconds=1))
        opened.append(keys.open_session(OWNER))
    assert keys.open_sessions([theirs, *opened]) == {theirs, *opened[2:]}
    keys.close_session(opened[-1])
    assert keys.open_sessions([theirs, *opened]) == {theirs, *opened[2:-1]}
