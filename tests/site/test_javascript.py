"""Rewards in JavaScript against the same in Python, as an evaluation's rows have them."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from racecraft.reward import load_preset, make_params, preset_names
from racecraft.sim import Bots, Objects, Obstacles, Simulation
from racecraft.sim.columns import ROW_COLUMNS
from racecraft.sim.objects import NO_OBJECTS
from racecraft.site.javascript import NotTranslated, javascript
from racecraft.track import load_track

RUN = """const { rewards } = await import(process.argv[1]);
const { rows, waypoints } = JSON.parse(require("fs").readFileSync(0, "utf8"));
const pay = (reward, row) => { try { return reward(row, waypoints); } catch { return null; } };
const every = ({ make }) => {
  const made = Array.from({ length: 16 }, make);
  return rows.map((row, i) => pay(made[i % 16], row));
};
const paid = Object.entries(rewards).map(([name, reward]) => [name, every(reward)]);
console.log(JSON.stringify(Object.fromEntries(paid)));
"""
AMONG = Objects(obstacles=Obstacles(count=4, placement="random"), bots=Bots(count=3, speed=0.6))
ODD = """import math
LIMIT = 3

def turned(angle, by):
    return (angle + by) % 360.0 - 180.0 // 7

def reward_function(params):
    total = 0
    for i in range(1, 4):
        if i == 2:
            continue
        total += (i**2 + 1) / params["steps"]
    for i in range(3):
        total += i
    x, y = params["waypoints"][-1]
    low = min(x, y, -0.5) if not params["is_offtrack"] else -1
    total += max(0, params["speed"] - LIMIT) + (params["is_reversed"] and 2 or 5)
    return turned(-params["heading"], -90) + total + low
"""


EVERY_OBJECT = """def reward_function(params):
    total = len(params["objects_speed"]) + 0.5
    for distance in params["objects_distance"]:
        total += distance
    for x, y in params["objects_location"]:
        total += x * y
    if params["objects_heading"] and params["object_in_camera"]:
        total += params["objects_heading"][-1] + params["objects_speed"][-1]
    return total if not params["is_offtrack"] else -total
"""


def driven(objects: Objects) -> tuple[list[list[float]], list[list[tuple[float, float]]]]:
    track = load_track("hairpin")
    simulation = Simulation(track, num_envs=16, seed=3, camera=None, objects=objects, num_threads=1)
    rng = np.random.default_rng(3)
    rows = []
    for _ in range(25):
        simulation.step(rng.uniform((-0.5, 0.0), (0.5, 4.0), (16, 2)).astype(np.float32))
        rows += simulation.rows.tolist()
    return rows, [[(x, y) for x, y in one.waypoints.tolist()] for one in (track, track.reversed())]


@pytest.mark.parametrize("objects", [NO_OBJECTS, AMONG], ids=["alone", "among objects"])
def test_rewards_in_a_tab_pay_what_they_pay_in_python(tmp_path: Path, objects: Objects) -> None:
    node = shutil.which("node")
    if node is None:
        pytest.skip("Node is not installed")
    sources = {name: load_preset(name) for name in preset_names()}
    sources |= {"odd": ODD, "every": EVERY_OBJECT, "broken": ODD.replace("LIMIT)", "1 / 0)")}
    module = tmp_path / "rewards.mjs"
    module.write_text(javascript(sources), encoding="utf-8")
    rows, waypoints = driven(objects)
    command = [node, "-e", f"(async () => {{ {RUN} }})()", str(module)]
    told = json.dumps({"rows": rows, "waypoints": waypoints})
    done = subprocess.run(command, input=told, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[-2000:]
    found = json.loads(done.stdout)
    for name in (*preset_names(), "odd", "every"):
        spaces: list[dict[str, object]] = [{} for _ in range(16)]  # every car remembers for itself
        for space in spaces:
            exec(sources[name], space)
        paid = [
            spaces[index % 16]["reward_function"](make_params(row, waypoints)) if row[1] != 1.0 else 0.0  # type: ignore[operator]
            for index, row in enumerate(rows)
        ]
        np.testing.assert_allclose(found[name], paid, rtol=1e-13, atol=1e-15, err_msg=name)
        assert len(set(paid)) > 1 or name == "progress_pace", name
    assert all((paid is None) == (row[1] != 1.0) for paid, row in zip(found["broken"], rows, strict=True))


def test_commands_and_progress_in_a_tab_are_those_of_python_to_the_bit(tmp_path: Path) -> None:
    """The action space's own numbers, and 100 at the most."""
    node = shutil.which("node")
    if node is None:
        pytest.skip("Node is not installed")
    keys = ("steering_angle", "speed", "progress")
    angles, speeds = np.arange(-300, 301) / 10, (np.arange(601) % 391 + 10) / 100
    rows = np.zeros((601, len(ROW_COLUMNS)))
    rows[:, ROW_COLUMNS.index("steering_angle")] = np.radians(angles).astype(np.float32)
    rows[:, ROW_COLUMNS.index("speed")] = speeds.astype(np.float32)
    rows[:, ROW_COLUMNS.index("progress")] = np.linspace(-0.1, 1.1, 601)
    lines = [[(0.0, 0.0)]]
    module = tmp_path / "rewards.mjs"
    sources = {key: f"def reward_function(params):\n    return params['{key}']\n" for key in keys}
    module.write_text(javascript(sources), encoding="utf-8")
    command = [node, "-e", f"(async () => {{ {RUN} }})()", str(module)]
    told = json.dumps({"rows": rows.tolist(), "waypoints": lines})
    done = subprocess.run(command, input=told, capture_output=True, text=True, check=True)
    found = json.loads(done.stdout)
    params = [make_params(row, lines) for row in rows.tolist()]
    assert found == {key: [one[key] for one in params] for key in keys}
    assert found["steering_angle"] == angles.tolist()
    assert found["speed"] == speeds.tolist()
    assert max(found["progress"]) == 100.0


@pytest.mark.parametrize(
    ("line", "why"),
    [
        ("return sum([1.0])", "List"),
        ("params['x'] += 1", "not translated"),
        ("it = {1: 2}\n    return it[1]", "no plain words"),
        ("while True:\n        pass", "not translated"),
        ("return params['speed'].hex()", "calls"),
        ("return (lambda: 1)()", "calls"),
        ("import os\n    return 1", "not translated"),
        ("return 9007199254740993", "Constant"),
    ],
)
def test_what_is_not_translated_is_refused(line: str, why: str) -> None:
    with pytest.raises(NotTranslated, match=re.escape(why)):
        javascript({"own": f"def reward_function(params):\n    {line}\n"})
