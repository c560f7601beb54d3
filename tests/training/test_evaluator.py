"""Which evaluation of a training is the best: by outcomes that are told, so that their order is known."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from racecraft import load_track
from racecraft.agent import action_space
from racecraft.learn import NetworkSpec, make_learner
from racecraft.race.evaluation import Completion
from racecraft.race.policy import NetworkPolicy
from racecraft.run import EpisodeCounter
from racecraft.sim import Objects, Obstacles, Simulation
from racecraft.sim.columns import OBJECT_COLUMNS, OBJECT_HEADER, ROW_COLUMNS
from racecraft.training import EvaluationReport, Until, evaluator
from racecraft.training.evaluator import SURE, Evaluator
from racecraft.training.regimes import OBJECTS
from racecraft.training.settings import TrainSettings

SETTINGS = TrainSettings(track="oval", until=Until(steps=1000), evaluation_trials=2, num_threads=1)
OF_A_TEACHER = replace(SETTINGS, algorithm="distill")
AMONG_BOXES = replace(SETTINGS, objects=Objects(obstacles=Obstacles(count=2)))
Judge = Callable[..., EvaluationReport]


def evaluator_for(settings: TrainSettings, *tracks: str) -> Evaluator:
    space = action_space("default")
    learner = make_learner(NetworkSpec(num_actions=space.size), num_threads=1)
    return Evaluator(NetworkPolicy(learner, space), [load_track(track) for track in tracks or ("oval",)], settings)


@pytest.fixture
def judged() -> Evaluator:
    return evaluator_for(SETTINGS)


@pytest.fixture
def judge(judged: Evaluator, monkeypatch: pytest.MonkeyPatch) -> Judge:
    return judge_of(judged, monkeypatch)


def judge_of(judged: Evaluator, monkeypatch: pytest.MonkeyPatch) -> Judge:
    """One evaluation whose two trials end as told: how far each came, or the time of its whole lap."""

    def tell(*trials: float, step: int = 0) -> EvaluationReport:
        laps = np.array([trial if trial > 1 else math.nan for trial in trials])
        outcome = Completion(
            completions=np.minimum(trials, 1.0),
            lap_times=laps,
            rewards=np.array([3.5, 4.5]),
            statuses=tuple("lap_complete" if trial > 1 else "off_track" for trial in trials),
        )
        monkeypatch.setattr(evaluator, "completion", lambda *arguments, **settings: outcome)
        judged.evaluate(step=step, seconds=step / 10, counter=EpisodeCounter(2))
        assert judged.last is not None
        return judged.last

    return tell


def test_more_completion_is_better_and_then_a_faster_lap(judge: Judge, judged: Evaluator) -> None:
    assert judge(0.3, 0.4).is_best  # the first
    assert not judge(0.3, 0.2).is_best
    assert judge(0.5, 0.4).is_best
    assert judge(0.1, 12.0).is_best
    assert judge(15.0, 14.0).is_best  # all of it, if slower
    assert not judge(0.99, 9.0).is_best
    assert not judge(16.0, 14.5).is_best
    assert judge(13.0, 20.0).is_best  # the fastest lap of an evaluation counts
    assert judged.best_score == (1.0, -13.0)


def test_among_objects_whole_laps_come_first(monkeypatch: pytest.MonkeyPatch) -> None:
    judge = judge_of(among := evaluator_for(AMONG_BOXES), monkeypatch)
    assert judge(0.8, 0.9).is_best
    assert judge(12.0, 0.1).is_best  # a whole one, if the other crashed soon
    assert not judge(0.99, 0.99).is_best
    assert judge(14.0, 0.2).is_best  # then how far, whatever the lap took
    assert not judge(11.0, 0.1).is_best
    assert judge(13.0, 0.2).is_best
    assert among.best_score == (0.5, 0.6, -13.0)


def test_who_began_without_whole_laps_first_goes_on_without(monkeypatch: pytest.MonkeyPatch) -> None:
    among = evaluator_for(AMONG_BOXES)
    among.load_state({"last": None, "best_score": [0.85, -1e6], "best_lap": None})
    judge = judge_of(among, monkeypatch)
    assert among.was_good
    assert not judge(12.0, 0.6).is_best
    assert judge(0.9, 0.85).is_best
    assert among.best_score == (0.875, -1e6)


def test_on_several_tracks_the_mean_of_the_laps_counts(monkeypatch: pytest.MonkeyPatch) -> None:
    judge = judge_of(evaluator_for(SETTINGS, "oval", "bowtie"), monkeypatch)
    assert judge(13.0, 20.0).is_best
    assert not judge(12.0, 22.0).is_best  # the fastest lap, but of one road only
    assert judge(14.0, 18.0).is_best
    assert not judge(0.9, 9.0).is_best


def test_of_many_roads_a_student_that_is_nearly_sure_is_better_the_later(monkeypatch: pytest.MonkeyPatch) -> None:
    judge = judge_of(judged := evaluator_for(OF_A_TEACHER, "oval", "bowtie"), monkeypatch)
    assert judge(0.8, 0.9).is_best
    assert not judge(0.6, 12.0).is_best  # less than that is told apart
    assert judge(14.0, 12.0, step=100_000).is_best
    assert judge(0.9, 15.0, step=200_000).is_best  # as sure as two laps can tell
    assert judge(0.875, 15.0, step=300_000).is_best
    assert not judge(0.874, 9.0, step=400_000).is_best
    assert judged.rank == (0.937,)
    assert judged.best_rank == (SURE,)
    assert judged.was_good  # and whether anything better comes is as before
    assert judged.best_score == (1.0, -13.0)
    assert judged.has_settled


def test_who_began_with_the_surest_and_fastest_of_many_roads_goes_on_so(monkeypatch: pytest.MonkeyPatch) -> None:
    judged = evaluator_for(OF_A_TEACHER, "oval", "bowtie")
    judged.load_state({"last": None, "best_score": [0.96, -13.0], "best_lap": 9.0})
    judge = judge_of(judged, monkeypatch)
    assert not judge(0.9, 15.0).is_best
    assert judge(0.98, 15.0).is_best
    assert judged.rank == (0.99, -15.0)


def test_on_one_road_or_among_objects_a_student_is_no_better_for_being_later(monkeypatch: pytest.MonkeyPatch) -> None:
    boxes = AMONG_BOXES.objects
    for judged in (
        evaluator_for(OF_A_TEACHER),
        evaluator_for(replace(OF_A_TEACHER, objects=boxes), "oval", "bowtie"),
        evaluator_for(SETTINGS, "oval", "bowtie"),
    ):
        judge = judge_of(judged, monkeypatch)
        assert judge(14.0, 12.0).is_best
        assert not judge(0.99, 15.0).is_best


def test_of_two_that_are_as_good_the_later_one_has_learned_longer_and_is_the_best(judge: Judge) -> None:
    assert judge(0.5, 0.3).is_best
    assert judge(0.5, 0.3).is_best
    assert judge(0.3, 0.5).is_best


def test_the_best_lap_is_the_fastest_ever_even_of_an_evaluation_that_is_not_the_best(
    judge: Judge, judged: Evaluator
) -> None:
    judge(0.3, 0.4)
    assert judged.best_lap is None
    for trials, best in (((14.0, 13.0), 13.0), ((0.2, 12.0), 12.0), ((15.0, 14.0), 12.0), ((0.2, 0.2), 12.0)):
        judge(*trials)
        assert judged.best_lap == best


def test_it_was_good_once_every_lap_was_completed_and_stays_so(judge: Judge, judged: Evaluator) -> None:
    assert not judged.was_good
    judge(0.98, 12.0)
    assert not judged.was_good
    judge(14.0, 12.0)
    assert judged.was_good
    judge(0.1, 0.1)
    assert judged.was_good


def test_among_objects_enough_of_the_way_is_good(monkeypatch: pytest.MonkeyPatch) -> None:
    judge = judge_of(among := evaluator_for(AMONG_BOXES), monkeypatch)
    for completion, is_good in ((OBJECTS.good - 0.01, False), (OBJECTS.good, True), (0.1, True)):
        judge(completion, completion)
        assert among.was_good is is_good
    judge(9.0, 0.0)  # the best by whole laps, which is not the one with most of the way
    again = evaluator_for(AMONG_BOXES)
    again.load_state(among.state())
    assert again.was_good
    assert again.best_score == (0.5, 0.5, -9.0)


def objects_of(simulation: Simulation) -> list[list[float]]:
    """Where each car's objects stand, m along the track and beside its middle."""
    begin = len(ROW_COLUMNS) + len(OBJECT_HEADER)
    objects = simulation.judged[:, begin:].reshape(simulation.num_envs, -1, len(OBJECT_COLUMNS))
    places = [OBJECT_COLUMNS.index(name) for name in ("object_distance", "object_offset")]
    return objects[:, :, places].reshape(simulation.num_envs, -1).tolist()


