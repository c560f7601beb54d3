"""Reward functions in the style of what people write run unchanged, on real driving, and remember what they remember.

`functions/` holds them: look-ahead, racing lines, pacing, gates, numpy, prints, old habits and every way to keep state
between calls. Each is called for every row of several cars on several tracks, in the worker, and beside it as AWS
would: one car, one process of its own, one call after another.
"""

from __future__ import annotations

import contextlib
import io
import random
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from racecraft.race.autopilot import Autopilot
from racecraft.reward import RewardWorker, check_reward, keeps_state, make_params, situations
from racecraft.reward.worker import waypoints_of
from racecraft.sim import ROW_COLUMNS, STATUS_NAMES, Simulation, Start
from racecraft.track import Track, load_track

FUNCTIONS = sorted((Path(__file__).parent / "functions").glob("*.py"))
TRACKS = ("reinvent_2018", "bowtie", "oval")
CARS = 6  # two on each track: the autopilot, and one that wanders off and begins again
SEED = 5


def source_of(path: Path) -> str:
    return path.read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def tracks() -> list[Track]:
    return [load_track(name) for name in TRACKS]


@pytest.fixture(scope="module")
def steps(tracks: list[Track]) -> list[np.ndarray]:
    """The judged rows (CARS, columns) of every step until all autopilots have done their lap."""
    cars = Simulation(
        tracks, num_envs=CARS, camera=None, start=Start(mode="fixed"), direction="alternate", num_threads=1
    )
    autopilot, rng = Autopilot(speed=3.0), np.random.default_rng(SEED)
    lapping, found = np.zeros(CARS, bool), []
    lapping[: len(tracks)] = True
    ended = []
    while lapping.any():
        actions = autopilot(cars.state)
        actions[len(tracks) :] += rng.normal((0.2, 0.5), (0.3, 1.0), (len(tracks), 2)).astype(np.float32)
        cars.step(actions)
        found.append(cars.rows.copy())
        ended += [STATUS_NAMES[int(status)] for status in cars.column("status")[cars.terminated]]
        reversed_laps = cars.terminated & (cars.column("is_reversed") > 0.0)
        lapping &= ~reversed_laps  # a lap each way
        cars.reset(cars.terminated)
    assert ended.count("lap_complete") >= 2 * len(tracks)
    assert ended.count("off_track") >= 2 * len(tracks)
    return found


def test_there_are_many_of_them():
    assert len(FUNCTIONS) >= 30
    assert sum(keeps_state(source_of(path)) for path in FUNCTIONS) >= 10


@pytest.mark.parametrize("path", FUNCTIONS, ids=lambda path: path.stem)
def test_it_is_accepted(path: Path):
    assert [problem for problem in check_reward(source_of(path)) if problem.severity == "error"] == []


@pytest.mark.costly
@pytest.mark.parametrize("path", FUNCTIONS, ids=lambda path: path.stem)
def test_it_drives_and_remembers_as_in_a_process_per_car(path: Path, tracks: list[Track], steps: list[np.ndarray]):
    source = source_of(path)
    assert keeps_state(source) == source.lstrip().startswith("'''Keeps state")
    with RewardWorker(source, tracks, seed=SEED, num_cars=CARS if keeps_state(source) else 1) as worker:
        rewards = np.stack([worker(rows) for rows in steps])
        rehearsed = worker(rehearsal(tracks))
    assert np.isfinite(rewards).all()
    assert np.isfinite(rehearsed).all()
    assert len(np.unique(rewards)) > 1
    expected = one_process_per_car(source, waypoints_of(tracks), steps)
    assert np.array_equal(rewards, expected)


def rehearsal(tracks: list[Track]) -> np.ndarray:
    """The situations of the dry run on the first track, as rows of a simulation with all of them."""
    rows = np.stack([situation.row for situation in situations(tracks[0])])
    rows[:, ROW_COLUMNS.index("track_index")] *= len(tracks)
    return rows


def one_process_per_car(source: str, waypoints: Any, steps: list[np.ndarray]) -> np.ndarray:
    """Rewards (T, CARS) of the source loaded once for every car."""
    before = random.getstate()
    random.seed(SEED)
    try:
        with contextlib.redirect_stdout(io.StringIO()):
            functions = [load(source, f"car_{car}") for car in range(CARS)]
            rewards = [
                [float(call(make_params(row, waypoints))) for call, row in zip(functions, rows, strict=True)]
                for rows in (step.tolist() for step in steps)
            ]
            return np.array(rewards)
    finally:
        random.setstate(before)


def load(source: str, name: str) -> Callable[[dict[str, Any]], Any]:
    namespace: dict[str, Any] = {"__name__": name}
    if "dataclass" in source:  # which looks up its module by name
        import sys
        import types

        module = types.ModuleType(name)
        sys.modules[name] = module
        namespace = module.__dict__
    exec(compile(source, name, "exec", dont_inherit=True), namespace)
    return namespace["reward_function"]
