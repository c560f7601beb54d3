"""What tabs share: points of the curves are read once for all that stand at the same place."""

from __future__ import annotations

import asyncio
import json
import time
from collections.abc import Collection
from contextlib import ExitStack
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest

from racecraft.serve.door import guard
from racecraft.serve.jobs.queue import JobQueue
from racecraft.serve.live.cars import LiveReader, Look
from racecraft.serve.people.keys import Keys
from racecraft.serve.streams import hub as hub_module
from racecraft.serve.streams.hub import Hub


@pytest.fixture
def history(tmp_path: Path) -> Path:
    path = tmp_path / "car" / "metrics" / "history.jsonl"
    path.parent.mkdir(parents=True)
    path.write_text("")
    return path


@pytest.fixture
def hub(tmp_path: Path) -> Hub:
    return Hub(tmp_path, cast(JobQueue, None))  # nobody asks for jobs here


def line(step: int, text: str = "") -> str:
    return json.dumps({"kind": "note", "step": step, "seconds": 0.0, "text": text}) + "\n"


def points(found: tuple[int, bytes] | None) -> list[Any]:
    assert found is not None
    data = next(line for line in found[1].decode().splitlines() if line.startswith("data: "))
    return cast("list[Any]", json.loads(data.removeprefix("data: ")))


def test_tabs_at_one_place_are_given_the_same_bytes_and_one_ahead_nothing(hub: Hub, history: Path) -> None:
    async def look() -> None:
        assert await hub.points("car", after=0) is None
        hub._seen.clear()
        history.write_text(line(1) + line(2))
        first, second = await asyncio.gather(hub.points("car", after=0), hub.points("car", after=0))
        assert first is not None
        assert first is second
        assert [point["step"] for point in points(first)] == [1, 2]
        assert await hub.points("car", after=first[0]) is None

    asyncio.run(look())


def test_new_points_come_after_a_moment(hub: Hub, history: Path) -> None:
    async def look() -> None:
        history.write_text(line(1))
        first = await hub.points("car", after=0)
        assert first is not None
        assert await hub.points("car", after=first[0]) is None
        with history.open("a") as file:
            file.write(line(2))
        await asyncio.sleep(hub_module.FRESH)
        assert [point["step"] for point in points(await hub.points("car", after=first[0]))] == [2]

    asyncio.run(look())


def test_a_long_history_is_not_kept_in_memory(hub: Hub, history: Path) -> None:
    async def look() -> None:
        history.write_text("".join(line(step, "x" * 1000) for step in range(100)))
        assert len(points(await hub.points("car", after=0))) == 100
        assert hub._seen["car"].points == {}

    asyncio.run(look())


class Moments:
    """Stands for a training whose cars move between any two looks."""

    is_live = True

    def __init__(self) -> None:
        self.number = 0

    def look(self, *, after: int) -> Look:
        self.number += 2
        poses, frame = np.full((64, 6), 3.141, np.float32), np.full((120, 160), 7, np.uint8)
        steps, objects, policy = np.full(64, 100, np.int32), np.zeros((0, 4), np.float32), np.full(10, 0.1, np.float32)
        return Look(sequence=self.number, step=9, poses=poses, steps=steps, objects=objects, policy=policy,
                    is_discrete=True, frame=frame)  # fmt: skip


def test_pictures_are_apart_from_poses_and_made_less_often(hub: Hub, monkeypatch: pytest.MonkeyPatch) -> None:
    now = 100.0
    monkeypatch.setattr(time, "monotonic", lambda: now)
    assert hub.eye("car", after=-1) is None
    hub._of("car").reader = cast(LiveReader, Moments())
    first = hub.live("car", after=-1)
    assert first is not None
    assert len(first[1]) <= 3000
    assert b"frame" not in first[1]
    picture = hub.eye("car", after=-1)
    assert picture is not None
    assert picture[0] == first[0]
    assert len(picture[1]) > 120 * 160
    assert hub.live("car", after=first[0]) is None, "who looks a moment later is given the same"
    now += 0.1
    hub.live("car", after=first[0])
    assert hub.eye("car", after=picture[0]) is None
    now += 0.25
    later = hub.eye("car", after=picture[0])
    assert later is not None
    assert later[0] == first[0] + 2


class Doorkeeper:
    """Stands for the keys of a league: counts how often it is asked."""

    def __init__(self) -> None:
        self.good, self.asked = {"one", "two"}, 0

    def open_sessions(self, secrets: Collection[str]) -> set[str]:
        self.asked += 1
        return self.good & set(secrets)


def test_a_hundred_tabs_cost_one_question_and_who_is_put_out_leaves(monkeypatch: pytest.MonkeyPatch) -> None:
    now = 100.0
    monkeypatch.setattr(time, "monotonic", lambda: now)
    keys = Doorkeeper()

    async def look() -> None:
        nonlocal now
        listeners = guard.Listeners(cast(Keys, keys))
        tabs = ["one", "two"] * 50
        with ExitStack() as stack:
            for secret in tabs:
                stack.enter_context(listeners.one_more(secret))
            assert all(await asyncio.gather(*map(listeners.may_stay, tabs)))
            assert keys.asked == 1
            keys.good.remove("two")
            now += guard.LOOK
            assert await asyncio.gather(*map(listeners.may_stay, tabs)) == [True, False] * 50
            assert keys.asked == 2
        assert not listeners._here

    asyncio.run(look())
