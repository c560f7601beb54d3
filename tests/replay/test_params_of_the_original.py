"""Every key of `params`, against 467 rows that the original simulator wrote in 2026."""

from __future__ import annotations

import gzip
import json
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from racecraft.reward.params import TEMPLATE, make_params
from racecraft.sim.logged import LogJudge
from racecraft.track import load_track

SHARED = Path(__file__).parents[3] / "shared"
LOGS = {name: SHARED / "params_2026" / f"{name}.jsonl.gz" for name in ("run_1", "run_2")}
ROUTE = SHARED / "tracks" / "reinvent_base.npy"
TOLERANCE = 1e-6
ANGLE = 1e-4  # degrees; ours are float32 radians
WIDTH = 2e-15  # m, twice the last bit
SHARE = 0.99  # of rows that must agree
STEP = 1.0 / 15.0  # s

# Rows that may differ, (run, row): keys or "all", and why.
EXPLAINED = {
    ("run_1", 0): ("all", "called before the car was placed, with zeros in every key"),
    ("run_2", 0): ("all", "called before the car was placed, with zeros in every key"),
    ("run_2", 2): ("is_left_of_center", "1.1e-16 m beside the line, where only rounding has a side"),
}

pytestmark = pytest.mark.skipif(
    not LOGS["run_1"].is_file(), reason="../shared/params_2026, rows of the original, is not beside this repository"
)


@cache
def rows_of(run: str) -> list[tuple[dict[str, Any], dict[str, Any]]]:
    """The original's params and ours of every row in which its car stood on the track."""
    with gzip.open(LOGS[run], "rt", encoding="utf-8") as file:
        theirs = [json.loads(line) for line in file][1:]
    track = load_track(str(ROUTE))

    def column(key: str) -> np.ndarray:
        return np.array([params[key] for params in theirs], dtype=np.float64)

    judged = LogJudge(track)(
        np.column_stack([column("x"), column("y"), np.radians(column("heading"))]),
        np.column_stack([np.radians(column("steering_angle")), column("speed")]),
        progress=column("progress") / 100.0,
        is_first=np.arange(len(theirs)) == 0,
        is_paused=np.zeros(len(theirs), dtype=bool),
    )
    waypoints = [[(x, y) for x, y in track.waypoints.tolist()]]
    return list(zip(theirs, (make_params(row, waypoints) for row in judged.tolist()), strict=True))


def is_same(key: str, value: Any, expected: Any) -> bool:
    if isinstance(expected, float):
        tolerance = {"heading": ANGLE, "steering_angle": ANGLE, "track_width": WIDTH}.get(key, TOLERANCE)
        return type(value) is float and abs(value - expected) <= tolerance
    return type(value) is type(expected) and value == expected


@pytest.mark.parametrize("key", [key for key in TEMPLATE if key not in ("waypoints", "sim_time")])
def test_a_key_in_every_row(key: str):
    total = 0
    differing = set()
    for run in LOGS:
        rows = rows_of(run)
        total += 1 + len(rows)
        differing |= {(run, 0)} | {(run, i) for i, (a, b) in enumerate(rows, 1) if not is_same(key, b[key], a[key])}
    assert total == 467
    assert len(differing) <= (1 - SHARE) * total
    assert all(EXPLAINED.get(row, ("", ""))[0] in ("all", key) for row in differing), sorted(differing)


def test_the_rows_show_both_values_of_what_can_be_true_or_false_there():
    theirs = [params for run in LOGS for params, _ in rows_of(run)]
    for key in ("is_left_of_center", "all_wheels_on_track"):
        assert {params[key] for params in theirs} == {True, False}, key
    assert len({params["track_width"] for params in theirs}) > 400


def test_waypoints():
    """They are the same in all rows, so the original's stand in a file of their own."""
    theirs = json.loads((SHARED / "params_2026" / "waypoints.json").read_text())
    for run in LOGS:
        for _, params in rows_of(run):
            assert [list(point) for point in params["waypoints"]] == theirs


def test_every_key_is_one_that_the_original_gives():
    for run in LOGS:
        assert {*rows_of(run)[0][0]} - {"frame"} | {"waypoints"} == {*TEMPLATE}


@pytest.mark.parametrize("run", LOGS)
def test_sim_time_runs_as_fast(run: str):
    """Seconds as well, but from another beginning, and the original's steps are uneven: only the pace is common."""
    theirs, ours = (np.array([params[i]["sim_time"] for params in rows_of(run)]) for i in (0, 1))
    assert (np.diff(theirs) > 0.0).all()
    np.testing.assert_allclose(np.diff(ours), STEP, atol=1e-9)
    assert np.ptp(theirs) / np.ptp(ours) == pytest.approx(1.0, abs=0.015)
    assert ours[0] == pytest.approx(STEP, abs=1e-9)
