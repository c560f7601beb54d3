"""How a model came to drive as it does: laps of its training from one start, the first to the best, and a film.

metrics/evolution.jsonl, or the checkpoints that are kept -> drives -> film of fifteen seconds
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Final

import numpy as np

from racecraft.errors import RunError
from racecraft.film.evolution import film_drives
from racecraft.judging.trained import trained_camera, trained_track, trained_vehicle
from racecraft.limits import known_limit
from racecraft.race import RULE_SETS, Evaluation, evaluate
from racecraft.race.placement import driven_track
from racecraft.race.policy import load_policy
from racecraft.race.rules import RaceRules
from racecraft.run import RunFolder
from racecraft.run.evolution import Drive, evenly, read_drives, records

SHOWN: Final = 8
"""Cars in one picture; more cannot be told apart."""


def trained_rules(folder: RunFolder) -> RaceRules:
    """One lap from the line in the direction that a model learned."""
    direction = "reverse" if folder.read_info().settings.get("direction") == "reverse" else "forward"
    return replace(RULE_SETS["first_lap"], direction=direction)


def drive_checkpoint(folder: RunFolder, step: int, *, num_trials: int = 5) -> Evaluation:
    """First laps of a checkpoint, alone on its own road in its own car.

    Raises:
        RacecraftError: Its files cannot be read.
    """
    info = folder.read_info()
    _, policy = load_policy(folder, checkpoint=step, num_threads=1)
    return evaluate(
        policy,
        trained_track(info),
        rules=trained_rules(folder),
        num_trials=num_trials,
        vehicle=trained_vehicle(info),
        camera=trained_camera(info),
        num_threads=1,
    )


def evolution_of(folder: RunFolder, *, most: int = SHOWN) -> list[Drive]:
    """Laps of a training that beat all before them, in their order; at the end the best checkpoint's, which beats all.

    A run from before laps were kept, or from elsewhere, has those of the checkpoints that it still has.

    Raises:
        RacecraftError: Its files cannot be read.
    """
    best = folder.checkpoints.best
    if best is None:
        return []
    kept = [drive for drive in read_drives(folder) if drive.step < best.step]
    if not kept:
        steps = sorted(entry.step for entry in folder.checkpoints.entries() if entry.step < best.step)
        kept = [_drive(folder, step) for step in steps]
    last = _drive(folder, best.step)
    return [*evenly(records(kept, last), most - 1), last]


def film_evolution(run: str | Path, path: str | Path | None = None) -> Path:
    """Film how a run learned: its laps as cars on one road, coloured from the first to the best.

    Args:
        run: The run folder.
        path: Where to, ending in ``.mp4``; by default ``mp4/evolution.mp4`` in the run folder.

    Raises:
        RunError: There is nothing to film.
        RacecraftError: The run cannot be read, or the film cannot be written.
    """
    folder = RunFolder.open(run)
    drives = evolution_of(folder)
    if len(drives) < 2:
        raise RunError(f"{folder.name} has no earlier laps to show beside its best.", hint="Train it a little longer.")
    info = folder.read_info()
    track = driven_track(trained_track(info), trained_rules(folder))
    limit = known_limit(track, trained_vehicle(info))
    best = drives[-1].lap_time
    medal = limit.medals.won_by(best) if limit is not None and best is not None else ""
    target = Path(path) if path is not None else folder.videos / "evolution.mp4"
    return film_drives(drives, track, target, name=folder.name, medal=medal)


def _drive(folder: RunFolder, step: int) -> Drive:
    (trial,) = drive_checkpoint(folder, step, num_trials=1).trials
    lap = trial.recording
    return Drive(
        step=step,
        lap_time=lap.lap_times.get(1),
        completion=1.0 if 1 in lap.lap_times else float(lap.column("progress").max(initial=0.0)),
        poses=np.rint(1000.0 * lap.poses).astype(np.int64),
    )
