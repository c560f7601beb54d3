"""Trainings among other cars: past selves, other runs, and the same weights to the bit after a kill."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tiny_runs import Recorder, Train, assert_same, logs, weights

from racecraft import training
from racecraft.errors import CheckpointError, ConfigError, RunError
from racecraft.learn import DistillConfig
from racecraft.run import RunFolder
from racecraft.sim import Simulation
from racecraft.sim.objects import NO_OBJECTS, Objects, Obstacles
from racecraft.track import load_track
from racecraft.training import resume
from racecraft.training.job import Training
from racecraft.training.opponent_pool import BESIDE_REACH, BESIDE_SPEED, CURRENT, OpponentPool
from racecraft.training.opponents import Opponents
from racecraft.training.regimes import DUEL

SELF = Opponents(cars=3, pool_size=4, snapshot_every=64)


def test_the_name_that_errors_recommend_is_there() -> None:
    assert training.Opponents is Opponents
    assert all(hasattr(training, name) for name in training.__all__)
    assert not hasattr(training, "Oponents")


@pytest.mark.costly
@pytest.mark.parametrize("cars", [2, 3])
def test_a_run_against_itself_killed_at_any_iteration_resumes_as_if_it_never_was(
    tiny: Train, tmp_path: Path, cars: int
) -> None:
    copies: list[Path] = []

    def copy(step: int) -> None:
        copies.append(tmp_path / "killed" / str(step))
        shutil.copytree(tmp_path / "runs" / "undisturbed", copies[-1])

    opponents = replace(SELF, cars=cars)
    settings = {"opponents": opponents, "until": "768 steps", "evaluate_every": 192, "actions": "default"}
    result = tiny(name="undisturbed", reporter=Recorder(copy), **settings)
    for path in copies[::3]:
        resumed = resume(path)
        assert resumed.steps == result.steps
        assert_same(path, result.run)
        assert logs(path) == logs(result.run)
    again = tiny(name="again", num_threads=2, **settings)
    assert_same(again.run, result.run)
    other = tiny(name="alone", until="768 steps", evaluate_every=192)
    name = "learning/policy.head.weight"
    assert (weights(other.run)[name] != weights(result.run)[name]).any()


@pytest.mark.costly
def test_a_taught_run_resumes_as_if_it_never_was_once_its_lessons_are_over(tiny: Train, tmp_path: Path) -> None:
    copies: dict[int, Path] = {}

    def copy(step: int) -> None:
        if step not in copies:  # a teacher's steps are none
            copies[step] = tmp_path / "killed" / str(step)
            shutil.copytree(tmp_path / "runs" / "undisturbed", copies[step])

    lessons = DistillConfig(num_envs=8, num_steps=8, teacher_steps=8192, student_steps=64, minibatch_size=32)
    settings: dict[str, Any] = {"opponents": replace(SELF, cars=2), "algorithm": "distill", "distill": lessons}
    result = tiny(name="undisturbed", reporter=Recorder(copy), until="1000 steps", evaluate_every=64, **settings)
    steps = [step for step in copies if 64 < step < result.steps]
    assert len(steps) >= 2
    for step in steps:
        resumed = resume(copies[step])
        assert resumed.steps == result.steps
        assert_same(copies[step], result.run)
    assert weights(result.run)["teacher/learning/policy.head.weight"].any()


@pytest.mark.costly
def test_the_pool_spans_the_training_evenly(tiny: Train) -> None:
    result = tiny(name="pool", opponents=SELF, until="1600 steps", evaluate_every=1600)
    saved = weights(result.run)
    interval, *steps = saved["opponents/steps"].tolist()
    assert interval > 64
    assert len(steps) <= 4
    assert np.ptp(np.diff(steps)) <= interval
    assert steps[-1] > 1600 - 2 * interval
    drivers = saved["opponents/drivers"]
    assert drivers.shape == (24,)
    assert set(drivers.tolist()) <= {CURRENT, *range(len(steps))}
    assert len(set(drivers.tolist())) > 1
    kept = {name.split("/")[1] for name in saved if name.startswith("opponents/") and name.count("/") == 2}
    assert kept == {str(i) for i in range(len(steps))}
    assert (saved["opponents/0/policy.head.weight"] != saved["learning/policy.head.weight"]).any()


def test_the_learner_meets_every_place_of_the_grid(tiny: Train) -> None:
    seen: list[OpponentPool] = []
    roads: list[bool] = []

    class Watch(Training):
        def _train(self, session):  # type: ignore[no-untyped-def]
            seen.append(session.opponents)
            roads.append(session.environment.goes_on)
            return super()._train(session)

    result = tiny(name="watch", opponents=SELF, until="64 steps", evaluate_every=64)
    Watch(RunFolder.open(result.run), until=training.Until(steps=128)).run()
    assert (seen[0].own % 3).tolist() == [0, 1, 2, 0, 1, 2, 0, 1]
    assert (seen[0].own // 3).tolist() == list(range(8))
    assert roads == [True]  # no place of the lap is the last to a learner


def races(opponents: Opponents, *, objects: Objects = NO_OBJECTS, seed: int = 3) -> Simulation:
    simulation = Simulation(
        load_track("oval"),
        num_envs=60 * opponents.cars,
        cars_per_race=opponents.cars,
        start=DUEL.start,
        objects=objects,
        seed=seed,
    )
    OpponentPool(opponents, simulation, None, seed=seed)  # type: ignore[arg-type]  # nobody drives here
    return simulation


def test_half_of_the_races_of_two_begin_rolling_side_by_side() -> None:
    simulation = races(Opponents())
    speed = simulation.vehicles[3].reshape(60, 2)
    offset, place = (simulation.column(name).reshape(60, 2) for name in ("offset", "projection_distance"))
    rolls = speed[:, 0] > 0.0
    assert 20 <= rolls.sum() <= 40
    assert (speed[:, 0] == speed[:, 1]).all()
    assert speed.max() <= BESIDE_SPEED
    assert (offset[rolls, 0] * offset[rolls, 1] < 0.0).all()
    length = simulation.tracks[0].length
    gap = (place[rolls, 1] - place[rolls, 0] + 0.5 * length) % length - 0.5 * length
    assert np.abs(gap).max() <= BESIDE_REACH + 0.2  # a lane's metres are not those of the centre line
    assert gap.min() < -0.3
    assert gap.max() > 0.3
    simulation.step(np.tile(np.float32([0.0, 2.0]), (120, 1)))
    assert not simulation.terminated.any()
    assert (races(Opponents()).column("x") == races(Opponents()).column("x")).all()


@pytest.mark.parametrize(
    ("opponents", "objects"),
    [
        (Opponents(beside_share=0.0), NO_OBJECTS),
        (Opponents(cars=3), NO_OBJECTS),
        (Opponents(), Objects(obstacles=Obstacles(count=2))),
    ],
)
def test_other_races_begin_on_the_grid(opponents, objects) -> None:
    simulation = races(opponents, objects=objects)
    assert (simulation.vehicles[3] == 0.0).all()


@pytest.mark.costly
def test_other_runs_drive_the_other_cars(tiny: Train) -> None:
    first = tiny(name="first", until="128 steps", evaluate_every=64)
    opponents = Opponents(drivers=(str(first.run), str(first.run)), cars=3)
    result = tiny(name="second", opponents=opponents, until="256 steps", evaluate_every=128)
    drivers = weights(result.run)["opponents/drivers"]
    assert set(drivers.tolist()) == {0, 1}
    assert Training(RunFolder.open(result.run)).settings.opponents == opponents
    shutil.rmtree(first.run)
    with pytest.raises(RunError, match="first"):
        resume(result.run, until="320 steps")


@pytest.mark.costly
def test_a_checkpoint_of_other_races_is_refused(tiny: Train) -> None:
    result = tiny(name="damaged", opponents=SELF, until="128 steps", evaluate_every=128)
    folder = RunFolder.open(result.run)
    saved = folder.checkpoints.load("last")
    for name, array in (
        ("opponents/drivers", np.zeros(23, np.int32)),
        ("opponents/drivers", np.full(24, 7, np.int32)),
        ("opponents/drivers", None),
    ):
        arrays = {key: value for key, value in saved.arrays.items() if key != name}
        if array is not None:
            arrays[name] = array
        folder.checkpoints.save(saved.step, arrays, metadata=saved.metadata, metrics={}, score=None)
        with pytest.raises(CheckpointError):
            resume(result.run, until="192 steps")


@pytest.mark.parametrize(
    "settings",
    [
        {"cars": 1},
        {"cars": 9},
        {"cars": True},
        {"pool_size": 1},
        {"snapshot_every": 0},
        {"current_share": 1.5},
        {"current_share": "half"},
        {"beside_share": -0.1},
        {"drivers": ()},
        {"drivers": "self"},
        {"drivers": ("self", "runs/a")},
        {"drivers": (3,)},
    ],
)
def test_opponents_that_cannot_be_are_refused(settings) -> None:
    with pytest.raises(ConfigError, match="opponents"):
        Opponents(**settings)


def test_opponents_of_another_kind_are_refused(tiny: Train) -> None:
    with pytest.raises(ConfigError, match=r"Opponents\(\.\.\.\)"):
        tiny(opponents="self")
    with pytest.raises(RunError, match="no run"):
        tiny(opponents=Opponents(drivers=("runs/nowhere",)))
