"""Let a run's policy drive many tracks, and keep the table: evaluation-<time>/generalization.json."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from racecraft.errors import RunError
from racecraft.judging.trained import trained_camera, trained_vehicle
from racecraft.race.generalization import DIRECTIONS, Generalization, generalize
from racecraft.race.policy import load_policy
from racecraft.run.atomic import write_json
from racecraft.run.folder import RunFolder
from racecraft.sim.randomization import Randomization, load_randomization
from racecraft.sim.vehicle import Vehicle, load_vehicle
from racecraft.track import load_tracks


@dataclass(frozen=True, kw_only=True)
class RunGeneralization:
    """How far a run's policy gets on many tracks."""

    run: Path
    """The run folder."""
    step: int
    """Camera steps of training behind the checkpoint."""
    generalization: Generalization
    """Track by track."""
    path: Path
    """Where it is written."""

    def to_dict(self) -> dict[str, Any]:
        """As JSON."""
        return {"run": str(self.run), "step": self.step, **self.generalization.to_dict(), "file": str(self.path)}


def generalize_run(
    run: str | Path,
    *,
    tracks: str | Path | Sequence[str | Path] = "all",
    directions: Sequence[str] = DIRECTIONS,
    num_trials: int = 1,
    checkpoint: str | int = "best",
    vehicle: str | Vehicle | None = None,
    randomize: Randomization | str | Path = "none",
    seed: int = 0,
    num_threads: int = 0,
) -> RunGeneralization:
    """Let a run's policy try one lap on each of many tracks, both ways.

    Args:
        run: The run folder.
        tracks: ``all``, ``library``, ``generated:0..99``, a folder or tracks; see `racecraft.track.load_tracks`; one
            that is named twice is driven once.
        directions: ``forward``, ``reverse`` or both.
        num_trials: Laps to try on each track in each direction.
        checkpoint: ``best``, ``last`` or a number of steps.
        vehicle: By default the one it was trained with.
        randomize: Preset, file or ranges of what differs from trial to trial.
        seed: Of the starts and of the randomisation.
        num_threads: 0 takes one per core.

    Raises:
        RacecraftError: The run, its checkpoint, a track or a setting is not usable.
    """
    folder = RunFolder.open(run)
    info = folder.read_info()
    if not isinstance(vehicle, Vehicle):
        vehicle = load_vehicle(vehicle) if vehicle else trained_vehicle(info)
    if not isinstance(randomize, Randomization):
        randomize = load_randomization(randomize)
    roads = load_tracks(tracks)
    step, policy = load_policy(folder, checkpoint=checkpoint, num_threads=num_threads)
    found = generalize(
        policy,
        roads,
        directions=directions,
        num_trials=num_trials,
        seed=seed,
        vehicle=vehicle,
        camera=trained_camera(info),
        randomize=randomize,
        sensors=policy.sensors,
        num_threads=num_threads,
    )
    try:
        path = folder.new_evaluation()[1] / "generalization.json"
        write_json(path, {"step": step, "seed": int(seed), **found.to_dict()})
    except OSError as error:
        raise RunError(f"{error.filename or folder.path} cannot be written: {error.strerror or error}.") from error
    return RunGeneralization(run=folder.path, step=step, generalization=found, path=path)
