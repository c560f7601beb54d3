"""The file in which a training shows its cars: it moves with every step, and ends with the training."""

from __future__ import annotations

from pathlib import Path

import pytest

from racecraft.serve.live import cars
from racecraft.serve.live.cars import LiveReader
from racecraft.serve.models.tasks import LiveReporter
from racecraft.training import IterationReport, train


@pytest.mark.costly
def test_cars_move_before_the_first_iteration_ends_and_nobody_sees_them_after_the_last(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(cars, "SPACING", 0.0)
    reader = LiveReader(tmp_path / "mine")
    seen: list[int] = []

    class Watched(LiveReporter):
        def iteration(self, report: IterationReport) -> None:
            look = reader.look()
            assert look is not None
            seen.append(look.sequence)
            super().iteration(report)

    with Watched(tmp_path / "mine") as reporter:
        train("oval", name="mine", root=tmp_path, until="8192 steps", num_envs=16, seed=1, reporter=reporter)
        assert reader.is_live
    assert seen[0] > 2 * 10  # each look adds two to the number
    assert not reader.is_live
    assert reader.look() is None
