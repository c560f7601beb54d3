"""Trains the starters and writes them into the package, `src/racecraft/starters/`: small run folders of weights alone.

    .venv/bin/python benchmarks/starters.py                    # all, some minutes of CPU time each
    .venv/bin/python benchmarks/starters.py quick -o /tmp/here

The same version gives the same weights to the bit: trainings end after so many steps, not at a time. The last line on
stdout is JSON: file and SHA-256 of the weights by starter.
"""

from __future__ import annotations

import argparse
import json
import shutil
import tempfile
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

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


STARTERS = {
    "quick": Starter("everywhere", "1500000 steps"),
    "steady": Starter("steady", "400000 steps"),
    "dodger": Starter("traffic", "3000000 steps", track="speedway", objects=BOXES),
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
    """The best checkpoint's weights, without anything of its training, as a run of its own; file and digest of them."""
    shutil.rmtree(path, ignore_errors=True)
    path.mkdir(parents=True)
    for name in FILES:
        shutil.copyfile(run.path / name, path / name)
    saved = run.checkpoints.load("best")
    weights = {f"{WEIGHTS}{name}": array for name, array in below(WEIGHTS, saved.arrays).items()}
    made = RunFolder(path)
    origin = {"format": "racecraft", "recipe": path.name, "step": saved.step}
    made.checkpoints.save(0, weights, metadata={"network": saved.metadata["network"], "origin": origin})
    info, track = run.read_info(), load_track(starter.track)
    versions = {"racecraft": info.versions["racecraft"]}
    settings = {**info.settings, "objects": starter.objects.to_dict()}
    digest = joint_digest([track])
    made.write_info(
        replace(info, track=track.name, track_digest=digest, settings=settings, created=CREATED, versions=versions)
    )
    (entry,) = made.checkpoints.entries()
    return {"file": entry.file, "sha256": entry.sha256}


if __name__ == "__main__":
    main()