def test_among_objects_every_evaluation_drives_among_those_of_its_seed_whatever_was_driven_before() -> None:
    random = replace(SETTINGS, objects=Objects(obstacles=Obstacles(count=3, placement="random")))

    def places(judged: Evaluator) -> list[list[float]]:
        judged.evaluate(step=64, seconds=1.0, counter=EpisodeCounter(2))
        return objects_of(judged._trials)

    first = evaluator_for(random)
    told = places(first)
    assert told[0] != told[1]  # trials differ
    assert places(first) == told
    resumed = evaluator_for(random)
    resumed.load_state(first.state())
    assert places(resumed) == told
    assert places(evaluator_for(replace(random, seed=1))) != told


def test_among_objects_evaluations_are_no_layouts_of_the_training() -> None:
    objects = Objects(obstacles=Obstacles(count=3, placement="random"))
    judged = evaluator_for(replace(SETTINGS, objects=objects))
    judged.evaluate(step=64, seconds=1.0, counter=EpisodeCounter(2))
    training = Simulation([load_track("oval")], num_envs=2, seed=0, camera=None, objects=objects)
    met = objects_of(training)
    for _ in range(5):
        training.reset()
        met += objects_of(training)
    assert not any(places in met for places in objects_of(judged._trials))


def test_trials_are_told_as_episodes_on_the_runs_clock(judged: Evaluator) -> None:
    """Driven by a network that has learned nothing; the simulation tells how long each trial took."""
    counter = EpisodeCounter(8, number=17, clock=50.0)
    trials = judged.evaluate(step=640, seconds=3.0, counter=counter)
    report = judged.last
    assert report is not None
    assert (report.step, report.seconds, judged.evaluated_at) == (640, 3.0, 640)
    assert [(trial.env, trial.number) for trial in trials] == [(0, 17), (1, 17)]  # trainings' numbers go on
    assert [trial.progress for trial in trials] == list(report.completions)
    assert [trial.steps for trial in trials] == [round(15 * trial.duration) for trial in trials]
    assert all(trial.duration > 0.5 for trial in trials)
    assert [trials[0].start_time, trials[1].start_time] == [50.0, pytest.approx(50.0 + trials[0].duration + 1 / 15)]
    assert counter.number == 17


