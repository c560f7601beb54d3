"""Rewards in JavaScript against the same in Python, as an evaluation's rows have them."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from racecraft.reward import load_preset, make_params
from racecraft.reward.numeric import NotNumeric
from racecraft.sim import Simulation
from racecraft.site.javascript import javascript
from racecraft.track import load_track

RUN = """const { rewards } = await import(process.argv[1]);
const { rows, waypoints } = JSON.parse(require("fs").readFileSync(0, "utf8"));
const pay = (reward, row) => { try { return reward(row, waypoints); } catch { return null; } };
const paid = Object.entries(rewards).map(([name, reward]) => [name, rows.map((row) => pay(reward, row))]);
console.log(JSON.stringify(Object.fromEntries(paid)));
"""
NUMERIC = ("anti_zigzag", "centerline", "heading", "progress_pace", "racing", "speed_gate", "stay_inside")
ODD = """import math
LIMIT = 3

def turned(angle, by):
    return (angle + by) % 360.0 - 180.0 // 7

def reward_function(params):
    total = 0
    for i in range(1, 4):
        if i == 2:
            continue
        total += i**2 / params["steps"]
    x, y = params["waypoints"][-1]
    low = min(x, y, -0.5) if not params["is_offtrack"] else -1
    total += max(0, params["speed"] - LIMIT) + (params["is_reversed"] and 2 or 5)
    return turned(-params["heading"], -90) + total + low
"""


def driven() -> tuple[list[list[float]], list[list[tuple[float, float]]]]:
    track = load_track("hairpin")
    simulation = Simulation(track, num_envs=16, seed=3, camera=None, num_threads=1)
    rng = np.random.default_rng(3)
    rows = []
    for _ in range(25):
        simulation.step(rng.uniform((-0.5, 0.0), (0.5, 4.0), (16, 2)).astype(np.float32))
        rows += simulation.rows.tolist()
    return rows, [[(x, y) for x, y in one.waypoints.tolist()] for one in (track, track.reversed())]


def test_rewards_in_a_tab_pay_what_they_pay_in_python(tmp_path: Path) -> None:
    node = shutil.which("node")
    if node is None:
        pytest.skip("Node is not installed")
    sources = {**{name: load_preset(name) for name in NUMERIC}, "odd": ODD, "broken": ODD.replace("LIMIT)", "1 / 0)")}
    module = tmp_path / "rewards.mjs"
    module.write_text(javascript(sources), encoding="utf-8")
    rows, waypoints = driven()
    command = [node, "-e", f"(async () => {{ {RUN} }})()", str(module)]
    told = json.dumps({"rows": rows, "waypoints": waypoints})
    done = subprocess.run(command, input=told, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[-2000:]
    found = json.loads(done.stdout)
    for name in (*NUMERIC, "odd"):
        space: dict[str, object] = {}
        exec(sources[name], space)
        reward = space["reward_function"]
        expected = [0.0 if row[1] == 1.0 else float(reward(make_params(row, waypoints))) for row in rows]  # type: ignore[operator]
        np.testing.assert_allclose(found[name], expected, rtol=1e-13, atol=1e-15, err_msg=name)
        assert len(set(expected)) > 1 or name == "progress_pace", name
    assert all((paid is None) == (row[1] != 1.0) for paid, row in zip(found["broken"], rows, strict=True))


@pytest.mark.parametrize(
    ("line", "why"),
    [
        ("return params", "as a whole"),
        ("return sum([1.0])", "List"),
        ("while True:\n        pass", "not translated"),
        ("return params['speed'].hex()", "calls"),
        ("return (lambda: 1)()", "calls"),
        ("import os\n    return 1", "not translated"),
    ],
)
def test_what_is_not_numeric_is_refused(line: str, why: str) -> None:
    with pytest.raises(NotNumeric, match=re.escape(why)):
        javascript({"own": f"def reward_function(params):\n    {line}\n"})


def test_every_preset_that_keeps_nothing_is_offered() -> None:
    def is_offered(name: str) -> bool:
        try:
            javascript({name: load_preset(name)})
        except NotNumeric:
            return False
        return True

    assert all(map(is_offered, NUMERIC))
    assert not is_offered("touring")  # it remembers the step before
