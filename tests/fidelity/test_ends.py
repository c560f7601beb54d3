"""Ends of episodes that a log does not show enough of to be judged."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from racecraft.agent import action_space
from racecraft.cli.text import say_replayed
from racecraft.fidelity import replay
from racecraft.race.artifacts import write_simtrace
from racecraft.race.evaluation import evaluate
from racecraft.track import load_track


def drives(state: NDArray[np.float64]) -> NDArray[np.float32]:
    steer = -0.5 * state[:, 4] - 1.2 * state[:, 5] + 0.2 * state[:, 9]
    return np.stack([steer, np.full(len(state), 2.0)], axis=1).astype(np.float32)


@pytest.mark.parametrize("status", ["crashed", "time_up"])
def test_a_crash_is_no_difference_where_boxes_are_not_logged(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], status: str
) -> None:
    evaluation = evaluate(drives, load_track("oval"), num_trials=2, sees="state")
    write_simtrace(evaluation, tmp_path, action_space=action_space("continuous"))
    path = tmp_path / "0-iteration.csv"
    header, *rows = path.read_text().splitlines()
    table = [row.split(",") for row in rows]
    first = [row for row in table if row[0] == "0"]
    cut = [list(row) for row in first[:60]]
    cut[-1][9], cut[-1][15] = "True", status
    path.write_text("\n".join([header, *(",".join(row) for row in cut + table[len(first) :])]) + "\n")
    result = replay(path, track="oval")
    found = result.to_dict()
    assert (found["episodes"], found["unseen_ends"]) == (evaluation.laps_begun, 1)
    assert found["episode_end_agreement"] == 1.0
    assert found["differences"] == []
    say_replayed(result, None)
    assert "1 of the episodes ended by a crash or the clock." in capsys.readouterr().out
