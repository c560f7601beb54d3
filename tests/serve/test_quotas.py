"""What racers and groups may use: whose word counts, what is refused with which sentence, what ends with it."""

from __future__ import annotations

import asyncio
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from datetime import timedelta
from pathlib import Path
from typing import Any

import pytest
from leagues import ok, refused, running_league

from racecraft.serve.jobs.queue import JobQueue
from racecraft.serve.problems import Conflict
from racecraft.serve.quotas.quotas import DEFAULT, Limits, Quotas
from racecraft.serve.store.database import Database
from racecraft.serve.store.tables import Group, Job, Member, User, now

ADA, BOB, TEACHER = 2, 3, 4
CLASS, CLUB = 1, 2


@pytest.fixture
def database(database_url: str) -> Iterator[Database]:
    database = Database(database_url)
    database.migrate()
    with database.transaction() as session:
        for number, name in ((ADA, "ada"), (BOB, "bob"), (TEACHER, "teacher")):
            role = "organiser" if number == TEACHER else "racer"
            session.add(User(id=number, name=name, handle=name, role=role))
        session.add_all([Group(id=CLASS, title="class"), Group(id=CLUB, title="club")])
        session.flush()
        session.add_all([Member(group_id=CLASS, user_id=user, is_home=True) for user in (ADA, BOB)])
    yield database
    database.close()


@pytest.fixture
def quotas(database: Database, tmp_path: Path) -> Quotas:
    return Quotas(database, tmp_path)


def trained(database: Database, user: int, minutes: float, **values: Any) -> str:
    queue = JobQueue(database, user_id=user)
    job = queue.add("train", "run", {})
    with database.transaction() as session:
        row = session.get_one(Job, job.id)
        for name, value in {"state": "done", "finished": now(), "used": 60.0 * minutes, **values}.items():
            setattr(row, name, value)
    return job.id


def leave_home(database: Database, user: int) -> None:
    with database.transaction() as session:
        session.get_one(Member, (CLASS, user)).is_home = False


def test_the_nearest_word_counts_and_no_other_group_gives_or_takes_any(database: Database, quotas: Quotas) -> None:
    assert quotas.limits(ADA) == DEFAULT
    quotas.say("everybody", Limits(minutes=60, models=20))
    assert quotas.limits(ADA) == Limits(minutes=60, models=20, places=DEFAULT.places)
    quotas.say("each", Limits(minutes=10), CLASS)
    assert quotas.limits(ADA).minutes == 10
    with database.transaction() as session:
        session.add(Member(group_id=CLUB, user_id=ADA))
    assert quotas.limits(ADA).minutes == 10, "the club says nothing"
    for minutes in (30, 0):
        quotas.say("each", Limits(minutes=minutes), CLUB)
        assert quotas.limits(ADA).minutes == 10, "who organises the club is nobody to Ada"
    quotas.say("each", Limits(minutes=30), CLUB)
    leave_home(database, ADA)
    assert (quotas.limits(ADA).minutes, quotas.limits(BOB).minutes) == (30, 10), "who has no home has all of them"
    quotas.say("person", Limits(minutes=5), ADA)
    assert quotas.limits(ADA) == Limits(minutes=5, models=20, places=DEFAULT.places)
    assert quotas.limits(TEACHER) == quotas.limits(1) == Limits()


def test_many_at_once_have_to_fit(database: Database, quotas: Quotas) -> None:
    quotas.say("person", Limits(minutes=5, places=4), ADA)
    trained(database, ADA, 0.0, state="queued", finished=None)
    quotas.require(ADA, "places", "minutes", count=3)
    with pytest.raises(Conflict, match="4 jobs at once, and this takes 4 more"):
        quotas.require(ADA, "places", "minutes", count=4)
    quotas.require(ADA, "minutes", count=100)
    quotas.say("group", Limits(models=2), CLASS)
    quotas.require(ADA, "models", count=2)
    with pytest.raises(Conflict, match="models of your group"):
        quotas.require(ADA, "models", count=3)


