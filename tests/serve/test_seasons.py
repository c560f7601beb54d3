"""A group's season, counted in the database: which races count, what a place is worth, who leads of equals."""

from __future__ import annotations

import hashlib
from datetime import timedelta
from pathlib import Path
from typing import Any

import pytest
from sqlalchemy.orm import Session

from racecraft.serve.finals.finals import Finals
from racecraft.serve.finals.tasks import count
from racecraft.serve.store.database import Database
from racecraft.serve.store.tables import Finalist, Group, Job, Member, Race, Submission, User, now
from racecraft.serve.submissions.finalists import board_of
from racecraft.serve.submissions.league import League
from racecraft.serve.submissions.season import PUBLIC_RACES, SeasonStanding, read_season
from racecraft.serve.tracks.courses import Courses
from racecraft.sim.vehicle import load_vehicle

NAMES = tuple(f"Racer {number:02}" for number in range(13))


@pytest.fixture
def session(database: Database) -> Any:
    with database.transaction() as session:
        session.add_all(User(id=10 + number, name=name, handle=name.lower()) for number, name in enumerate(NAMES))
        session.add_all([Group(id=1, title="ours"), Group(id=2, title="theirs"), Job(id="j", kind="judge", run="")])
        session.flush()
        yield session


def race_of(session: Session, order: dict[int, int | None], **more: Any) -> Race:
    """A race that is over, with what each of some racers scored in it (ms)."""
    over = {"group_id": 1, "commitment": "c", "secret": "s", "closes": now() - timedelta(minutes=1)}
    race = Race(**{"owner_id": 1, "title": "r", "track": "oval", "ranking": "total", **over, **more})
    session.add(race)
    session.flush()
    for racer, score in order.items():
        digest = hashlib.sha256(f"{race.id} {racer}".encode()).hexdigest()
        result = {"score_ms": score, "best_lap_ms": score, "completion": 0.5, "judged": now(), "digest": digest}
        session.add(Submission(race_id=race.id, user_id=10 + racer, job_id="j", model="m", **result))
    session.flush()
    return race


def told(season: list[SeasonStanding]) -> list[tuple[int, int, int, int]]:
    """Of each racer number, points, races with points, and wins."""
    return [(one.user - 10, one.points, one.races, one.wins) for one in season]


def test_the_first_ten_have_points_and_others_only_their_place(session: Session) -> None:
    race_of(session, {number: 10_000 + 500 * number for number in range(12)} | {12: None})
    season = read_season(session, 1)
    assert told(season) == [
        *((number, points, 1, int(number == 0)) for number, points in enumerate((25, 18, 15, 12, 10, 8, 6, 4, 2, 1))),
        (10, 0, 0, 0),
        (11, 0, 0, 0),
    ]
    assert [one.results[0].place for one in season] == list(range(1, 13))
    assert [one.results[0].gap for one in season] == pytest.approx([number / 20 for number in range(12)])


def test_who_is_level_shares_a_place_and_its_points(session: Session) -> None:
    race_of(session, {0: 9000, 1: 9000, 2: 9500})
    assert told(read_season(session, 1)) == [(0, 25, 1, 1), (1, 25, 1, 1), (2, 15, 1, 0)]


def test_what_counts_is_what_is_over_under_a_secret_and_not_put_away(session: Session) -> None:
    counted = race_of(session, {0: 9000}, title="counts")
    race_of(session, {1: 9000}, closes=None)
    race_of(session, {1: 9000}, closes=now() + timedelta(hours=1))
    race_of(session, {1: 9000}, secret="")
    race_of(session, {1: 9000}, deleted=now())
    race_of(session, {1: 9000}, group_id=2)
    (only,) = read_season(session, 1)
    assert [(one.race, one.title, one.place) for one in only.results] == [(counted.id, "counts", 1)]


def final_of_two(session: Session, qualified: dict[int, int]) -> Race:
    """Racer 1 has won it and racer 0 lost; it follows a race that they were in, with such times in ms by racer."""
    qualifying = race_of(session, qualified)
    document = {"final": {"form": "bracket", "best": 2, "qualifying": "c"}}
    final = race_of(session, {}, after_id=qualifying.id, document=document)
    entered = {one.user_id - 10: one.id for one in session.query(Submission).filter_by(race_id=qualifying.id)}
    for seed, (racer, place) in enumerate(((0, 2), (1, 1)), start=1):
        session.add(Finalist(race_id=final.id, seed=seed, submission_id=entered[racer], place=place))
    session.flush()
    return final


