"""Races of several cars on one road: grid, penalties, who wins, replays; and the worst of them end by the rules."""

from __future__ import annotations

import itertools
import random
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from racecraft.agent.sensor_suite import SensorSuite
from racecraft.contest.classification import classify
from racecraft.contest.contest import race_together
from racecraft.contest.terms import shared_road
from racecraft.errors import ConfigError
from racecraft.race import Autopilot, Conditions, Evaluation, RaceRules, Trial
from racecraft.race.placement import ROOM, Pose, clear_pose
from racecraft.race.rules import RESET_STATUSES
from racecraft.replay import Replay, verify
from racecraft.sim import Bots, CameraSpec, Objects, Obstacles
from racecraft.sim.columns import STATUS_NAMES
from racecraft.sim.objects import NO_OBJECTS
from racecraft.sim.views import RACER_COLORS, CarView
from racecraft.track import Track, generate_track, load_track

OVAL = load_track("oval")


class Blind:
    """Goes straight, or wherever chance says."""

    sees = "state"

    def __init__(self, seed: int | None = None, *, speed: float = 4.0) -> None:
        self._chance = None if seed is None else np.random.default_rng(seed)
        self._speed = speed

    def __call__(self, state: np.ndarray) -> np.ndarray:
        if self._chance is None:
            return np.float32([[0.0, self._speed]])
        return self._chance.uniform([-0.5, 0.1], [0.5, 4.0], (len(state), 2)).astype(np.float32)


def conditions(num_cars: int, track: Track = OVAL, *, objects: Objects = NO_OBJECTS, **rules: Any) -> Conditions:
    return shared_road(Conditions(track=track, rules=RaceRules(**{"laps": 1, **rules}), objects=objects), num_cars)


def race(drivers: list[Any], **settings: Any) -> tuple[Conditions, tuple[Trial, ...]]:
    given = conditions(len(drivers), **settings)
    return given, race_together(drivers, given, num_threads=1)


def test_the_faster_car_behind_pays_for_the_crash_and_the_one_ahead_drives_on() -> None:
    slow, fast = Autopilot(speed=0.8), Autopilot(speed=3.0)
    given, (ahead, behind) = race([slow, fast], laps=2, collision_penalty=3.0)
    assert sum(lap.crash_count for lap in ahead.laps) == 0
    crashes = sum(lap.crash_count for lap in behind.laps)
    assert crashes >= 1
    assert sum(lap.penalty_seconds for lap in behind.laps) == pytest.approx(3.0 * crashes)
    statuses = behind.recording.statuses
    for step in (i for i, status in enumerate(statuses) if status == "crashed"):
        assert statuses[step + 1 : step + 46] == ["pause"] * 45  # 3 s at 15 steps a second
        assert statuses[step + 46] != "pause"
    assert ahead.is_finished
    assert behind.is_finished
    assert verify(_replay(given, (ahead, behind)), num_threads=1).is_genuine


def test_all_cars_drive_the_same_distance_and_the_fastest_wins() -> None:
    drivers = [Autopilot(speed=1.0), Autopilot(speed=1.5), Autopilot(speed=2.0)]
    given, trials = race(drivers[::-1])  # the fastest in front: nobody meets
    assert [trial.laps[0].crash_count for trial in trials] == [0, 0, 0]
    assert [standing.car for standing in classify([[trial] for trial in trials], ranks_all=True)] == [0, 1, 2]
    for car, trial in enumerate(trials):  # a film shows the others in their colours, also if it is cut
        others = [color for number, color in enumerate(RACER_COLORS[:3]) if number != car]
        for recording in (trial.recording, trial.recording.until(2.0), trial.recording.lap(1)):
            assert [view.color for view in recording.objects(3) if isinstance(view, CarView)] == others
    for trial in trials:
        moved = np.diff(trial.recording.poses[:, :2], axis=0)
        assert np.hypot(*moved.T).sum() == pytest.approx(OVAL.length, rel=0.06)
        assert trial.recording.distances[-1] == 1.0
    found = verify(_replay(given, trials), num_threads=2)
    assert found.difference is None


