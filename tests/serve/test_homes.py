"""By which group somebody came in: whose they are, and whose no longer; and what is made of groups of before."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
import sqlalchemy as sa

from racecraft.serve.groups import groups as groups_module
from racecraft.serve.groups.groups import Groups
from racecraft.serve.people.people import People, add_person
from racecraft.serve.problems import Conflict, NotFound
from racecraft.serve.store.database import Database, upgrade
from racecraft.serve.store.tables import Member

CLASS, CLUB, TEACHER, TRAINER, ADA = 1, 2, 2, 3, 4


@pytest.fixture
def database(database_url: str) -> Iterator[Database]:
    database = Database(database_url)
    yield database
    database.close()


@pytest.fixture
def groups(database: Database) -> Groups:
    """A teacher's class, and a trainer's club."""
    database.migrate()
    with database.transaction() as session:
        made = [add_person(session, name, role="organiser") for name in ("teacher", "trainer")]
    assert made == [TEACHER, TRAINER]
    people, groups = People(database), Groups(database)
    assert groups.create("class", by=people.get(TEACHER)) == CLASS
    assert groups.create("club", by=people.get(TRAINER)) == CLUB
    return groups


def code(groups: Groups, group: int) -> str:
    return groups.open(group, role="racer", uses=9, hours=1).code


def whose(groups: Groups, racer: int) -> list[int]:
    """Who has power over a racer."""
    found = []
    for group, organiser in ((CLASS, TEACHER), (CLUB, TRAINER)):
        try:
            groups.ward(group, racer)
        except NotFound:
            assert not groups.may_look(organiser, racer)
        else:
            assert groups.may_look(organiser, racer)
            found.append(organiser)
    return found


def test_an_organiser_makes_so_many_groups(groups: Groups, database: Database, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(groups_module, "MAX_GROUPS", 2)
    teacher = People(database).get(TEACHER)
    groups.create("second", by=teacher)
    with pytest.raises(Conflict, match="in 2 groups already"):
        groups.create("third", by=teacher)


def test_a_racer_is_of_the_group_that_they_came_in_by_until_they_leave_it(groups: Groups) -> None:
    typed = code(groups, CLASS)
    by_code, (by_card,) = groups.join(typed, "Ada"), groups.add(CLASS, [("Bob", "")])
    by_provider = groups.welcome("Carl", ("https://id.example", "7"), group_id=CLASS, real_name="")
    assert by_code is not None
    for racer in (by_code, by_card, by_provider):
        assert whose(groups, racer) == [TEACHER]
        assert groups.join_on(code(groups, CLUB), racer) == CLUB
        assert whose(groups, racer) == [TEACHER], "to join another group gives its organiser nothing"
        groups.remove(CLASS, racer)
        assert whose(groups, racer) == [], "nobody inherits a racer unasked"
        assert groups.join_on(code(groups, CLUB), racer) == CLUB
        assert whose(groups, racer) == [TRAINER], "but who types a code anew"
        assert groups.join_on(code(groups, CLASS), racer) == CLASS
        assert whose(groups, racer) == [TRAINER]


def test_who_has_a_password_or_makes_groups_becomes_nobodys(groups: Groups, database: Database) -> None:
    alone = groups.welcome("Dora", ("https://id.example", "8"), group_id=None, real_name="")
    assert People(database).set_password(alone, "a long password", old="")
    for racer in (alone, TRAINER):
        assert groups.join_on(code(groups, CLASS), racer) == CLASS
        assert whose(groups, racer) == []


def test_of_groups_of_before_the_first_is_the_one_that_they_came_in_by(database: Database) -> None:
    with database._alone() as connection:
        upgrade(connection, "0015")
    with database.engine.begin() as connection:
        moments = {"early": "2026-01-01 00:00:00+00:00", "late": "2026-02-01 00:00:00+00:00"}
        for number in (TEACHER, ADA):
            row = f"{number}, 'u{number}', 'u{number}', 'racer', '', '{moments['early']}'"
            connection.execute(sa.text(f"INSERT INTO users (id, name, handle, role, password, created) VALUES ({row})"))
        for group in (CLASS, CLUB):
            connection.execute(sa.text(f"INSERT INTO groups VALUES ({group}, 'g', '{moments['early']}')"))
        for group, user, role, moment in (
            (CLASS, TEACHER, "organiser", "early"),
            (CLASS, ADA, "racer", "late"),
            (CLUB, ADA, "racer", "early"),
            (CLUB, TEACHER, "racer", "late"),
        ):
            row = f"{group}, {user}, '{role}', '', '{moments[moment]}'"
            connection.execute(
                sa.text(f"INSERT INTO members (group_id, user_id, role, real_name, created) VALUES ({row})")
            )
    database.migrate()
    with database.transaction() as session:
        homes = sa.select(Member.group_id, Member.user_id).where(Member.is_home).order_by(Member.user_id)
        assert session.execute(homes).all() == [(CLUB, TEACHER), (CLUB, ADA)]
