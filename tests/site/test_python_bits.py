"""Python in the page against the installed program: the same rewards, the same weights, the same sentences.

Node runs the files that the page ships, in Pyodide from its package; see test_core_bits.py for what it needs.
"""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from test_core_bits import PLAIN, SEED, in_node, trained

from racecraft.errors import RewardError
from racecraft.reward import RewardWorker, check_reward, dry_run, keeps_state, situations
from racecraft.sim import Bots, Objects, Obstacles
from racecraft.site.__main__ import python_files
from racecraft.site.plan import packed, plan, track_file
from racecraft.track import load_track

pytestmark = pytest.mark.slow
PYODIDE = Path(__file__).parents[2] / "web/node_modules/pyodide/pyodide.mjs"
TRACK = "reinvent_2018"

REMEMBERS = """import random

before = {}
calls = 0


def reward_function(params):
    global calls
    calls += 1
    gained = params["progress"] - before.get("progress", 0.0)
    before["progress"] = params["progress"]
    here, there = (params["waypoints"][index] for index in params["closest_waypoints"])
    share = params["distance_from_center"] / params["track_width"]
    straight = (there[0] - here[0]) * 0.25 + (there[1] - here[1]) ** 2
    return max(1.0 - share, 0.001) + gained * 0.1 + random.random() * straight + calls / 1000
"""
FAILS = """def reward_function(params):
    print("seen", params["steps"])
    if params["steps"] > 80:
        return {}["faster"]
    return params["speed"]
"""
BROKEN = {
    "fails": FAILS,
    "none": "def reward_function(params):\n    if params['speed'] < 0:\n        return 1\n",
    "huge": "def reward_function(params):\n    return 10 ** 400\n",
    "text": "def reward_function(params):\n    reward = 'much'\n    return reward\n",
    "at once": "values = []\nvalues[3]\ndef reward_function(params):\n    return 1.0\n",
    "leaves": "def reward_function(params):\n    raise SystemExit(3)\n",
    "deep": "def reward_function(params):\n    return reward_function(params)\n",
}
CHECKED = {
    "good": "def reward_function(params):\n    return params['speed']\n",
    "remembers": """import math

def reward_function(params):
    global before
    if params["steps"] <= 2:
        before = params["progress"]
    gained = math.sqrt(params["progress"] - before + 1)
    before = params["progress"]
    return gained
""",
    "syntax": "def reward_function(params)\n    return 1\n",
    "key": "def reward_function(params):\n    return params['sped']\n",
    "module": "import socket\nimport js\ndef reward_function(params):\n    return 1.0\n",
    "empty": "",
    "two megabytes": "def reward_function(params):\n    return 1.0\n" + "#" * 2_000_000,
}
AMONG = {
    "object-avoidance": Objects(obstacles=Obstacles(count=5, placement="even")),
    "head-to-bot": Objects(bots=Bots(count=2, placement="random", speed=0.7, changes_lane=True)),
}
LOOKS_OUT = """def reward_function(params):
    behind, ahead = params["closest_objects"]
    x, y = params["objects_location"][ahead]
    away = abs(params["x"] - x) + abs(params["y"] - y)
    hit = params["is_crashed"] * 10.0
    return params["objects_distance"][ahead] + away + behind + params["objects_speed"][behind] - hit
"""
MANY_PRINTS = """def reward_function(params):
    for number in range(20_000):
        print(number)
    return 1.0
"""


@pytest.fixture(scope="module")
def rows() -> np.ndarray[Any, Any]:
    return np.stack([situation.row for situation in situations(load_track(TRACK))])


def among(race: str) -> dict[str, Any]:
    """What the page is told of a race's objects."""
    told = plan()
    about = {name: told[name] for name in ("vehicle", "statuses", "objectColumns")}
    return {**about, "objects": AMONG[race].to_dict(), "trials": told["races"][race]["trials"]}


@pytest.fixture(scope="module")
def native() -> tuple[dict[str, Any], dict[str, Any]]:
    """A training paid by REMEMBERS, in its own process."""
    track = load_track(TRACK)
    with RewardWorker(REMEMBERS, track, seed=SEED, num_cars=PLAIN.num_envs) as worker:
        return trained("plain", worker)