def test_a_final_gives_the_points_of_its_qualifying(session: Session) -> None:
    final = final_of_two(session, {0: 9000, 1: 9900, 2: 10_000})
    season = read_season(session, 1)
    assert told(season) == [(1, 25, 1, 1), (0, 18, 1, 0), (2, 0, 0, 0)]
    assert [(one.race, one.place, one.points) for one in season[0].results] == [
        (final.after_id, 2, 0),
        (final.id, 1, 25),
    ]
    assert [one.gap for one in season[0].results] == [pytest.approx(0.1), None], "two who meet have no gap"
    final.deleted = now()
    session.flush()
    assert told(read_season(session, 1)) == [(0, 25, 1, 1), (1, 18, 1, 0), (2, 15, 1, 0)], "it leads nowhere any more"


def test_who_has_deleted_their_account_is_in_no_season_also_after_a_final(session: Session) -> None:
    final = final_of_two(session, {0: 9000, 1: 9900})
    winner = session.get_one(User, 11)
    winner.name, winner.handle, winner.deleted = "(gone 11)", None, now()
    session.flush()
    assert told(read_season(session, 1)) == [(0, 18, 1, 0)]
    rows = board_of(session, final, user_id=None, top=10).rows
    assert [(row.name, row.place) for row in rows] == [("(gone 11)", 1), ("Racer 00", 2)], "as it was driven"


def test_a_final_that_is_driven_once_more_says_that_its_board_is_not_the_last(database: Database) -> None:
    with database.transaction() as session:
        session.add_all(User(id=10 + number, name=NAMES[number], handle=NAMES[number]) for number in range(2))
        session.add_all(
            [Group(id=1, title="ours"), Job(id="j", kind="judge", run=""), Job(id="f", kind="final", run="")]
        )
        session.flush()
        final = final_of_two(session, {0: 9000, 1: 9900})
        final.document = {**final.document, "vehicle": vars(load_vehicle("v5"))}
        final.visibility, final.final_job_id, number = "public", "f", final.id
    league = League(database, lambda _: pytest.fail("nobody asks for a track"))
    for state, running in (("queued", 1), ("running", 1), ("done", 0), ("failed", 0)):
        with database.transaction() as session:
            session.get_one(Job, "f").state = state
        assert league.published(number, user_id=None)["running"] == running, state


def test_until_a_final_has_been_driven_once_more_its_last_places_count(database: Database, tmp_path: Path) -> None:
    with database.transaction() as session:
        session.add_all(User(id=10 + number, name=NAMES[number], handle=NAMES[number]) for number in range(2))
        session.add_all([Group(id=1, title="ours"), Job(id="j", kind="judge", run="", state="done")])
        session.flush()
        session.add(Member(group_id=1, user_id=10, role="organiser"))
        final = final_of_two(session, {0: 9000, 1: 9900})
        final.document = {**final.document, "vehicle": vars(load_vehicle("v5"))}
        number = final.id
    league = League(database, lambda _: pytest.fail("nobody asks for a track"))
    finals = Finals(database, tmp_path, lambda _: Courses(tmp_path), league)
    as_it_was = [(1, 25, 1, 1), (0, 18, 1, 0)]
    for state in ("failed", "failed", "running"):
        finals.hold(number, user_id=10)
        with database.transaction() as session:
            assert told(read_season(session, 1)) == as_it_was, "it is queued"
            job = session.get_one(Job, session.get_one(Race, number).final_job_id)
            job.state = state
            assert told(read_season(session, 1)) == as_it_was, state
    with database.transaction() as session:
        count(session, job.id, {"places": {"1": 1, "2": 2}})
        session.flush()
        assert told(read_season(session, 1)) == [(0, 25, 1, 1), (1, 18, 1, 0)], "racer 0 is the first seed"


def test_of_equals_who_has_won_more_leads_and_then_who_came_first(session: Session) -> None:
    race_of(session, {3: 9000, 4: 9100, 0: 9200, 5: 9300, 6: 9400})
    race_of(session, {7: 9000, 5: 9100, 4: 9200, 6: 9300, 0: 9400})
    season = told(read_season(session, 1))
    assert season == [
        (4, 18 + 15, 2, 0),
        (5, 12 + 18, 2, 0),
        (3, 25, 1, 1),
        (7, 25, 1, 1),
        (0, 15 + 10, 2, 0),
        (6, 10 + 12, 2, 0),
    ]


def test_a_stranger_is_told_of_the_latest_public_races_alone(session: Session) -> None:
    race_of(session, {0: 9000}, title="hidden")
    public = [race_of(session, {1: 9000}, visibility="public").id for _ in range(PUBLIC_RACES + 2)]
    (only,) = read_season(session, 1, public=True)
    assert [one.race for one in only.results] == public[2:]
    assert {one.user - 10 for one in read_season(session, 1)} == {0, 1}
    assert [len(one.results) for one in read_season(session, 1)] == [len(public), 1]
