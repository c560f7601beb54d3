"""Sweeps of tiny trainings: their runs, that they go on, and what the leaderboard makes of chance."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from racecraft.errors import RewardError, RunError
from racecraft.run import RunFolder
from racecraft.run.lock import exclusive_lock
from racecraft.sweeping import Sweep, board_of, make_sweep, read_sweep, sweep_names
from racecraft.sweeping import sweep as sweep_module
from racecraft.sweeping.board import Outcome, is_tied, outcome_of
from racecraft.training.job import Training
from racecraft.tuning import seats
from racecraft.tuning.trial import Order, Report

FILE = """
seeds = [1, 2]
[all]
track = "oval"
until = "256 steps"
evaluate_every = 256
num_envs = 8
[settings.plain]
[settings.bold]
numbers = { learning_rate = 0.002 }
"""


@pytest.mark.costly
def test_its_runs_are_those_that_each_would_be_alone(tmp_path: Path) -> None:
    sweep = make_sweep(read_sweep(FILE), runs=tmp_path, name="s")
    assert sweep_names(tmp_path) == ["s"]
    assert list(sweep.names()) == ["s-plain-1", "s-bold-1", "s-plain-2", "s-bold-2"]
    assert [place.seeds for place in sweep.board().places] == [0, 0]
    told: dict[str, Report | Exception] = {}
    assert not Sweep(tmp_path, "s").train(processes=1, on_end=told.__setitem__)
    assert set(told) == set(sweep.names())
    assert {how.reason for how in told.values() if isinstance(how, Report)} == {"steps"}
    assert [place.seeds for place in sweep.board().places] == [2, 2]

    (plan,) = (one.plan for one in read_sweep(FILE).settings if one.name == "bold")
    alone = plan.start(root=tmp_path / "alone", name="bold")  # with seed 0, so it is another
    Training(alone).run()
    apart = make_sweep(read_sweep(FILE.replace("[1, 2]", "[0]")), runs=tmp_path, name="again")
    apart.train(processes=1)
    for name, value in alone.checkpoints.load("last").arrays.items():
        if name != "recent_episodes":  # holds wall-clock times
            again = apart.run_of("bold", 0).checkpoints.load("last").arrays[name]
            np.testing.assert_array_equal(value, again, err_msg=name)


@pytest.mark.costly
def test_it_goes_on_where_it_was_and_says_what_cannot_be_trained(tmp_path: Path) -> None:
    sweep = make_sweep(read_sweep(FILE), runs=tmp_path, name="s")

    def stop_after_one(_: str, __: Report | Exception) -> None:
        sweep.stop()

    assert sweep.train(processes=1, on_end=stop_after_one)
    done = [name for name in sweep.names() if outcome_of(RunFolder(tmp_path / name)).steps]
    assert done == ["s-plain-1"]
    kept = (tmp_path / "s-plain-1" / "checkpoints" / "manifest.json").read_bytes()
    (tmp_path / "s-bold-1" / "reward_function.py").write_text("def reward_function(params:\n")
    told: dict[str, Report | Exception] = {}
    assert not Sweep(tmp_path, "s").train(processes=1, on_end=told.__setitem__)
    assert isinstance(told["s-bold-1"], RewardError)
    assert (tmp_path / "s-plain-1" / "checkpoints" / "manifest.json").read_bytes() == kept
    assert [place.seeds for place in sweep.board().places] == [2, 1]
    (tmp_path / "s-plain-2" / "run.json").write_text('{"a"')
    with pytest.warns(UserWarning, match=r"without s-plain-2: .* is not valid JSON"):
        assert [place.seeds for place in sweep.board().places] == [1, 1]


def test_names_that_are_taken_or_gone_are_refused(tmp_path: Path) -> None:
    make_sweep(read_sweep("seeds = [1]\n[all]\ntrack = 'oval'"), runs=tmp_path, name="s")
    with pytest.raises(RunError, match="a sweep 's' already"):
        make_sweep(read_sweep("seeds = [1]"), runs=tmp_path, name="s")
    with pytest.raises(RunError, match="no sweep 't'"):
        Sweep(tmp_path, "t")
    (tmp_path / ".sweeps" / "s.json").write_text("{}")
    with pytest.raises(RunError, match="cannot be read"):
        Sweep(tmp_path, "s")


def test_a_sweep_is_trained_by_one_process_at_a_time(tmp_path: Path) -> None:
    sweep = make_sweep(read_sweep(FILE), runs=tmp_path, name="s")
    with exclusive_lock(sweep.file.with_suffix(".lock")), pytest.raises(RunError, match=r"^Sweep 's' is in use by"):
        sweep.train()


def test_what_kills_its_process_again_and_again_is_given_up(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    tried: list[str] = []

    class Mortal(seats.HereSeat):
        def run(self, order: Order) -> Report:
            tried.append(Path(order.run).name)
            raise seats.SeatLost("It ended.")

    monkeypatch.setattr(sweep_module, "ProcessSeat", Mortal)
    told: dict[str, Report | Exception] = {}
    sweep = make_sweep(read_sweep(FILE), runs=tmp_path, name="s")
    sweep.train(processes=2, on_end=told.__setitem__)
    assert sorted(tried) == sorted(3 * list(sweep.names()))
    assert set(map(str, told.values())) == {"It ended."}


def test_what_nobody_expects_ends_the_sweep_and_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    tried: list[str] = []

    class Unlucky(seats.HereSeat):
        def run(self, order: Order) -> Report:
            tried.append(Path(order.run).name)
            raise BlockingIOError(11, "Resource temporarily unavailable")  # of a system that begins no more processes

    monkeypatch.setattr(sweep_module, "HereSeat", Unlucky)
    sweep = make_sweep(read_sweep(FILE), runs=tmp_path, name="s")
    with pytest.raises(BlockingIOError, match="temporarily unavailable"):
        sweep.train(processes=1)
    assert tried == ["s-plain-1"]


def test_a_sweep_that_cannot_be_made_leaves_no_run(tmp_path: Path) -> None:
    reward = tmp_path / "mine.py"
    reward.write_text("def reward_function(params):\n    return params['sped']\n")
    text = FILE.replace("numbers = { learning_rate = 0.002 }", f"reward = '{reward}'")
    runs = tmp_path / "runs"
    with pytest.raises(RewardError, match=r"^Setting 'bold': (.|\n)*no key 'sped'"):
        make_sweep(read_sweep(text), runs=runs, name="s")
    assert list(runs.iterdir()) == []
    RunFolder.create(runs, name="s-bold-2")
    with pytest.raises(RunError, match=r"^Setting 'bold': .*s-bold-2 exists"):
        make_sweep(read_sweep(FILE), runs=runs, name="s")
    assert [path.name for path in runs.iterdir()] == ["s-bold-2"], "which it did not make"


def test_laps_of_the_run_that_all_begin_with_are_nobodys(tmp_path: Path) -> None:
    (plan,) = (one.plan for one in read_sweep(FILE).settings if one.name == "plain")
    folder = plan.start(root=tmp_path, name="child")
    folder.history.parent.mkdir()
    first, later = (
        {"kind": "evaluation", "step": step, "completions": [1.0], "lap_times": [lap]}
        for step, lap in ((0, 8.0), (256, 9.0))
    )
    folder.history.write_text(json.dumps(first) + "\n")
    assert outcome_of(folder) == Outcome(steps=0, laps_after=None, best_lap=None)
    folder.history.write_text(json.dumps(first) + "\n" + json.dumps(later) + "\n")
    assert outcome_of(folder) == Outcome(steps=256, laps_after=256, best_lap=9.0)


def outcomes(*values: float | None) -> dict[int, Outcome]:
    return {
        seed: Outcome(steps=1000, laps_after=None if value is None else int(value), best_lap=value)
        for seed, value in enumerate(values)
    }


def test_the_board_knows_chance() -> None:
    words = {name: {"reward": name} for name in ("slow", "fast", "lucky", "lost", "never")}
    found = {
        "slow": outcomes(300, 310, 320, 330),
        "fast": outcomes(200, 210, 220, 230),
        "lucky": outcomes(100, 300, 215, 290),
        "lost": outcomes(100, 110, None, 120),
    }
    board = board_of("laps", words, found)
    assert [(row.setting, row.is_tied) for row in board.places] == [
        ("fast", False), ("lucky", True), ("slow", False), ("lost", True), ("never", True)
    ]  # fmt: skip
    fast = board.places[0]
    assert (fast.laps_after.mean, fast.laps_after.count, fast.seeds) == (215.0, 4, 4)
    assert fast.laps_after.low == pytest.approx(215 - 3.182446 * np.std([200, 210, 220, 230], ddof=1) / 2, abs=1e-3)
    assert board.places[3].laps_after.count == 3
    assert board.places[4].best_lap.mean is None
    one = board_of("lap_time", {"a": {}}, {"a": outcomes(9.5)}).places[0]
    assert (one.best_lap.mean, one.best_lap.low) == (9.5, None)


ALL = dict[int, float | None](enumerate(range(200, 400, 10)))  # 20 seeds
NONE = dict[int, float | None].fromkeys(ALL)


@pytest.mark.parametrize(
    ("first", "other", "tied"),
    [
        (ALL, {**NONE, 3: 230.0}, False),
        (ALL, NONE, False),
        (ALL, ALL, True),
        (NONE, NONE, True),
        ({**NONE, 3: 230.0}, NONE, True),
        (ALL, {**ALL, 3: None}, True),  # one seed is chance
        ({**ALL, 3: None}, {**ALL, 4: None}, True),
        (ALL, {**{seed: value + seed % 3 for seed, value in ALL.items() if value}, 3: None}, False),  # never faster
        ({**ALL, 3: None}, {**dict.fromkeys(ALL, 1000.0), 4: None, 5: None}, False),  # 19 signs to 1
        (ALL, {**dict.fromkeys(ALL, 1.0), 3: None}, True),  # 19 signs, but for the other
        ({1: 200, 2: 210, 3: 220, 4: 230}, {1: 900, 2: 920, 3: 910, 4: None}, False),  # slower, and fails, too
        ({1: 200, 2: 210, 3: 220, 4: 230}, {1: 900, 2: None, 3: None, 4: None}, True),  # too few seeds to tell
        ({1: 200, 2: 210, 3: 220, 4: 230}, dict.fromkeys(range(1, 5)), False),
        ({1: 200, 2: 210, 3: 220}, {1: 300, 2: 310, 3: 320}, False),
        ({1: 200, 2: 210, 3: None}, {1: 300, 2: 310, 3: None}, False),  # where both fail says nothing
        ({1: 200}, {1: 900}, True),
        ({1: 200, 2: 210}, {3: 900, 4: None}, True),  # no seed of both
    ],
)
def test_a_seed_that_fails_is_slower_than_any(
    first: dict[int, float | None], other: dict[int, float | None], tied: bool
) -> None:
    assert is_tied(first, other) is tied
