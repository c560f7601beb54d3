"""Where races start: nobody knows beforehand, everybody alike, each trial elsewhere, and never exactly on the line."""

from __future__ import annotations

import itertools
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from racecraft.agent.sensor_suite import SensorSuite
from racecraft.contest.contest import Contest, hold_race, race_together
from racecraft.contest.terms import race_terms, shared_road
from racecraft.errors import NonFiniteAction
from racecraft.race import RULE_SETS, Autopilot, Conditions, Evaluation, RaceRules, Trial, evaluate
from racecraft.race.entry import Entry
from racecraft.race.placement import driven_track
from racecraft.race.rules import RACE_STARTS, race_rules
from racecraft.replay import Replay, read_replay, verify, write_replay
from racecraft.sim import CameraSpec, Objects, Obstacles
from racecraft.track import Track, load_track

OVAL = load_track("oval")


def driven(track: Track = OVAL, **settings: Any) -> Evaluation:
    rules = race_rules("drfc", {"laps": 1, **settings.pop("rules", {})})
    given = {"num_trials": 5, "seed": 7, "sees": "state", "num_threads": 1, **settings}
    return evaluate(Autopilot(), track, rules=rules, **given)


def starts(evaluation: Evaluation) -> np.ndarray:
    """Fraction of the lap, m to the left and rad from straight ahead, of every trial  (N, 3)."""
    track, found = driven_track(evaluation.track, evaluation.rules), []
    for trial in evaluation.trials:
        x, y, heading = trial.recording.poses[0]
        s, offset = track.project(np.array([x, y]))
        turn = (heading - float(track.heading_at(float(s))) + np.pi) % (2 * np.pi) - np.pi
        found.append((float(s) / track.length, float(offset), turn))
    return np.array(found)


@pytest.mark.parametrize("direction", ["forward", "reverse"])
def test_trials_start_all_over_the_lap_a_little_off_and_none_on_the_line(direction: str) -> None:
    found = np.concatenate(
        [
            starts(driven(num_trials=40, seed=seed, rules={"direction": direction, "time_limit": 0.2}))
            for seed in range(5)
        ]
    )
    places, offsets, turns = found.T
    headings = np.unwrap(OVAL.heading_at(OVAL.arc_length[:-1]))
    bend = np.abs(np.diff(headings)).max()
    assert np.histogram(places, bins=8, range=(0.0, 1.0))[0].min() >= 12  # of 25 to be expected
    for values, limit in ((offsets, RACE_STARTS["lateral_jitter"]), (turns, RACE_STARTS["heading_jitter"])):
        assert np.quantile(np.abs(values), 0.9) <= limit + 0.001
        assert np.abs(values).max() <= limit + bend  # beside a waypoint another segment may be the nearest
        assert values.max() > 0.8 * limit
        assert values.min() < -0.8 * limit
        assert abs(np.median(values)) < 0.3 * limit
    first = found[::40]  # trial 0 is as any other
    assert (np.abs(first[:, 1]) > 1e-3).all()
    assert len(np.unique(first[:, 0].round(3))) == 5


def test_equal_seeds_are_equal_to_the_bit_and_others_are_other_races() -> None:
    one, same, other = (driven(seed=seed) for seed in (7, 7, 8))
    for trial, again in zip(one.trials, same.trials, strict=True):
        assert np.array_equal(trial.recording.rows, again.recording.rows)
    assert not set(map(tuple, starts(one).round(6))) & set(map(tuple, starts(other).round(6)))
    assert len({trial.lap_times for trial in one.trials}) > 1  # where one starts is worth something
    # the seed decides with all of its bits
    high = [starts(driven(seed=seed, num_trials=1))[0, 0] for seed in (7, 7 + 2**32, 7 + 2**63)]
    assert len(set(high)) == 3


def test_a_trial_does_not_depend_on_how_many_there_are() -> None:
    few, many = driven(num_trials=2), driven(num_trials=9)
    for trial in range(2):
        assert np.array_equal(few.trials[trial].recording.rows, many.trials[trial].recording.rows)


