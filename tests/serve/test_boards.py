"""A race's board as it stands in the database: who is where, and who stands around me."""

from __future__ import annotations

import hashlib
import time
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
import sqlalchemy as sa

from racecraft.contest.standings import places, ranking_key
from racecraft.serve.store.database import Database
from racecraft.serve.store.tables import Group, Job, Race, Submission, User, now
from racecraft.serve.submissions.board import AROUND, read_board

pytestmark = pytest.mark.costly


@pytest.fixture
def database(database_url: str) -> Iterator[Database]:
    database = Database(database_url)
    database.migrate()
    yield database
    database.close()


def _fill(database: Database, results: list[tuple[int, int | None, int | None, int, float]]) -> int:
    """A race with judged submissions: user, score, best lap (ms), resets, completion."""
    with database.transaction() as session:
        group = Group(title="g")
        session.add(group)
        session.flush()
        race = Race(owner_id=1, group_id=group.id, title="r", track="oval", ranking="total")
        session.add(race)
        users = sorted({one[0] for one in results})
        session.execute(
            sa.insert(User), [{"id": 10 + user, "name": f"u{user}", "handle": f"u{user}"} for user in users]
        )
        session.add(Job(id="j", kind="judge", run="", state="done"))
        session.flush()
        rows = [
            {
                "race_id": race.id,
                "user_id": 10 + user,
                "job_id": "j",
                "digest": hashlib.sha256(str(number).encode()).hexdigest(),
                "model": "m",
                "score_ms": score,
                "best_lap_ms": best,
                "resets": resets,
                "completion": completion,
                "judged": now(),
            }
            for number, (user, score, best, resets, completion) in enumerate(results)
        ]
        session.execute(sa.insert(Submission), rows)
        return race.id


def test_the_board_places_by_the_rules_of_every_race(database: Database) -> None:
    random = np.random.default_rng(4)
    results = []
    for user in [*range(30), *random.integers(0, 30, 90).tolist()]:
        is_ranked = random.random() < 0.7
        score = int(random.integers(20, 25)) * 1000 if is_ranked else None
        best = int(random.integers(8, 10)) * 1000 if is_ranked else None
        results.append((int(user), score, best, int(random.integers(0, 3)), float(random.integers(0, 5)) / 4))
    race = _fill(database, results)

    def key(one: tuple[int, int | None, int | None, int, float]) -> Any:
        score, best = one[1], one[2]
        laps = [best / 1000] if best is not None else []
        return ranking_key(
            float("inf") if score is None else score / 1000, lap_times=laps, completion=one[4], resets=one[3]
        )

    best_of = {user: min(key(one) for one in results if one[0] == user) for user in range(30)}
    expected = dict(zip(best_of, places(list(best_of.values())), strict=True))
    with database.transaction() as session:
        board = read_board(session, race, user_id=10 + 7, top=500)
        near = read_board(session, race, user_id=10 + 7, top=1)
    assert (board.entrants, board.ranked) == (30, sum(one[0] == 0.0 for one in best_of.values()))
    shown = {row.user - 10: row.place for row in board.rows if row.place is not None}
    assert shown == {user: place for user, place in expected.items() if best_of[user][0] == 0.0}
    order = [best_of[row.user - 10] for row in board.rows]
    assert order == sorted(order)
    mine = next(row.row for row in board.rows if row.user == 17)
    wanted = {1, *range(max(1, mine - AROUND), min(30, mine + AROUND) + 1)}
    assert [row.row for row in near.rows] == sorted(wanted)


@pytest.mark.parametrize(("row", "behind"), [(1, 13), (2, 7), (7, 7), (8, 6), (9, 0), (14, 0)])
def test_neighbours_and_who_is_behind_are_those_among_equals_too(database: Database, row: int, behind: int) -> None:
    """Six are second together, and the last six drove equally far without a lap."""
    scores = [20_000, *[21_000] * 6, 22_000, *[None] * 6]
    results = [(user, score, score, 0, 0.5 if score is None else 1.0) for user, score in enumerate(scores)]
    race = _fill(database, results)
    with database.transaction() as session:
        board = read_board(session, race, user_id=10 + row - 1, top=1)
    wanted = {1, *range(max(1, row - AROUND), min(len(scores), row + AROUND) + 1)}
    assert [one.row for one in board.rows] == sorted(wanted)
    assert [one.user - 9 for one in board.rows] == sorted(wanted), "of equals, who was first"
    assert board.behind == behind


def test_a_board_of_ten_thousand_is_read_at_once(database: Database) -> None:
    race = _fill(database, [(user, 20_000 + user % 977, 9000 + user % 13, user % 3, 1.0) for user in range(10_000)])
    took = []
    for _ in range(5):
        began = time.perf_counter()
        with database.transaction() as session:
            board = read_board(session, race, user_id=10 + 5000, top=100)
        took.append(time.perf_counter() - began)
    assert board.entrants == 10_000
    assert len(board.rows) == 100 + 2 * AROUND + 1
    assert min(took) < 2.0, "with room for a busy machine; benchmarks say how long it takes on a quiet one"