def test_the_grid_is_staggered() -> None:
    _, trials = race([Autopilot(speed=1.0)] * 4, time_limit=1.0)
    places = [trial.recording.column("projection_distance")[0] for trial in trials]
    gaps = [(ahead - behind) % OVAL.length for ahead, behind in itertools.pairwise(places)]
    assert gaps == pytest.approx([0.75] * 3, abs=0.05)
    sides = [np.sign(trial.recording.column("offset")[0]) for trial in trials]
    assert sides == [-sides[1], sides[1], -sides[1], sides[1]]


def test_who_finishes_leaves_the_road_to_the_others() -> None:
    _given, (winner, second) = race([Autopilot(speed=2.5), Autopilot(speed=1.0)])
    steps = len(winner.recording)
    assert len(second.recording) > steps
    assert len(second.recording.objects(steps - 5)) == 1
    assert second.recording.objects(steps + 5) == []


def test_time_is_up_for_everybody_at_once_and_distance_counts() -> None:
    _, trials = race([Autopilot(speed=1.0), Blind(), Autopilot(speed=0.5)], time_limit=6.0, max_resets=1000)
    assert {trial.status for trial in trials} == {"time_up"}
    assert len({len(trial.recording) for trial in trials}) == 1
    order = [standing.car for standing in classify([[trial] for trial in trials], ranks_all=True)]
    assert order == sorted(range(3), key=lambda car: -trials[car].completion)


def test_two_that_are_put_back_at_once_do_not_stand_in_each_other() -> None:
    others = np.array([OVAL.point_at(3.0), OVAL.point_at(3.1), OVAL.point_at(2.6)])
    x, y = OVAL.point_at(3.0).tolist()
    found = clear_pose(OVAL, Pose(x, y, 0.0), others)
    assert np.hypot(others[:, 0] - found.x, others[:, 1] - found.y).min() >= ROOM
    s, offset = OVAL.project(np.array([found.x, found.y]))
    assert float(s) < 3.0
    assert abs(float(offset)) == pytest.approx(0.25 * OVAL.widths[0], abs=0.02)
    ahead = OVAL.point_at(3.3)[None]  # in the way by less than a step of the search
    found = clear_pose(OVAL, Pose(*OVAL.point_at(3.0), 0.0), ahead)
    assert float(OVAL.project(np.array([found.x, found.y]))[0]) == pytest.approx(2.75, abs=0.02)
    here = Pose(x, y, 0.3)
    assert clear_pose(OVAL, here, np.zeros((0, 2))) == here
    everywhere = OVAL.point_at(np.arange(0.0, OVAL.length, 0.1))
    assert clear_pose(OVAL, here, everywhere) == here  # no room anywhere: where it was to be


def test_several_laps_need_a_circuit_and_drivers_a_place_each() -> None:
    with pytest.raises(ConfigError, match="no circuit"):
        conditions(2, load_track("straight"), laps=2)
    with pytest.raises(ConfigError, match="3 drivers"):
        race_together([Blind()] * 3, conditions(2))


class Watcher:
    """Remembers what it is shown, and drives in circles."""

    def __init__(self, *names: str) -> None:
        self.sensors = SensorSuite(names)
        self.shown: list[np.ndarray] = []

    def __call__(self, sight: np.ndarray) -> np.ndarray:
        self.shown.append(sight.copy())
        return np.float32([[0.3, 1.5]])