def test_a_lap_ends_where_it_began_and_is_a_whole_one() -> None:
    evaluation = driven(rules={"laps": 2})
    flying = [trial.lap_times[1] for trial in evaluation.trials]
    assert max(flying) - min(flying) < 0.2  # from wherever, a flying lap is a lap
    for trial, (place, _, _) in zip(evaluation.trials, starts(evaluation), strict=True):
        assert trial.is_finished
        rows = trial.recording
        assert rows.column("progress")[0] == pytest.approx(0.14 / OVAL.length, abs=0.002)
        ends = [step for step, status in enumerate(rows.statuses) if status == "lap_complete"]
        for end in ends:
            s, _ = OVAL.project(rows.poses[end, :2])
            assert abs((float(s) / OVAL.length - place + 0.5) % 1.0 - 0.5) < 0.02


def test_standing_laps_each_start_elsewhere_and_count_on() -> None:
    evaluation = driven(rules={"laps": 3, "is_continuous": False})
    for trial in evaluation.trials:
        recording = trial.recording
        begins = [step for step, status in enumerate(recording.statuses) if status == "prepare"]
        assert recording.column("lap")[begins].tolist() == [0.0, 1.0, 2.0]
        places = [float(OVAL.project(recording.poses[step, :2])[0]) for step in begins]
        assert min(abs(one - other) for one, other in itertools.combinations(places, 2)) > 0.01
        assert len(trial.lap_times) == 3
    assert verify(Replay.of(evaluation), num_threads=1).is_genuine


def test_an_open_road_is_driven_from_its_beginning() -> None:
    found = starts(driven(load_track("straight")))
    assert found[:, 0].max() < 0.01
    assert len(np.unique(found[:, 1].round(4))) == 5


def test_on_one_road_the_grid_is_somewhere_on_the_lap() -> None:

    places = []
    for seed in range(4):
        given = shared_road(Conditions(track=OVAL, rules=race_rules("drfc", {"laps": 1}), seed=seed), 2)
        trials = race_together([Autopilot(speed=2.0), Autopilot(speed=1.0)], given, num_threads=1)
        assert [trial.is_finished for trial in trials] == [True, True]
        assert verify(Replay.of(Evaluation(conditions=given, trials=trials)), num_threads=1).is_genuine
        places.append(round(float(OVAL.project(trials[0].recording.poses[0, :2])[0]), 2))
    assert len(set(places)) == 4


# ---- as contests


class Blind:
    """Stands for a network: looks at nothing, drives straight."""

    sensors = SensorSuite()

    def __init__(self, commands: tuple[float, float] = (0.0, 1.0), names: tuple[str, ...] = ()) -> None:
        self._commands = np.float32(commands)
        if names:
            self.sensors = SensorSuite(names)

    def __call__(self, sight: np.ndarray) -> np.ndarray:
        if not np.isfinite(self._commands).all():
            raise NonFiniteAction("action[0] = (nan, nan), expected two numbers in [-1, 1].")
        return np.tile(self._commands, (len(sight), 1))


def entry(name: str, policy: Any) -> Entry:
    return Entry(name, Path(name), 0, policy)


def held(*entries: Entry, **settings: Any) -> Contest:
    rules = race_rules("drfc", {"laps": 1, "time_limit": 4.0, "max_resets": 2})
    given = Conditions(**{"track": OVAL, "rules": rules, "seed": 3, **settings})
    return hold_race(entries, race_terms(given, num_trials=3), num_threads=1)


def test_everybody_starts_from_the_very_same_places() -> None:
    found = held(entry("slow", Blind((0.0, 0.5))), entry("fast", Blind((0.1, 3.0))))
    assert found.terms.num_trials == 3
    prepared = [[trial.recording.rows[0] for trial in trials] for trials in found.trials]
    assert np.array_equal(prepared[0], prepared[1])
    assert len({tuple(row) for row in prepared[0]}) == 3


