"""Boxes and bot cars are in the picture of a training and of a race, where the simulator has them."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
from browsers import Visit, needs_browser, needs_pages, visiting
from running_consoles import running_console

from racecraft.replay.replay import read_replay
from racecraft.run import RunFolder
from racecraft.sim.columns import OBJECT_COLUMNS, OBJECT_HEADER, ROW_COLUMNS

pytestmark = [pytest.mark.slow, needs_pages, needs_browser]


@pytest.fixture(scope="module")
def visit(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Visit]:
    with running_console(tmp_path_factory.mktemp("console") / "runs") as console, visiting(console) as tab:
        yield tab
        assert tab.complaints == []


@pytest.mark.parametrize(
    ("race", "count", "seen"),
    [("object-avoidance", 3, ("3", "0")), ("head-to-bot", 2, ("0", "2"))],
)
def test_what_is_on_the_road_is_seen_live_and_again_in_the_replay(
    visit: Visit, race: str, count: int, seen: tuple[str, str]
) -> None:
    console = visit.console
    console.create(name=race, track="oval", race=race, objects=count, until="10 minutes", seed=1, algorithm="ppo")
    page = visit.open(f"/models/{race}/watch")
    there = f"canvas[data-boxes='{seen[0]}'][data-bots='{seen[1]}']"
    page.locator(there).wait_for()
    job = console.client.get("/api/jobs", params={"run": race}).json()[0]
    console.wait_for(lambda: console.client.get(f"/api/models/{race}").json()["steps"])
    console.client.post(f"/api/models/{race}/stop")
    console.wait_for(console.job_ended(job["id"]))

    request = {"laps": 1, "num_trials": 2, "rules": "first_lap"}
    job = console.client.post(f"/api/models/{race}/evaluations", json=request).json()
    assert console.wait_for(console.job_ended(job["id"]))["state"] == "done"
    page = visit.open(f"/models/{race}/race")
    page.locator(there).wait_for()
    stamp = console.client.get(f"/api/models/{race}/evaluations").json()[0]["stamp"]
    laps = console.client.get(f"/api/models/{race}/evaluations/{stamp}/laps").json()["laps"]
    replay = read_replay(RunFolder(console.runs / race).evaluation(stamp) / "evaluation.replay")
    assert [len(lap["objects"]) for lap in laps] == [count] * len(laps) != []
    for lap, car in zip(laps, replay.cars, strict=True):
        table = car.recording.rows[:, len(ROW_COLUMNS) + len(OBJECT_HEADER) :]
        table = table.reshape(len(table), count, len(OBJECT_COLUMNS))
        for index, thing in enumerate(lap["objects"]):
            where = np.column_stack([thing["x"], thing["y"]])
            assert (len(where) == 1) == (race == "object-avoidance")
            expected = table[:, index, 1:3] if len(where) > 1 else table[:1, index, 1:3]
            np.testing.assert_allclose(where, expected, atol=1e-3)

    # nobody trains any more: the best car drives its lap among them, also after a reload
    lap = console.client.get(f"/api/models/{race}/demonstration").json()
    assert [len(thing["x"]) for thing in lap["objects"]] == [1 if seen[0] != "0" else len(lap["poses"])] * count
    page = visit.open(f"/models/{race}/watch")
    for _ in range(2):
        page.get_by_text("The best car").wait_for()
        page.locator(there).wait_for()
        page.reload()


def test_what_is_on_the_road_is_seen_in_the_film_of_a_race(visit: Visit) -> None:
    console = visit.console
    console.create(name="ada", track="oval", until="1000 steps", seed=1)
    (job,) = console.client.get("/api/jobs", params={"run": "ada"}).json()
    assert console.wait_for(console.job_ended(job["id"]))["state"] == "done"
    models = [{"model": "ada"}, {"model": "ada", "checkpoint": "last"}]
    heat = {"models": models, "track": "oval", "objects": "bots", "count": 2, "max_resets": 0}
    ladder = {"models": models, "tracks": ["oval"], "kind": "object-avoidance", "starts": 1}
    driven = {}
    for room, request in (("heats", heat), ("ladders", ladder)):
        reply = console.client.post(f"/api/contests/{room}", json=request)
        assert reply.status_code == 202, reply.text
        driven[room] = reply.json()["id"]
    for contest in driven.values():
        assert console.wait_for(console.job_ended(contest))["state"] == "done"

    page = visit.open(f"/contests/{driven['heats']}")
    page.locator("canvas[data-boxes='0'][data-bots='2']").wait_for()
    assert page.get_by_text("Each car drove alone.").count() == 0  # all share the road

    page = visit.open(f"/contests/{driven['ladders']}")
    page.get_by_role("button", name="Watch: ").click()
    page.locator("canvas[data-boxes='6'][data-bots='0']").wait_for()
    cars = page.locator(".stage li button")
    names = [cars.nth(index).locator("span").first.inner_text() for index in (0, 1)]
    for index in (1, 0):
        cars.nth(index).click()
        page.get_by_text(f"Boxes and bot cars are where {names[index]} met them").wait_for()
    page.locator("canvas[data-boxes='6'][data-bots='0']").wait_for()
