"""What many ask for at the same moment: nobody gets more than there is, and who is shut out meanwhile gets nothing."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from threading import Barrier
from typing import Any

import pytest
import sqlalchemy as sa

from racecraft.course import lessons
from racecraft.course.lesson import Lesson
from racecraft.serve.comments import comments as comments_module
from racecraft.serve.comments.comments import Comments
from racecraft.serve.groups import groups as groups_module
from racecraft.serve.groups.groups import Groups
from racecraft.serve.lessons.studies import progress_of, record
from racecraft.serve.people import keys as keys_module
from racecraft.serve.people import people as people_module
from racecraft.serve.people.identities import Identities
from racecraft.serve.people.keys import Keys, digest_of
from racecraft.serve.people.passwords import hash_password
from racecraft.serve.people.people import People, add_person
from racecraft.serve.problems import Conflict, NotLetIn
from racecraft.serve.store.database import Database
from racecraft.serve.store.tables import Card, Comment, Invitation, Member, Reset, Token

ADA, AT_ONCE, MOST = 2, 8, 3


@pytest.fixture
def database(database_url: str) -> Iterator[Database]:
    database = Database(database_url)
    database.migrate()
    with database.transaction() as session:
        assert add_person(session, "Ada", role="organiser") == ADA
    yield database
    database.close()


def successes(ask: Callable[[int], Any]) -> int:
    """How many of some at the same moment are given what they ask for."""
    together = Barrier(AT_ONCE)

    def one(number: int) -> bool:
        together.wait(60.0)
        try:
            ask(number)
        except Conflict:
            return False
        return True

    with ThreadPoolExecutor(AT_ONCE) as pool:
        return sum(pool.map(one, range(AT_ONCE)))


def count(database: Database, column: Any) -> int:
    with database.transaction() as session:
        return session.scalar(sa.select(sa.func.count(column))) or 0


def test_as_many_tokens_groups_members_and_comments_as_there_may_be(
    database: Database, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(keys_module, "MAX_TOKENS", MOST)
    monkeypatch.setattr(groups_module, "MAX_GROUPS", MOST)
    monkeypatch.setattr(groups_module, "MAX_MEMBERS", MOST)
    monkeypatch.setattr(comments_module, "MAX_COMMENTS", MOST)
    keys, groups, comments = Keys(database), Groups(database), Comments(database)
    ada = People(database).get(ADA)
    assert successes(lambda _: keys.make_token(ADA, title="", scopes=["read"], days=1)) == MOST
    assert count(database, Token.id) == MOST
    assert successes(lambda _: groups.create("club", by=ada)) == MOST
    assert count(database, Member.group_id) == MOST
    assert successes(lambda number: groups.add(1, [(f"pupil {number}", "")])) == MOST - 1
    assert len(groups.members(1)) == MOST
    assert successes(lambda _: comments.add(ADA, "model", "well done", author_id=1)) == MOST
    assert count(database, Comment.id) == MOST


@pytest.mark.costly
def test_of_cards_links_and_codes_that_are_made_together_one_is_good(database: Database) -> None:
    keys, groups = Keys(database), Groups(database)
    number = groups.create("club", by=People(database).get(ADA))
    for make, column in (
        (lambda _: keys.print_card(ADA), Card.digest),
        (lambda _: keys.make_reset(ADA), Reset.digest),
        (lambda _: groups.open(number, role="racer", uses=1, hours=1), Invitation.id),
    ):
        for _ in range(5):  # those who come together do not always meet
            assert successes(make) == AT_ONCE
            assert count(database, column) == 1


@pytest.mark.costly
def test_a_first_password_is_one_of_those_that_are_given_together(database: Database) -> None:
    people = People(database)
    given: list[bool] = []
    assert successes(lambda number: given.append(people.set_password(ADA, f"a password {number}", old=""))) == AT_ONCE
    assert sum(given) == 1


def test_who_is_shut_out_while_it_is_made_has_no_key(database: Database, monkeypatch: pytest.MonkeyPatch) -> None:
    people, keys, identities = People(database), Keys(database), Identities(database)
    asked_in = digest_of(keys.open_session(ADA))

    def slowly(password: str) -> str:
        keys.revoke(ADA)
        return hash_password(password)

    monkeypatch.setattr(people_module, "hash_password", slowly)
    with pytest.raises(NotLetIn, match="not signed in"):
        people.set_password(ADA, "of the thief", old="", asked_in=asked_in)
    assert people.kept_password(ADA) == ""
    with pytest.raises(NotLetIn, match="not signed in"):
        keys.make_token(ADA, title="", scopes=["read"], days=1, asked_in=asked_in)
    assert keys.tokens(ADA) == []
    with pytest.raises(NotLetIn, match="not signed in"):
        identities.link(ADA, "https://school.example", "thief", asked_in=asked_in)
    assert identities.of(ADA, "https://school.example") is None


def test_a_lesson_that_is_read_and_answered_at_the_same_moment_is_both(database: Database) -> None:
    for lesson in lessons():  # those who come together do not always meet
        right = [question.answer for question in lesson.facts.questions]

        def ask(number: int, lesson: Lesson = lesson, right: list[int] = right) -> None:
            record(database, ADA, lesson, is_read=number % 2 == 0, answers=right if number % 2 else None)

        assert successes(ask) == AT_ONCE
        done = progress_of(database, [ADA])[ADA][lesson.number]
        assert (done.is_read, done.quiz) == (True, 1)
