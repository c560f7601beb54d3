"""What a model's page shows when nobody trains: the lap that its best checkpoint drives, as often as it is asked.

run folder -> best checkpoint -> five starts, alone on its own road -> poses of the best
"""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Final

import numpy as np

from racecraft.judging.trained import trained_camera, trained_track, trained_vehicle
from racecraft.race import RULE_SETS, evaluate
from racecraft.race.policy import load_policy
from racecraft.run import RunFolder
from racecraft.serve.models.schemas import Demonstration

KEPT: Final = 64
"""Demonstrations of different checkpoints; a lap is some 10 kB."""


def demonstration(folder: RunFolder) -> Demonstration | None:
    """The lap of a model's best checkpoint; None without one.

    Raises:
        RacecraftError: Its files cannot be read.
    """
    best = folder.checkpoints.best
    if best is None:
        return None
    changed = (folder.path / "run.json").stat().st_mtime_ns
    return _drive(folder.path, best.step, changed)


@lru_cache(maxsize=KEPT)
def _drive(path: Path, step: int, _changed: int) -> Demonstration:
    folder = RunFolder(path)
    info = folder.read_info()
    direction = "reverse" if info.settings.get("direction") == "reverse" else "forward"
    _, policy = load_policy(folder, checkpoint=step, num_threads=1)
    driven = evaluate(
        policy,
        trained_track(info),
        rules=replace(RULE_SETS["first_lap"], direction=direction),
        vehicle=trained_vehicle(info),
        camera=trained_camera(info),
        num_threads=1,
    )
    lap = driven.best_trial.recording
    columns = [*lap.poses.T, lap.column("actual_speed"), lap.column("actual_steering_angle"), lap.column("progress")]
    milli = np.rint(1000.0 * np.column_stack(columns)).astype(int)
    return Demonstration(step=step, seconds=driven.best_lap, poses=milli.tolist())