@pytest.mark.parametrize("direction", ["forward", "alternate"])
def test_of_many_tracks_as_many_are_driven_as_there_are_trials(monkeypatch: pytest.MonkeyPatch, direction: Any) -> None:
    tracks = [load_track(name) for name in ("oval", "bowtie", "hairpin")]
    opened: list[Any] = []
    simulate = evaluator.trial_simulation

    def remember(driven: Any, **settings: Any) -> Any:
        opened.append((driven, simulate(driven, **settings)))
        return opened[-1][1]

    monkeypatch.setattr(evaluator, "trial_simulation", remember)
    settings = replace(SETTINGS, direction=direction, evaluation_trials=5)
    learner = make_learner(NetworkSpec(num_actions=5), num_threads=1)
    judge = Evaluator(NetworkPolicy(learner, action_space("default")), tracks, settings)
    assert not opened  # as the first step of a training does not wait for it
    judge.evaluate(step=0, seconds=0.0, counter=EpisodeCounter(5))
    ((driven, simulation),) = opened
    assert [track.name for track in driven] == ["oval", "oval", "bowtie", "bowtie", "hairpin"]
    for trial, track in enumerate(driven):
        forward = next(each for each in tracks if each.name == track.name)
        is_reversed = direction == "alternate" and trial % 2 == 1
        np.testing.assert_array_equal(track.centerline, (forward.reversed() if is_reversed else forward).centerline)
        assert simulation.column("track_length")[trial] == pytest.approx(forward.length)


def test_what_a_resumed_run_is_told_goes_on_where_the_first_was(judge: Judge, judged: Evaluator) -> None:
    judge(14.0, 13.0, step=64)
    judge(0.5, 0.5, step=128)
    again = evaluator_for(SETTINGS)
    state: dict[str, Any] = judged.state()
    again.load_state(state)
    assert (again.last, again.best_score, again.best_lap) == (judged.last, (1.0, -13.0), 13.0)
    assert again.best_rank == judged.best_rank == (1.0, -13.0)
    assert again.evaluated_at == 128
    assert again.was_good


def test_it_has_settled_when_no_lap_was_better_for_a_good_while(judged: Evaluator, judge: Judge) -> None:
    judge(0.9, 9.0, step=100_000)  # not every lap is whole
    judge(0.9, 9.0, step=900_000)
    assert not judged.has_settled
    judge(9.0, 9.5, step=1_000_000)
    judge(9.0, 9.5, step=1_400_000)  # as good as the best is no gain
    judge(8.9, 9.9, step=1_499_999)
    assert not judged.has_settled
    judge(9.0, 9.9, step=1_500_000)  # the gain was a moment ago
    judge(0.5, 8.0, step=2_249_997)
    assert not judged.has_settled
    judge(0.5, 8.0, step=2_249_999)  # half as long again as to the best
    assert judged.has_settled


def test_what_is_soon_the_best_is_waited_for_longer(judged: Evaluator, judge: Judge) -> None:
    judge(9.0, 9.0, step=4096)
    judge(9.0, 9.0, step=154_095)
    assert not judged.has_settled
    judge(9.0, 9.0, step=154_096)
    assert judged.has_settled
    resumed = evaluator_for(SETTINGS)
    resumed.load_state(judged.state())
    assert resumed.has_settled


def test_of_an_earlier_version_it_is_not_known_when_it_was_best(judged: Evaluator, judge: Judge) -> None:
    judge(9.0, 9.0, step=1000)
    state = judged.state()
    del state["gained_at"]
    resumed = evaluator_for(SETTINGS)
    resumed.load_state(state)
    assert not resumed.has_settled