def test_minutes_are_those_of_a_day_with_the_ones_that_run(database: Database, quotas: Quotas) -> None:
    trained(database, ADA, 4.0)
    trained(database, ADA, 9.0, finished=now() - timedelta(hours=25))
    trained(database, ADA, 1.0, state="running", finished=None, held_since=now() - timedelta(minutes=2))
    trained(database, BOB, 20.0)
    assert quotas.usage([ADA]).minutes == pytest.approx(7.0, abs=0.2)
    quotas.say("each", Limits(minutes=8), CLASS)
    quotas.require(ADA, "minutes")
    quotas.say("each", Limits(minutes=7), CLASS)
    with pytest.raises(Conflict, match="You have 7 minutes of training a day, and they are used up"):
        quotas.require(ADA, "places", "minutes")
    quotas.require(TEACHER, "minutes")


def test_what_a_group_has_together_ends_for_all_of_it(database: Database, quotas: Quotas) -> None:
    trained(database, BOB, 20.0)
    quotas.say("group", Limits(minutes=20), CLASS)
    with pytest.raises(Conflict, match="All the minutes of training a day of your group are used up"):
        quotas.require(ADA, "minutes")
    with database.transaction() as session:
        session.add(Member(group_id=CLUB, user_id=ADA))
    with pytest.raises(Conflict, match="of your group are used up"):
        quotas.require(ADA, "minutes")  # the club has some, which are not for who came in by another group
    leave_home(database, ADA)
    quotas.require(ADA, "minutes")


def test_guests_use_nothing_of_what_a_group_has_together(database: Database, quotas: Quotas) -> None:
    with database.transaction() as session:
        session.add_all([Member(group_id=CLUB, user_id=user) for user in (ADA, BOB)])
    quotas.say("group", Limits(minutes=20), CLUB)
    trained(database, BOB, 20.0)
    assert quotas.usage_together(CLUB).minutes == 0.0
    leave_home(database, ADA)
    quotas.require(ADA, "minutes")
    leave_home(database, BOB)
    assert quotas.usage_together(CLUB).minutes == pytest.approx(20.0)
    quotas.say("group", Limits(minutes=10), CLASS)
    with pytest.raises(Conflict, match="of your group are used up"):
        quotas.require(ADA, "minutes")


def test_of_two_who_share_what_their_groups_may_use_one_comes_first(database: Database, quotas: Quotas) -> None:
    with database.transaction() as session:
        session.add_all([Member(group_id=CLUB, user_id=user) for user in (BOB, ADA)])
    for group in (CLASS, CLUB):
        quotas.say("group", Limits(places=3), group)

    async def ask(user: int) -> bool:
        async with quotas.turn(user):
            try:
                await asyncio.to_thread(quotas.require, user, "places")
            except Conflict:
                return False
            await asyncio.sleep(0.02)  # as a request that makes something takes its time
            await asyncio.to_thread(trained, database, user, 0.0, state="queued", finished=None)
            return True

    async def ask_all() -> list[bool]:
        return await asyncio.wait_for(asyncio.gather(*(ask(user) for user in 5 * (ADA, BOB))), 20.0)

    assert sum(asyncio.run(ask_all())) == 3
    assert quotas.usage([ADA, BOB]).places == 3


def test_who_shares_nothing_does_not_wait_for_others(database: Database, quotas: Quotas) -> None:
    quotas.say("each", Limits(places=3), CLASS)

    async def both() -> None:
        async with quotas.turn(ADA), quotas.turn(BOB):
            pass

    asyncio.run(asyncio.wait_for(both(), 20.0))


def test_trainings_of_who_has_no_minutes_left_are_stopped(database: Database, quotas: Quotas) -> None:
    held = now() - timedelta(minutes=6)
    running = trained(database, ADA, 0.0, state="running", finished=None, held_since=held)
    waiting = trained(database, ADA, 0.0, state="queued", finished=None)
    other = trained(database, BOB, 0.0, state="running", finished=None, held_since=held)
    quotas.end_what_is_over()
    with database.transaction() as session:
        assert not session.get_one(Job, running).is_cancelled
    quotas.say("person", Limits(minutes=6), ADA)
    quotas.end_what_is_over()
    with database.transaction() as session:
        rows = [session.get_one(Job, job) for job in (running, waiting, other)]
        assert [(row.state, row.is_cancelled) for row in rows] == [
            ("running", True),  # its worker hears of it, and saves it
            ("cancelled", True),
            ("running", False),
        ]


