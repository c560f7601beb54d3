"""Trains the starters and writes them into the package, `src/racecraft/starters/`: small run folders of weights alone.

    .venv/bin/python benchmarks/starters.py                    # all, some minutes of CPU time each
    .venv/bin/python benchmarks/starters.py quick -o /tmp/here

The same version gives the same files to the bit: trainings end after so many steps, not at a time. Weights are rounded
to float16 where that costs no lap, for half of the bytes in the package, and read as float32. The last line on stdout
is JSON: file and SHA-256 of the weights by starter.

Who is to be fast on one road, once somebody trains it there, brings a teacher along: trained on many roads as well, but
paid by the metre alone. What its run says of reward and settings is how it goes on, not how it learned so far.
"""

from __future__ import annotations

import argparse
import json
import shutil
import tempfile
from dataclasses import replace
from datetime import datetime
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from racecraft import load_track, train
from racecraft.learn import DistillConfig
from racecraft.learn.learner import below
from racecraft.reward import load_preset
from racecraft.run import RunFolder
from racecraft.run.starters import FOLDER
from racecraft.sim.objects import NO_OBJECTS, Objects, Obstacles
from racecraft.track import joint_digest
from racecraft.training.parent import WEIGHTS
from racecraft.training.plan import make_plan
from racecraft.training.recipes import ROADS
from racecraft.training.start import read_settings
from racecraft.training.taught import taught, teachers_arrays

SEED = 1
BOXES = Objects(obstacles=Obstacles(placement="random"))


class Teacher(NamedTuple):
    """Of who goes on with a starter on one road: what it is paid for, also afterwards, and how long it learns."""

    reward: str
    lessons: DistillConfig


class Starter(NamedTuple):
    """How one is made, and where it drives unless told otherwise: one road says more than all that it learned on."""

    recipe: str
    until: str
    track: str = "reinvent_2018"
    objects: Objects = NO_OBJECTS
    is_short: bool = True
    """Whether its weights are kept in 16 bits."""
    teacher: Teacher | None = None


PACE = DistillConfig(teacher_steps=8_000_000, teacher_rate_steps=3_000_000)
STARTERS = {
    "quick": Starter("everywhere", "5219328 steps", teacher=Teacher("lap_time", PACE)),
    "steady": Starter("steady", "400000 steps"),
    "dodger": Starter("traffic", "3000000 steps", track="speedway", objects=BOXES, is_short=False),
}
CREATED = "2026-11-23T00:00:00+00:00"
FILES = ("reward_function.py", "model_metadata.json")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"of {', '.join(STARTERS)}; by default all")
    parser.add_argument("--until", help="another limit, for a trial")
    parser.add_argument("--num-threads", type=int, default=0)
    parser.add_argument("-o", "--output", type=Path, default=FOLDER)
    options = parser.parse_args()
    if unknown := set(options.names) - set(STARTERS):
        parser.error(f"there is no starter {', '.join(sorted(unknown))}")
    digests = {}
    for name in options.names or STARTERS:
        starter = STARTERS[name]
        with tempfile.TemporaryDirectory() as scratch:
            trained = train(
                recipe=starter.recipe,
                until=options.until or starter.until,
                seed=SEED,
                num_threads=options.num_threads,
                root=scratch,
                name=name,
            )
            brought = {} if starter.teacher is None else teachers_weights(starter, options.num_threads, Path(scratch))
            digests[name] = write_starter(RunFolder.open(trained.run), options.output / name, starter, brought)
    print(json.dumps(digests))


def teachers_weights(starter: Starter, num_threads: int, scratch: Path) -> dict[str, NDArray[Any]]:
    """A teacher of `ROADS`, as a checkpoint names it; its student sees just as much as it takes to save one."""
    assert starter.teacher is not None
    reward, lessons = starter.teacher
    settings = {"recipe": starter.recipe, "reward": reward, "distill": lessons, "until": "512 steps", "seed": SEED}
    trained = train(ROADS, **settings, num_threads=num_threads, root=scratch, name="teacher")
    run = RunFolder.open(trained.run)
    arrays = teachers_arrays(run.checkpoints.load("last"), read_settings(run), run.read_model_metadata())
    return {name: halves(name, array) for name, array in arrays.items()}


def write_starter(
    run: RunFolder, path: Path, starter: Starter, brought: dict[str, NDArray[Any]] | None = None
) -> dict[str, str]:
    """The best checkpoint's weights, without anything of its training, as a run of its own; file and digest of them.

    Args:
        run: That it learned in.
        path: Folder to be written.
        starter: What it is to be.
        brought: What a checkpoint holds of a teacher.

    Raises:
        ValueError: As `halves`; what is at the path stays.
    """
    saved = run.checkpoints.load("best")
    weights = {
        f"{WEIGHTS}{name}": halves(name, array) if starter.is_short else array
        for name, array in below(WEIGHTS, saved.arrays).items()
    }
    shutil.rmtree(path, ignore_errors=True)
    path.mkdir(parents=True)
    for name in FILES:
        shutil.copyfile(run.path / name, path / name)
    if starter.teacher is not None:
        (path / FILES[0]).write_text(load_preset(starter.teacher.reward), encoding="utf-8")
    made = RunFolder(path)
    origin = {"format": "racecraft", "recipe": path.name, "step": saved.step}
    metadata = {"network": saved.metadata["network"], "origin": origin}
    made.checkpoints.save(
        0, {**weights, **(brought or {})}, metadata=metadata, time_stamp=datetime.fromisoformat(CREATED).timestamp()
    )
    info, track = run.read_info(), load_track(starter.track)
    versions = {"racecraft": info.versions["racecraft"]}
    settings = {**_goes_on_by(starter, info.settings, run), "objects": starter.objects.to_dict(), "num_threads": 0}
    digest = joint_digest([track])
    made.write_info(
        replace(info, track=track.name, track_digest=digest, settings=settings, created=CREATED, versions=versions)
    )
    (entry,) = made.checkpoints.entries()
    return {"file": entry.file, "sha256": entry.sha256}


def _goes_on_by(starter: Starter, settings: dict[str, Any], run: RunFolder) -> dict[str, Any]:
    """The settings it learned by, or those of who learns the one road that it names."""
    if starter.teacher is None:
        return settings
    actions = run.read_model_metadata().action_space
    plan = make_plan(starter.track, reward=starter.teacher.reward, actions=actions, algorithm="distill")
    goes_on = replace(plan.settings, distill=taught(plan.settings.distill)).to_dict()
    return {name: goes_on[name] for name in settings}


def halves(name: str, weights: NDArray[Any]) -> NDArray[np.float16]:
    """The nearest numbers of 16 bits.

    Raises:
        ValueError: A weight is NaN, infinite, or too large for them.
    """
    with np.errstate(over="ignore"):  # told below
        rounded = weights.astype(np.float16)
    if not np.isfinite(rounded).all():
        raise ValueError(f"{name} has weights that are no finite numbers of 16 bits; the most is 65,504.")
    return rounded


if __name__ == "__main__":
    main()
