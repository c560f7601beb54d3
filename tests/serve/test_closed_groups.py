"""A class at the end of its year: renamed, closed and opened again by who organises it, with all that it has kept."""

from __future__ import annotations

from collections.abc import Iterator
from datetime import timedelta
from typing import Any

import pytest
import sqlalchemy as sa
from leagues import RunningLeague, ok, refused, running_league

from racecraft.serve.groups.groups import Groups, require_open
from racecraft.serve.problems import Conflict
from racecraft.serve.store.database import Database
from racecraft.serve.store.tables import Group, Invitation, Member, User, now

RACE = {"title": "Friday cup", "track": "oval", "laps": 1}


@pytest.fixture(scope="module")
def league(tmp_path_factory: pytest.TempPathFactory) -> Iterator[RunningLeague]:
    with running_league(tmp_path_factory.mktemp("closed") / "runs") as league:
        yield league


def titles(client: Any) -> list[tuple[str, bool]]:
    return [(one["title"], one["closed"] is not None) for one in ok(client.get("/api/groups"))]


@pytest.mark.costly
def test_a_class_is_closed_when_its_races_are_over_and_keeps_what_it_has(league: RunningLeague) -> None:
    teacher = league.organiser("Ms Frizzle")
    group, _ = league.group("Class 7b", teacher), league.group("Class 8a", teacher)
    code = league.code(group, teacher)
    ada = league.join(code, "Ada")
    race = ok(teacher.post(f"/api/groups/{group}/races", json=RACE), 201)["id"]
    path = f"/api/groups/{group}"

    assert "'Friday cup'" in refused(teacher.patch(path, json={"is_closed": True}), 409)
    assert ok(teacher.get(path))["closed"] is None
    ok(teacher.patch(f"/api/league/races/{race}", json={"closes": "2026-01-01T00:00:00Z"}), 422)
    ok(teacher.delete(f"/api/league/races/{race}"), 204)
    ok(teacher.patch(path, json={"title": " Class 7b, 2026 ", "is_closed": True}), 204)
    assert titles(teacher) == [("Class 8a", False), ("Class 7b, 2026", True)]
    assert titles(ada) == [("Class 7b, 2026", True)]

    told = ok(ada.get(path))
    assert (told["title"], told["joining"], told["racers"]) == ("Class 7b, 2026", None, 1)
    since = told["closed"]
    ok(teacher.patch(path, json={"is_closed": True}), 204)
    assert ok(ada.get(path))["closed"] == since, "closed once"
    for what in ("models", "lessons", "quota", "season"):
        ok(teacher.get(f"{path}/{what}"))
    with league.stranger() as stranger:
        assert "no such code" in refused(stranger.post("/api/door/join", json={"code": code, "name": "Bob"}), 401)
    closed = "The group is closed."
    assert refused(teacher.post(f"{path}/joining", json={}), 409) == closed
    assert refused(teacher.post(f"{path}/members", json={"people": [{"name": "Bob"}]}), 409) == closed
    assert refused(teacher.post(f"{path}/races", json=RACE), 409) == closed
    assert ok(teacher.get("/api/league/races")) == []
    ok(teacher.post(f"{path}/cards", json={"members": [league.number(ada)]}), 201)

    ok(teacher.patch(path, json={"is_closed": False}), 204)
    assert ok(teacher.get(path))["joining"] is None, "the code that was on the wall stays worthless"
    ok(teacher.post(f"{path}/races", json=RACE), 201)


@pytest.mark.costly
def test_what_is_done_to_a_group_is_in_the_audit_log(league: RunningLeague) -> None:
    group = league.group("Class 9c")
    ok(league.owner.patch(f"/api/groups/{group}", json={"title": "Class 10c", "is_closed": True}), 204)
    line = ok(league.owner.get("/api/audit?what=change_group"))[0]
    assert (line["target"], line["is_done"]) == (f"/api/groups/{group}", True)
    assert line["details"] == {"title": "Class 10c", "is_closed": True}


@pytest.mark.parametrize("title", ["", "  ", "x" * 101, None, 7])
@pytest.mark.costly
def test_a_title_that_is_none_is_refused_and_none_leaves_it(league: RunningLeague, title: Any) -> None:
    group = league.group("Class 5d")
    reply = league.owner.patch(f"/api/groups/{group}", json={"title": title})
    assert reply.status_code == (204 if title is None else 422), reply.text
    assert ok(league.owner.get(f"/api/groups/{group}"))["title"] == "Class 5d"


def test_who_types_a_code_at_the_moment_of_closing_is_in_or_not_and_nothing_else(database: Database) -> None:
    groups = Groups(database)
    with database.transaction() as session:
        session.add_all([Group(id=1, title="Class"), User(id=2, name="Bob", handle="bob")])
    code = groups.open(1, role="racer", uses=5, hours=1).code
    groups.change(1, is_closed=True)
    with database.transaction() as session:  # as who has read the code before it was gone
        session.add(Invitation(code=code, group_id=1, role="racer", uses_left=5, expires=now() + timedelta(days=1)))
    for come in (
        lambda: groups.join(code, "Ada"),
        lambda: groups.join_on(code, 2),
        lambda: groups.add(1, [("Eve", "")]),
    ):
        with pytest.raises(Conflict, match="closed"):
            come()
    with pytest.raises(Conflict, match="closed"):
        groups.welcome("Zoe", ("https://school.example", "7"), group_id=1, real_name="")
    with database.transaction() as session:
        assert session.scalar(sa.select(sa.func.count()).select_from(Member)) == 0
        assert session.scalars(sa.select(User.name).where(User.id > 2)).all() == []
        with pytest.raises(Conflict):
            require_open(session, 1)
