"""Laps that a training keeps: rarer as it goes on, read back whole, and those that beat all before them."""

from __future__ import annotations

import json
from itertools import pairwise
from pathlib import Path

import numpy as np

from racecraft.run import RunFolder
from racecraft.run.evolution import MAX_POSES, Drive, evenly, is_kept, read_drives, records
from racecraft.run.history import HistoryWriter


def drive(step: int, completion: float = 0.5, lap_time: float | None = None) -> Drive:
    return Drive(step=step, lap_time=lap_time, completion=completion, poses=np.arange(6).reshape(2, 3) + step)


def test_a_training_of_any_length_keeps_a_few_dozen() -> None:
    steps = range(512, 2_000_000, 512)
    kept = [step for before, step in zip([0, *steps], steps, strict=False) if is_kept(step, before)]
    assert kept[:2] == [512, 1024]
    assert len(kept) < 60
    assert max(later / earlier for earlier, later in pairwise(kept)) <= 2


def test_what_was_kept_is_read_and_what_is_damaged_passed_over(tmp_path: Path) -> None:
    folder = RunFolder(tmp_path)
    assert read_drives(folder) == []
    with HistoryWriter(folder.evolution) as writer:
        for one in (drive(64), drive(128, 1.0, 9.5)):
            writer.add("lap", one.point())
    with folder.evolution.open("a") as file:
        for point in (
            {"step": 1},
            {"step": 2, "lap_time": None, "completion": 0.1, "poses": [[1, 2]]},
            {"step": 2, "lap_time": None, "completion": 0.1, "poses": [[1, 2, 3]] * (MAX_POSES + 1)},
            {"step": 2, "lap_time": None, "completion": 0.1, "poses": [["x", 2, 3]] * 2},
            {"step": 3, "lap_time": None, "completion": 0.1, "poses": [[1e30, 2, 3]] * 2},
            {"step": 80, "lap_time": None, "completion": 0.1, "poses": [[0, 0, 0], [5000, 0, 0]]},
            {"step": 80, "lap_time": None, "completion": 0.1, "poses": [[-(2**63), 0, 0]] * 2},
            {"step": 80, "lap_time": None, "completion": 0.1, "poses": [[0, 2**62, 0]] * 2},
            {"step": 64, "lap_time": "nan", "completion": 0.1, "poses": [[1, 2, 3]] * 2},
            {"step": 64, "lap_time": 9.0, "completion": "nan", "poses": [[1, 2, 3]] * 2},
            {"step": 64, "lap_time": 10**400, "completion": 0.1, "poses": [[1, 2, 3]] * 2},
            [],
        ):
            file.write(json.dumps(point) + "\n")
        file.write("{half a li")
    found = [one for one in read_drives(folder) if one.step >= 64]
    assert [(one.step, one.lap_time, one.completion) for one in found] == [(64, None, 0.5), (128, 9.5, 1.0)]
    np.testing.assert_array_equal(found[1].poses, drive(128).poses)
    assert len(read_drives(folder)) <= 3


def test_a_record_is_further_or_faster_than_all_before() -> None:
    drives = [
        drive(1, 0.2),
        drive(2, 0.1),
        drive(3, 0.3),
        drive(4, 1.0, 12.0),
        drive(5, 0.9),
        drive(6, 1.0, 12.5),
        drive(7, 1.0, 11.0),
    ]
    assert [one.step for one in records(drives)] == [1, 3, 4, 7]
    assert [one.step for one in records(drives[:-1], drive(7, 1.0, 11.0))] == [1, 3, 4]
    assert [one.step for one in records(drives, drive(8, 0.3))] == [1]  # by luck others came as far or further
    assert [one.step for one in evenly(drives, 3)] == [1, 4, 7]
    assert evenly(drives, 7) is drives
