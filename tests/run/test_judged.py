"""A run's best lap: the fastest whole lap of all its evaluations on its own track, and of no other."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from racecraft.run import RunFolder, RunInfo, best_of, judged_laps
from racecraft.track import joint_digest, load_tracks


@pytest.fixture
def run(tmp_path: Path) -> RunFolder:
    folder = RunFolder.create(tmp_path, name="a")
    folder.write_info(RunInfo(seed=1, track="oval", track_digest=""))
    return folder


def train(folder: RunFolder, *laps: list[float]) -> None:
    folder.history.parent.mkdir(exist_ok=True)
    lines = [
        {"kind": "evaluation", "step": 100 * number, "completions": [1.0, 0.5], "lap_times": times}
        for number, times in enumerate(laps, start=1)
    ]
    folder.history.write_text("".join(json.dumps(line) + "\n" for line in lines))


def race(folder: RunFolder, stamp: str, **summary: Any) -> None:
    folder.evaluation(stamp).mkdir()
    document = {"track": "oval", "step": 200, "mean_completion": 1.0, **summary}
    (folder.evaluation(stamp) / "evaluation.json").write_text(json.dumps(document))


def test_a_lap_in_training_and_a_lap_afterwards_count_alike(run: RunFolder) -> None:
    assert best_of(judged_laps(run)) is None
    train(run, [], [10.8, 10.47], [11.0])
    best = best_of(judged_laps(run))
    assert best is not None
    assert (best.best_lap, best.step, best.stamp) == (10.47, 200, None)
    race(run, "20260101000000", best_lap_seconds=9.6)
    race(run, "20260101000001", best_lap_seconds=10.8)
    race(run, "20260101000002", best_lap_seconds=5.0, track="hairpin")
    best = best_of(judged_laps(run))
    assert best is not None
    assert (best.best_lap, best.stamp) == (9.6, "20260101000000")


def test_the_road_decides_and_not_its_name(run: RunFolder) -> None:
    run.write_info(RunInfo(seed=1, track="oval", track_digest="as it was"))
    race(run, "20260101000000", best_lap_seconds=5.0, track_digest="redrawn")
    assert judged_laps(run) == []
    race(run, "20260101000001", best_lap_seconds=9.0, track="oval-copied", track_digest="as it was")
    race(run, "20260101000002", best_lap_seconds=9.5)  # of an earlier version
    assert [one.best_lap for one in judged_laps(run)] == [9.0, 9.5]


def test_of_several_tracks_a_lap_on_any_counts(run: RunFolder) -> None:
    tracks = load_tracks("oval + reinvent_2018")
    run.write_info(RunInfo(seed=1, track="oval + reinvent_2018", track_digest=joint_digest(tracks)))
    for number, (digest, lap) in enumerate([(tracks[0].digest, 9.0), (tracks[1].digest, 12.0), ("redrawn", 5.0)]):
        race(run, f"2026010100000{number}", best_lap_seconds=lap, track_digest=digest)
    race(run, "20260101000003", best_lap_seconds=13.0, track="reinvent_2018")  # of an earlier version
    assert [one.best_lap for one in judged_laps(run)] == [9.0, 12.0, 13.0]
    (run.evaluation("20260101000003") / "evaluation.json").unlink()
    for names in ("oval + hairpin", "oval + nobody's"):  # others by now, or gone
        run.write_info(RunInfo(seed=1, track=names, track_digest=joint_digest(tracks)))
        assert judged_laps(run) == []


def test_a_completion_is_the_mean_of_its_trials_and_what_is_no_number_counts_nowhere(run: RunFolder) -> None:
    run.history.parent.mkdir(exist_ok=True)
    points = [([1.0, 0.5], []), ([0, 0.0], []), ([True, "1", None, 0.4], [True, -1.0]), ([], [])]
    lines = [{"kind": "evaluation", "step": 100, "completions": shares, "lap_times": laps} for shares, laps in points]
    run.history.write_text("".join(json.dumps(line) + "\n" for line in lines))
    assert [one.completion for one in judged_laps(run)] == [0.75, 0.0, 0.4, None]
    assert [one.best_lap for one in judged_laps(run)] == [None] * 4


def test_a_lap_in_another_car_or_under_other_conditions_does_not_count(run: RunFolder) -> None:
    learned = {"mass": 3.0, "speed_gain": 1.0}
    run.write_info(RunInfo(seed=1, track="oval", track_digest="", settings={"vehicle": learned}))
    now = {"driven": {"randomize": ""}, "conditions": {"vehicle": learned | {"new_in_this_version": 1.0}}}
    race(run, "20260101000000", best_lap_seconds=9.0, **now)
    race(run, "20260101000001", best_lap_seconds=5.0, conditions={"vehicle": learned | {"speed_gain": 2.0}})
    race(run, "20260101000002", best_lap_seconds=5.0, driven={"randomize": "under the randomisation 'light'"})
    race(run, "20260101000003", best_lap_seconds=5.0, conditions="none")
    race(run, "20260101000004", best_lap_seconds=9.5)  # of an earlier version
    assert [one.best_lap for one in judged_laps(run)] == [9.0, 9.5]


def test_damaged_files_are_passed_over(run: RunFolder) -> None:
    train(run, [10.0])
    with run.history.open("a") as file:
        file.write('{"kind": "evaluation", "step": 4\n{"kind": "evaluation", "step": 5, "lap_times": "x"}\n')
        file.write('{"kind": "evaluation", "step": Infinity, "completions": [], "lap_times": []}\n')
        file.write('{"kind": "evaluation", "step": 6, "completions": [' + "1" * 400 + '], "lap_times": [1]}\n')
    race(run, "20260101000000", best_lap_seconds="fast")
    (run.evaluation("20260101000000") / "evaluation.json").with_name("other").write_text("")
    run.evaluation("20260101000003").mkdir()
    (run.evaluation("20260101000003") / "evaluation.json").write_text("{")
    best = best_of(judged_laps(run))
    assert best is not None
    assert best.best_lap == 10.0