def test_every_car_sees_through_its_own_sensors() -> None:
    field = [
        Watcher("FRONT_FACING_CAMERA"),
        Watcher("STEREO_CAMERAS", "LIDAR"),
        Watcher("LEFT_CAMERA"),
        Autopilot(speed=1.5),
    ]
    given = replace(conditions(4, max_resets=2, time_limit=15.0), camera=CameraSpec())
    trials = race_together(field, given, num_threads=1)
    assert [driver.shown[0].shape for driver in field[:3]] == [
        (1, 120, 160),
        (1, 2 * 120 * 160 + 64),
        (1, 120, 160),
    ]
    blind = race_together([Same(trial) for trial in trials], replace(given, camera=None), num_threads=1)
    for trial, again in zip(trials, blind, strict=True):  # what is seen does not change what happens
        assert np.array_equal(trial.recording.rows, again.recording.rows)
    assert sum(lap.resets for trial in trials for lap in trial.laps) > 0  # the eyes went along
    assert verify(_replay(given, trials), num_threads=1).is_genuine

    again = Watcher("FRONT_FACING_CAMERA")
    race_together([again, *(Same(trial) for trial in trials[1:])], given, num_threads=1)
    for first, second in zip(field[0].shown, again.shown, strict=True):
        assert np.array_equal(first, second)


class Same:
    """Does what another did."""

    sees = "state"

    def __init__(self, trial: Trial) -> None:
        recording = trial.recording
        self._actions = iter(recording.actions[np.array(recording.statuses) != "prepare"])

    def __call__(self, state: np.ndarray) -> np.ndarray:
        return next(self._actions, np.zeros(2, dtype=np.float32))[None]


# ---- the worst


def hostile(seed: int) -> tuple[Conditions, list[Any]]:
    """A race nobody should hold."""
    chance = random.Random(seed)
    num_cars = chance.randint(1, 8)
    crowd = tuple((chance.choice([0.0, 0.001, 0.02, 0.999, chance.random()]), chance.choice([1, -1])) for _ in range(8))
    objects = Objects(
        obstacles=chance.choice(
            [None, Obstacles(count=8, placement="fixed", positions=crowd), Obstacles(count=6, placement="random")]
        ),
        bots=chance.choice(
            [None, Bots(count=3, speed=6.0, changes_lane=True, placement="random"), Bots(count=2, speed=0.0)]
        ),
    )
    track = chance.choice([OVAL, load_track("straight"), load_track("hairpin"), generate_track(seed, width=0.5)])
    drivers = [
        chance.choice([Blind(seed + car), Blind(), Autopilot(speed=chance.uniform(0.5, 4.0)), Blind(speed=0.0)])
        for car in range(num_cars)
    ]
    rules = {
        "max_resets": chance.choice([0, 1, 5]),
        "time_limit": chance.choice([5.0, 15.0]),
        "collision_penalty": chance.choice([0.0, 1.0, 5.0]),
        "offtrack_penalty": chance.choice([0.0, 2.0]),
        "mercy_after": chance.choice([0, 1, 3]),
        "direction": chance.choice(["forward", "reverse"]),
    }
    return conditions(num_cars, track, objects=objects, **rules), drivers


def ends_by_the_rules(seed: int) -> None:
    given, drivers = hostile(seed)
    trials = race_together(drivers, given, num_threads=1)
    rules = given.rules
    for trial in trials:
        recording = trial.recording
        assert np.isfinite(recording.rows).all()
        assert recording.clock[-1] <= rules.time_limit + 0.07
        assert trial.status in ("lap_complete", "time_up", *RESET_STATUSES)
        mistakes = sum(status in RESET_STATUSES for status in recording.statuses)
        resets = sum(lap.resets for lap in trial.laps)
        assert resets <= rules.max_resets
        assert mistakes == resets + (trial.status in RESET_STATUSES)
        assert 0.0 <= trial.completion <= 1.0
        assert set(recording.statuses) <= set(STATUS_NAMES)
    found = verify(_replay(given, trials), num_threads=1)
    assert found.difference is None, found.difference


@pytest.mark.parametrize("seed", range(12))
def test_hostile_races_end_by_the_rules(seed: int) -> None:
    ends_by_the_rules(seed)


@pytest.mark.slow
def test_two_hundred_hostile_races_end_by_the_rules() -> None:
    for seed in range(12, 200):
        ends_by_the_rules(seed)


def _replay(given: Conditions, trials: tuple[Trial, ...]) -> Replay:
    names = tuple(f"car {trial.index + 1}" for trial in trials)
    return Replay.of(Evaluation(conditions=given, trials=trials), names=names)
