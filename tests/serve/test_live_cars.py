"""The file in which a training shows its cars: it moves with every step, and ends with the training."""

from __future__ import annotations

import json
import time
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest

from racecraft.serve.jobs.queue import JobQueue
from racecraft.serve.live import cars
from racecraft.serve.live.cars import MAX_CARS, LiveReader, write_live
from racecraft.serve.models.tasks import LiveReporter
from racecraft.serve.streams.hub import Hub
from racecraft.sim.objects import OBJECT_KINDS
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


def told(*, count: int = 1, pose: float = 0.0, kind: float = 0.0, place: float = 0.0, policy: float = 0.5) -> bytes:
    """What another machine may show: so many cars, and one object."""
    header = np.array([2, 5, time.time_ns(), count, 2, 2, 2, 1, 0], np.int64)
    parts: list[Any] = [header, np.full((count, 6), pose, np.float32), np.zeros(count, np.int32)]
    parts += [np.float32([kind, place, 0.0, 0.0]), np.full(2, policy, np.float32), np.zeros((2, 2), np.uint8)]
    return b"".join(part.tobytes() for part in parts)


@pytest.mark.parametrize(
    "odd",
    [
        *(
            {"pose": np.nan},
            {"pose": np.inf},
            {"pose": 3e38},
            {"kind": len(OBJECT_KINDS)},
            {"kind": -1},
            {"kind": np.nan},
        ),
        *({"place": np.nan}, {"place": -np.inf}, {"policy": np.nan}, {"count": MAX_CARS + 1}),
    ],
    ids=str,
)
def test_cars_of_another_machine_that_cannot_be_are_not_shown(tmp_path: Path, odd: dict[str, Any]) -> None:
    """They ended the stream of whoever looked, or reached the browser as NaN, which is no JSON there."""
    write_live(tmp_path, told(**odd))
    hub = Hub(tmp_path.parent, cast(JobQueue, None))
    assert hub.live(tmp_path.name, after=-1) is None
    assert hub.eye(tmp_path.name, after=-1) is None
    write_live(tmp_path, told(count=MAX_CARS, kind=len(OBJECT_KINDS) - 1, pose=1e5))
    found = Hub(tmp_path.parent, cast(JobQueue, None)).live(tmp_path.name, after=-1)
    assert found is not None
    (line,) = [line for line in found[1].decode().splitlines() if line.startswith("data: ")]
    assert len(json.loads(line.removeprefix("data: "))["poses"]) == MAX_CARS