@pytest.fixture(scope="module")
def found(native: Any, rows: Any, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    if not PYODIDE.exists():
        pytest.skip("Pyodide is not installed: make site")
    track = {key: value for key, value in track_file(TRACK).items() if key in ("waypoints", "situations")}
    case, _ = native
    asked = {"what": "ask", "rows": packed(rows), "count": len(rows), "track": track, "seed": SEED}
    cases = [
        {**case, "pay": {**track, "source": REMEMBERS}, "files": python_files()},
        *({**asked, "source": source} for source in (REMEMBERS, MANY_PRINTS, *BROKEN.values())),
        *({"what": "check", "source": source, "track": track} for source in CHECKED.values()),
        {"what": "check", "source": "import numpy as np\n" + CHECKED["good"], "track": track},
        *({"what": "check", "source": LOOKS_OUT, "track": track_file(TRACK), "among": among(race)} for race in AMONG),
    ]
    training, remembers, prints, *rest = in_node("core", cases, tmp_path_factory.mktemp("python"))["results"]
    rest, told = rest[: -len(AMONG)], rest[-len(AMONG) :]
    return {
        "among": dict(zip(AMONG, told, strict=True)),
        "training": training,
        "remembers": remembers,
        "prints": prints,
        "numpy": rest.pop(),
        "broken": dict(zip(BROKEN, rest, strict=False)),
        "checked": dict(zip(CHECKED, rest[len(BROKEN) :], strict=True)),
    }


def test_a_training_with_a_reward_of_ones_own_learns_the_native_weights(found: Any, native: Any) -> None:
    assert keeps_state(REMEMBERS)
    _, learned = native
    assert found["training"] == learned


def test_rows_are_paid_to_the_bit(found: Any, rows: Any) -> None:
    with RewardWorker(REMEMBERS, load_track(TRACK), seed=SEED, num_cars=len(rows)) as worker:
        rewards = worker(rows)
    assert found["remembers"]["rewards"] == hashlib.sha256(rewards.tobytes()).hexdigest()


@pytest.mark.parametrize("name", BROKEN)
def test_a_failure_is_told_in_the_same_sentences(found: Any, rows: Any, name: str) -> None:
    with (
        pytest.raises(RewardError) as native,
        RewardWorker(BROKEN[name], load_track(TRACK), seed=SEED) as worker,
    ):
        worker(rows)
    assert found["broken"][name] == {"sentence": str(native.value)}


@pytest.mark.parametrize("name", CHECKED)
def test_a_check_finds_the_same_problems(found: Any, name: str) -> None:
    ours = [[p.line, p.column, p.severity, p.message, p.hint] for p in check_reward(CHECKED[name])]
    theirs = found["checked"][name]
    assert [[p["line"], p["column"], p["severity"], p["message"], p["hint"]] for p in theirs["problems"]] == ours
    assert theirs["ok"] == (name in ("good", "remembers"))


@pytest.mark.parametrize("name", ["good", "remembers"])
def test_situations_are_paid_as_in_a_dry_run(found: Any, name: str) -> None:
    tried = dry_run(CHECKED[name], load_track(TRACK))
    theirs = found["checked"][name]["situations"]
    assert [[one["name"], one["reward"]] for one in theirs] == [[one.situation.name, one.reward] for one in tried]


@pytest.mark.parametrize("race", AMONG)
def test_a_reward_is_tried_among_the_objects_of_its_race(found: Any, race: str) -> None:
    tried = dry_run(LOOKS_OUT, load_track(TRACK), objects=AMONG[race])
    theirs = found["among"][race]
    assert theirs["ok"], theirs["problems"]
    assert [one["name"] for one in theirs["situations"]] == [one.situation.name for one in tried]
    for told, ours in zip(theirs["moments"], tried, strict=True):
        np.testing.assert_allclose(told["row"], ours.situation.row, rtol=0, atol=1e-9, err_msg=told["name"])
    for told, ours in zip(theirs["situations"], tried, strict=True):
        assert told["reward"] == pytest.approx(ours.reward, abs=1e-8), told["name"]


def test_hundreds_of_thousands_of_prints_leave_the_last_of_them(found: Any) -> None:
    printed = found["prints"]["printed"]
    assert len(printed) <= 64 * 1024
    assert printed.endswith("19998\n19999\n")


def test_a_package_that_the_page_has_not_names_the_installed_program(found: Any) -> None:
    [problem] = found["numpy"]["problems"]
    assert (problem["line"], problem["column"]) == (1, 1)
    assert "the installed program" in problem["hint"]