def test_a_network_that_gives_no_numbers_is_named() -> None:
    with pytest.raises(NonFiniteAction, match="broken cannot drive"):
        held(entry("good", Blind()), entry("broken", Blind((float("nan"), 1.0))))


class Fading(Blind):
    """A network that gives no numbers any more after a second."""

    def __init__(self) -> None:
        super().__init__()
        self.looks = 0

    def __call__(self, sight: np.ndarray) -> np.ndarray:
        self.looks += 1
        if self.looks > 15:
            self._commands = np.float32((float("nan"), 1.0))
        return super().__call__(sight)


class Braking(Fading):
    """The same with the brakes on instead."""

    def __call__(self, sight: np.ndarray) -> np.ndarray:
        self.looks += 1
        return np.tile(self._commands if self.looks <= 15 else np.zeros(2, np.float32), (len(sight), 1))


@pytest.mark.parametrize("place", [0, 1])
def test_on_a_shared_road_a_network_that_gives_no_numbers_loses_alone(place: int) -> None:
    rules = race_rules("drfc", {"laps": 1, "time_limit": 12.0, "max_resets": 1})
    conditions = Conditions(track=OVAL, rules=rules, seed=3, cars_per_race=2)

    def driven(other: Blind) -> list[np.ndarray]:
        drivers = [other, Blind()] if place == 0 else [Blind(), other]
        trials = race_together(drivers, conditions, num_threads=1)
        assert trials[place].lap_times == ()
        return [np.stack([*trial.recording.rows]) for trial in trials]

    broken, braked = driven(Fading()), driven(Braking())
    for ours, theirs in zip(broken, braked, strict=True):
        assert np.array_equal(ours, theirs, equal_nan=True)


@pytest.mark.costly
def test_the_replay_of_a_car_with_another_lens_verifies(tmp_path: Path) -> None:
    """`object_in_camera` is seen through each entry's own lens; with another one honest replays would look forged."""
    objects = Objects(obstacles=Obstacles(count=6, placement="random"))
    names = ("FRONT_FACING_CAMERA",), ("LEFT_CAMERA",), ("STEREO_CAMERAS",)
    for seed in range(6):
        found = held(
            *(entry(str(number), Blind((0.05, 1.0), name)) for number, name in enumerate(names)),
            objects=objects,
            seed=seed,
        )
        for name, replay in found.replays():
            again = read_replay(write_replay(replay, tmp_path / f"{name}.replay"))
            assert verify(again, num_threads=1).is_genuine, (seed, name)


def test_the_film_is_of_the_trial_that_decided() -> None:
    found = held(entry("one", Blind()))
    times = (12.0, 10.0, 11.0)
    trials = tuple(_made(found.trials[0][0], time) for time in times)
    assert replace(found, trials=(trials,)).shown_trial == 2
    assert found.shown_trial == 0  # nobody came round


def _made(trial: Trial, time: float) -> Trial:
    lap = replace(trial.laps[0], status="lap_complete", time=time, completion=1.0)
    return replace(trial, laps=(lap,))


def test_the_rules_of_a_race_start_all_over_the_lap_whatever_their_name() -> None:
    for name in RULE_SETS:
        rules = race_rules(name, {"laps": 2})
        assert (rules.starts, rules.lateral_jitter) == ("lap", RACE_STARTS["lateral_jitter"])
        assert (
            replace(
                rules,
                starts="line",
                lateral_jitter=0.02,
                heading_jitter=RaceRules().heading_jitter,
                laps=RULE_SETS[name].laps,
            )
            == RULE_SETS[name]
        )
    assert race_rules(RaceRules(start_offset=0.0, starts="line"), {}).starts == "lap"


def test_camera_of_an_entry_is_that_of_its_sensors() -> None:
    assert held(entry("left", Blind(names=("LEFT_CAMERA",)))).cameras == (replace(CameraSpec(), left=0.03),)
