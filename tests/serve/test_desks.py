"""Who has much computed at once delays their own, and nobody else."""

from __future__ import annotations

import asyncio
from pathlib import Path

import pytest
from fastapi.routing import APIRoute

from racecraft.serve.context import Computes, TakesPlace
from racecraft.serve.desks import EACH, TOGETHER, Desks
from racecraft.serve.driving import routes as driving
from racecraft.serve.evaluations import analysis, beliefs
from racecraft.serve.models import archives
from racecraft.serve.models import routes as models
from racecraft.serve.models.garage import REMOVED, Garage
from racecraft.serve.problems import Conflict
from racecraft.serve.rewards import routes as rewards
from racecraft.serve.store.database import Database
from racecraft.serve.submissions import routes as submissions
from racecraft.serve.tracks import routes as tracks

SLOW = (
    "POST /api/rewards/check",
    "GET /api/models/{name}/demonstration",
    "GET /api/models/{name}/evolution",
    "GET /api/models/{name}/evaluations/{stamp}/belief",
    "GET /api/models/{name}/evaluations/{stamp}/laps",
    "GET /api/models/{name}/evaluations/{stamp}/saliency",
    "GET /api/models/{name}/evaluations/{stamp}/share.html",
    "GET /api/models/{name}/evaluations/{stamp}/share.png",
    "GET /api/models/{name}/maps",
    "GET /api/models/{name}/report",
    "GET /api/boards/{race_id}/film",
    "POST /api/drives",
    "GET /api/tracks",
    "POST /api/tracks/validate",
    "POST /api/tracks/import",
    "GET /api/tracks/{name}",
    "GET /api/tracks/{name}/sketch",
    "GET /api/tracks/{name}/route.npy",
    "PUT /api/tracks/{name}",
    "POST /api/tracks/{name}/restore",
)
"""What is computed, or unpacked from many files, while somebody waits."""


async def hold(desks: Desks, who: int | None, seated: list[int | None], leave: asyncio.Event) -> None:
    async with desks.place(who):
        seated.append(who)
        await leave.wait()
        seated.remove(who)


async def settle() -> None:
    for _ in range(20):
        await asyncio.sleep(0)


def test_forty_of_one_leave_room_for_others_and_all_get_their_turn() -> None:
    async def scene() -> None:
        desks, leave, seated = Desks(), asyncio.Event(), list[int | None]()
        tasks = [asyncio.create_task(hold(desks, 1, seated, leave)) for _ in range(40)]
        await settle()
        assert seated == [1] * EACH
        tasks.append(asyncio.create_task(hold(desks, 2, seated, leave)))
        tasks.append(asyncio.create_task(hold(desks, None, seated, leave)))
        await settle()
        assert seated == [1] * EACH + [2, None]
        leave.set()
        await asyncio.gather(*tasks)
        assert seated == []

    asyncio.run(scene())


def test_all_together_leave_threads_to_what_is_quick() -> None:
    async def scene() -> None:
        desks, leave, seated = Desks(), asyncio.Event(), list[int | None]()
        tasks = [asyncio.create_task(hold(desks, who, seated, leave)) for who in range(40)]
        await settle()
        assert len(seated) == TOGETHER
        leave.set()
        await asyncio.gather(*tasks)

    asyncio.run(scene())


def test_who_gives_up_waiting_takes_no_place() -> None:
    async def scene() -> None:
        desks, leave, seated = Desks(), asyncio.Event(), list[int | None]()
        tasks = [asyncio.create_task(hold(desks, 1, seated, leave)) for _ in range(EACH + 1)]
        await settle()
        tasks.pop().cancel()
        await settle()
        leave.set()
        await asyncio.gather(*tasks)
        await asyncio.wait_for(hold(desks, 1, seated, leave), 60.0)

    asyncio.run(scene())


def test_what_is_computed_in_a_request_takes_a_place_and_a_film_of_it_a_job() -> None:
    routers = (rewards, models, beliefs, analysis, submissions, driving, tracks)
    needs = {
        f"{method} {route.path}": [dependency.dependency for dependency in route.dependencies]
        for module in routers
        for route in module.router.routes
        if isinstance(route, APIRoute)
        for method in route.methods
    }
    assert [label for label in SLOW if Computes.dependency not in needs[label]] == []
    assert TakesPlace.dependency in needs["POST /api/models/{name}/evolution"]


@pytest.fixture
def trash(tmp_path: Path) -> tuple[Garage, Path]:
    """Ada's garage, and where what she removes lies."""
    database = Database(f"sqlite:///{tmp_path / 'console.db'}")
    database.migrate()
    return Garage(tmp_path / "runs", tmp_path / "state", database, user_id=2), tmp_path / "state" / "trash"


def test_a_racers_trash_does_not_fill_the_disk(trash: tuple[Garage, Path], tmp_path: Path) -> None:
    garage, folder = trash
    for number in range(REMOVED + 3):
        made = tmp_path / "runs" / f"model-{number:02}"
        made.mkdir(parents=True)
        (made / "run.json").write_text("{}")
        garage.remove(made.name)
    assert sorted(path.name for path in folder.iterdir()) == [f"model-{number:02}" for number in range(3, REMOVED + 3)]


def test_an_upload_leaves_room_on_the_disk(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    archives.require_disk(tmp_path)
    monkeypatch.setattr(archives.shutil, "disk_usage", lambda _: type("Usage", (), {"free": archives.RESERVE - 1}))
    with pytest.raises(Conflict, match=r"1\.0 GB are left, 1 GB have to be"):
        archives.require_disk(tmp_path)