@pytest.mark.costly
def test_who_may_say_what_and_what_is_refused_by_it(tmp_path: Path) -> None:
    with running_league(tmp_path / "runs", "--trainings", "0") as league:
        teacher = league.organiser("Teacher")
        group = league.group("5b", teacher)
        ada = league.join(league.code(group, teacher), "Ada")
        number = league.number(ada)
        ok(ada.post("/api/models", json={"name": "first", "train": False}), 201)
        ok(teacher.put(f"/api/groups/{group}/quota", json={"models": 2, "places": 1}), 204)
        assert ok(ada.get("/api/quota"))["limits"] == {"minutes": None, "models": 2, "places": 1}
        ok(ada.post("/api/models", json={"name": "second"}), 201)  # and waits for its training
        for path in ("/api/models", "/api/models/starters/quick", "/api/models/first/clone"):
            assert "You have 2 models" in refused(ada.post(path, json={}), 409), path
        heat = {"models": [{"model": "first"}] * 2, "track": "oval"}
        bodies: dict[str, dict[str, Any]] = {
            "/api/models/first/train": {},
            "/api/models/first/evaluations": {},
            "/api/models/first/tunings": {"minutes": 1},
            "/api/contests/heats": heat,
        }
        for path, body in bodies.items():
            assert "You have 1 jobs at once" in refused(ada.post(path, json=body), 409), path
        ok(teacher.put(f"/api/groups/{group}/members/{number}/quota", json={"models": 3, "minutes": 30}), 204)
        ok(ada.post("/api/models", json={"name": "third", "train": False}), 201)
        seen = ok(teacher.get(f"/api/groups/{group}/quota"))
        assert seen["racers"] == [
            {
                "id": number,
                "said": {"minutes": 30, "models": 3, "places": None},
                "limits": {"minutes": 30, "models": 3, "places": 1},
                "used": {"minutes": 0.0, "models": 3, "places": 1},
            }
        ]
        ok(teacher.put(f"/api/groups/{group}/members/{number}/quota", json={"models": 4, "minutes": 30}), 204)
        with ThreadPoolExecutor(6) as pool:  # one of them fits, whichever comes first
            asked = [pool.submit(ada.post, "/api/models", json={"train": False}) for _ in range(6)]
            answers = sorted(one.result().status_code for one in asked)
        assert answers == [201] + 5 * [409]
        assert ok(ada.get("/api/quota"))["used"]["models"] == 4
        bob = league.join(league.code(group, teacher), "Bob")
        ok(league.owner.put(f"/api/quotas/groups/{group}", json={"models": 5}), 204)
        ok(teacher.put(f"/api/groups/{group}/quota", json={"models": 9}), 204)
        ok(teacher.put(f"/api/groups/{group}/members/{number}/quota", json={"models": 9, "minutes": 0}), 204)
        with ThreadPoolExecutor(2) as pool:  # of several people's too
            asked = [pool.submit(one.post, "/api/models", json={"train": False}) for one in 3 * (ada, bob)]
            answers = sorted(one.result().status_code for one in asked)
        assert answers == [201] + 5 * [409]
        league.console.wait_for(lambda: ok(ada.get("/api/jobs"))[0]["state"] == "cancelled")
        assert "0 minutes of training" in refused(ada.post("/api/models/first/train", json={}), 409)
        for client, path in ((ada, f"/api/groups/{group}/quota"), (teacher, "/api/quotas")):
            refused(client.put(path, json={"models": 9}), 404)
        refused(league.owner.put("/api/quotas/groups/999", json={"minutes": 1}), 404)
        ok(league.owner.put(f"/api/quotas/groups/{group}", json={"minutes": 90}), 204)
        assert ok(teacher.get(f"/api/groups/{group}/quota"))["together"]["minutes"] == 90
        ok(teacher.post("/api/models", json={"name": "unlimited", "train": False}), 201)
