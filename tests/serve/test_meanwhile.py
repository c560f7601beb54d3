"""What is asked for while somebody else changes what it depends on: one comes before the other, and both hold."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from types import ModuleType

import pytest
import sqlalchemy as sa

from racecraft.serve.groups.groups import Groups
from racecraft.serve.people import people as people_module
from racecraft.serve.people.people import People, add_person
from racecraft.serve.problems import Conflict, NotFound
from racecraft.serve.settings import OWNER
from racecraft.serve.store.database import Database
from racecraft.serve.store.tables import Job, Member, Race, Submission, User
from racecraft.serve.submissions import entries as entries_module
from racecraft.serve.submissions import league as league_module
from racecraft.serve.submissions.entries import Entries
from racecraft.serve.submissions.league import League
from racecraft.serve.submissions.schemas import Stage
from racecraft.serve.tracks.courses import Courses

TEACHER, ADA = 2, 3
CUP, FINAL = 1, 2
SOON = 1.0  # s that somebody else is given; who has to wait comes afterwards


@pytest.fixture
def database(database_url: str) -> Iterator[Database]:
    """With a group of the teacher's, in which Ada races, and two races."""
    database = Database(database_url)
    database.migrate()
    with database.transaction() as session:
        assert (add_person(session, "Teacher", role="organiser"), add_person(session, "Ada")) == (TEACHER, ADA)
    group = Groups(database).create("Class", by=People(database).get(TEACHER))
    with database.transaction() as session:
        session.add(Member(group_id=group, user_id=ADA, role="racer", is_home=True))
        for number in (CUP, FINAL):
            terms = {"track": "oval", "ranking": "total", "commitment": "0" * 64, "document": {}}
            session.add(Race(id=number, owner_id=TEACHER, group_id=group, title=f"Cup {number}", **terms))
    yield database
    database.close()


@pytest.fixture
def league(database: Database, tmp_path: Path) -> League:
    return League(database, lambda _: Courses(tmp_path / "tracks"))


@pytest.fixture
def entries(database: Database, league: League, tmp_path: Path) -> Entries:
    return Entries(database, tmp_path / "state", lambda _: Courses(tmp_path / "tracks"), league)


@pytest.fixture
def meanwhile(monkeypatch: pytest.MonkeyPatch) -> Iterator[Callable[[ModuleType, str, Callable[[], object]], None]]:
    """Has somebody else do something when a function is called for the first time, before it goes on."""
    others: list[threading.Thread] = []

    def meanwhile(module: ModuleType, name: str, do: Callable[[], object]) -> None:
        called = getattr(module, name)

        def late(*given: object, **named: object) -> object:
            if not others:
                others.append(threading.Thread(target=do))
                others[0].start()
                others[0].join(SOON)
            return called(*given, **named)

        monkeypatch.setattr(module, name, late)

    yield meanwhile
    for other in others:
        other.join()


Meanwhile = Callable[[ModuleType, str, Callable[[], object]], None]


def ended(check: Callable[[], object]) -> bool:
    """Wait until something is so that another thread does."""
    for _ in range(600):
        if check():
            return True
        threading.Event().wait(0.05)
    return False


@pytest.mark.costly
def test_who_goes_while_they_enter_has_no_entry_in_the_race(
    database: Database, entries: Entries, entry: bytes, meanwhile: Meanwhile
) -> None:
    people = People(database)
    meanwhile(entries_module, "require_room", lambda: people.remove(ADA))
    entries.submit(CUP, entry, model="novice", user_id=ADA)

    def is_gone() -> bool:
        with database.transaction() as session:
            return session.get_one(User, ADA).deleted is not None

    assert ended(is_gone)
    with database.transaction() as session:
        (mine,) = session.scalars(sa.select(Submission)).all()
        assert (mine.model, bool(mine.disqualified)) == ("-", True)
        assert session.get_one(Job, mine.job_id).state == "cancelled"


def test_who_is_no_member_any_more_when_their_file_is_read_does_not_enter(
    database: Database, entries: Entries, entry: bytes, meanwhile: Meanwhile
) -> None:
    meanwhile(entries_module, "read_entry_file", lambda: Groups(database).remove(1, ADA))
    with pytest.raises(NotFound):
        entries.submit(CUP, entry, model="novice", user_id=ADA)
    with database.transaction() as session:
        assert session.scalars(sa.select(Submission)).all() == []


@pytest.mark.costly
def test_what_is_restored_while_its_owner_goes_stays_out(
    database: Database, entries: Entries, entry: bytes, meanwhile: Meanwhile
) -> None:
    number = entries.submit(CUP, entry, model="novice", user_id=ADA)
    entries.disqualify(CUP, number, "not fair", user_id=TEACHER)
    meanwhile(entries_module, "accept", lambda: People(database).remove(ADA))
    entries.disqualify(CUP, number, "", user_id=TEACHER)

    def is_out() -> bool:
        with database.transaction() as session:
            return session.get_one(Submission, number).disqualified == "Withdrawn by its owner."

    assert ended(is_out)


@pytest.mark.costly
def test_a_name_that_comes_with_an_organisers_does_not_stay_for_it(database: Database, meanwhile: Meanwhile) -> None:
    people = People(database)
    meanwhile(people_module, "checked_name", lambda: people.rename(ADA, "Lovelace", by_organiser=True))
    people.rename(ADA, "Rude")
    assert ended(lambda: people.get(ADA).name == "Lovelace")
    with pytest.raises(Conflict, match="gave you this name"):
        people.rename(ADA, "Rude")


@pytest.mark.costly
def test_no_two_races_follow_each_other(database: Database, league: League, meanwhile: Meanwhile) -> None:
    refused: list[Conflict] = []

    def follow() -> None:
        try:
            league.follow(FINAL, Stage(race=CUP), user_id=TEACHER)
        except Conflict as error:
            refused.append(error)

    meanwhile(league_module, "require_alone", follow)
    league.follow(CUP, Stage(race=FINAL), user_id=TEACHER)
    assert ended(lambda: refused)


@pytest.mark.costly
def test_no_race_follows_one_that_is_put_away_meanwhile(
    database: Database, league: League, meanwhile: Meanwhile
) -> None:
    refused: list[Conflict] = []

    def remove() -> None:
        try:
            league.remove(CUP, user_id=TEACHER)
        except Conflict as error:
            refused.append(error)

    meanwhile(league_module, "require_alone", remove)
    league.follow(FINAL, Stage(race=CUP), user_id=TEACHER)
    assert ended(lambda: refused)


def test_groups_of_who_goes_have_somebody_who_holds_them(database: Database) -> None:
    groups, people = Groups(database), People(database)
    groups.join_on(groups.open(1, role="racer", uses=1, hours=1).code, OWNER)
    empty = groups.create("Club", by=people.get(TEACHER))
    shared = groups.create("Team", by=people.get(TEACHER))
    with database.transaction() as session:
        session.add(Member(group_id=shared, user_id=ADA, role="organiser"))
    people.remove(TEACHER)
    assert [(one.id, one.role) for one in groups.members(1)] == [(OWNER, "organiser"), (ADA, "racer")]
    assert [(one.id, one.role) for one in groups.members(empty)] == [(OWNER, "organiser")]
    assert [one.id for one in groups.members(shared)] == [ADA]
