"""Trains the starters and writes them into the package, `src/racecraft/starters/`: small run folders of weights alone.

    .venv/bin/python benchmarks/starters.py                    # all, some minutes of CPU time each
    .venv/bin/python benchmarks/starters.py quick -o /tmp/here

The same version gives the same files to the bit: trainings end after so many steps, not at a time. Weights are rounded
to float16 where that costs no lap, for half of the bytes in the package, and read as float32. The last line on stdout
is JSON: file and SHA-256 of the weights by starter.
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
from racecraft.learn.learner import below
from racecraft.run import RunFolder
from racecraft.run.starters import FOLDER
from racecraft.sim.objects import NO_OBJECTS, Objects, Obstacles
from racecraft.track import joint_digest
from racecraft.training.parent import WEIGHTS

BOXES = Objects(obstacles=Obstacles(placement="random"))


class Starter(NamedTuple):
    """How one is made, and where it drives unless told otherwise: one road says more than all that it learned on."""

    recipe: str
    until: str
    track: str = "reinvent_2018"
    objects: Objects = NO_OBJECTS
    is_short: bool = True
    """Whether its weights are kept in 16 bits."""


STARTERS = {
    "quick": Starter("everywhere", "1500000 steps"),
    "steady": Starter("steady", "400000 steps"),
    "dodger": Starter("traffic", "3000000 steps", track="speedway", objects=BOXES, is_short=False),
}
SEED = 1
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
            digests[name] = write_starter(RunFolder.open(trained.run), options.output / name, starter)
    print(json.dumps(digests))


def write_starter(run: RunFolder, path: Path, starter: Starter) -> dict[str, str]:
    """The best checkpoint's weights, without anything of its training, as a run of its own; file and digest of them.

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
    made = RunFolder(path)
    origin = {"format": "racecraft", "recipe": path.name, "step": saved.step}
    metadata = {"network": saved.metadata["network"], "origin": origin}
    made.checkpoints.save(0, weights, metadata=metadata, time_stamp=datetime.fromisoformat(CREATED).timestamp())
    info, track = run.read_info(), load_track(starter.track)
    versions = {"racecraft": info.versions["racecraft"]}
    settings = {**info.settings, "objects": starter.objects.to_dict()}
    digest = joint_digest([track])
    made.write_info(
        replace(info, track=track.name, track_digest=digest, settings=settings, created=CREATED, versions=versions)
    )
    (entry,) = made.checkpoints.entries()
    return {"file": entry.file, "sha256": entry.sha256}


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
