"""How alike drivers are that were trained for themselves, and copies: what the league's threshold rests on.

python benchmarks/near_copies.py [--runs FOLDER] [--seeds 4] [--json]

Trains on two tracks with three action spaces (about 4 minutes of CPU; what is in FOLDER already is taken from there),
copies each driver in several ways, and compares their choices on hidden frames as a league does.
"""

from __future__ import annotations

import argparse
import itertools
import json
import tempfile
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path
from statistics import median
from typing import Final

import numpy as np
from numpy.typing import NDArray

from racecraft import train
from racecraft.race.conditions import Conditions
from racecraft.race.entry import Entry, load_entry
from racecraft.race.likeness import ALIKE, hidden_choices, likeness
from racecraft.race.rules import RaceRules
from racecraft.run.starters import unpack_starter
from racecraft.track import load_track

TRACKS: Final = ("oval", "reinvent_2018")
STEPS: Final = {"default": 30_720, "aws": 30_720, "continuous": 40_960}
"""Of training, by action space."""
TUNED: Final = (1024, 4096)
"""Steps for which a copy is trained on."""
NOISES: Final = (0.03, 0.1, 0.2)
"""Standard deviations of noise, as a share of that of each tensor's weights."""
FRAMES_SEED: Final = 5

Choices = NDArray[np.int16]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=Path)
    parser.add_argument("--seeds", type=int, default=4)
    parser.add_argument("--tracks", nargs="+", default=TRACKS)
    parser.add_argument("--steps", type=int, help="of every training, for a trial")
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    found: dict[str, list[float]] = defaultdict(list)
    with tempfile.TemporaryDirectory() as scratch:
        root = options.runs or Path(scratch)
        for track in options.tracks:
            for kind, value in compared(root, track, options.seeds, options.steps):
                found[kind].append(value)
    table = {kind: summary(values, is_copy=kind != "trained for themselves") for kind, values in found.items()}
    if not options.json:
        for kind, row in table.items():
            print(f"{kind:28} " + "  ".join(f"{name} {value}" for name, value in row.items()))
    print(json.dumps({"threshold": ALIKE, "likeness": table}))


def compared(root: Path, track: str, seeds: int, steps: int | None) -> Iterator[tuple[str, float]]:
    """Kinds of pairs and how alike each pair is, on one track."""
    conditions = Conditions(track=load_track(track), rules=RaceRules(laps=1))

    def choices(entry: Entry) -> Choices:
        return hidden_choices(entry, conditions, seed=FRAMES_SEED)

    drivers = {
        (actions, seed): load_entry(trained(root, track, actions, seed, steps or STEPS[actions]), num_threads=1)
        for actions in STEPS
        for seed in range(1, seeds + 1)
    }
    starters = [load_entry(unpack_starter(name, root), num_threads=1) for name in ("quick", "steady")]
    entries = [*drivers.values(), *starters]
    originals = [choices(entry) for entry in entries]
    for one, other in itertools.combinations(originals, 2):
        yield "trained for themselves", alike(one, other)
    for entry, original in zip(entries, originals, strict=True):
        learner, draw = entry.policy.learner, np.random.default_rng(3)
        weights = learner.weights()
        for noise in NOISES:
            learner.load_weights({name: noised(one, noise, draw) for name, one in weights.items()})
            yield f"weights with {100 * noise:.0f} % noise", alike(original, choices(entry))
        learner.load_weights(permuted(weights, draw))
        yield "units in another order", alike(original, choices(entry))
        learner.load_weights(weights)
    for actions, more in itertools.product(STEPS, TUNED):
        parent = drivers[actions, 1]
        tuned = trained(root, track, actions, 1, more, parent=parent.run)
        last = load_entry(f"{tuned}@last", num_threads=1)
        yield f"trained on for {more} steps", alike(choices(parent), choices(last))


def trained(root: Path, track: str, actions: str, seed: int, steps: int, *, parent: Path | None = None) -> Path:
    """A run, which is there already or is trained now; of a parent's child the parent's best checkpoint goes on."""
    name = f"{track}-{actions}-{seed}" + (f"-on-{steps}" if parent is not None else "")
    if not (root / name).is_dir():
        train(
            track=track,
            actions=actions,
            seed=seed if parent is None else 77,
            until=f"{steps} steps",
            num_threads=1,
            parent=parent,
            evaluate_every=4096 if parent is None else steps,
            root=root,
            name=name,
        )
    return root / name


def noised(weights: NDArray[np.float32], noise: float, draw: np.random.Generator) -> NDArray[np.float32]:
    """With noise of a share of their own spread."""
    return weights + (noise * weights.std() * draw.standard_normal(weights.shape)).astype(np.float32)


def permuted(weights: dict[str, NDArray[np.float32]], draw: np.random.Generator) -> dict[str, NDArray[np.float32]]:
    """The same function by other weights: the units before the head change places, and some count for twice as much."""
    last = max(name for name in weights if name.startswith("policy.dense") and name.endswith(".weight"))
    bias, head = last.replace("weight", "bias"), "policy.head.weight"
    order = draw.permutation(len(weights[bias]))
    scale = draw.choice(np.array([0.5, 1.0, 2.0], np.float32), len(order))
    return weights | {
        last: weights[last][order] * scale[:, None],
        bias: weights[bias][order] * scale,
        head: weights[head][:, order] / scale,
    }


def alike(one: Choices, other: Choices) -> float:
    return float(likeness(one, other[None])[0])


def summary(values: list[float], *, is_copy: bool) -> dict[str, float]:
    shown = {"pairs": len(values), "least": min(values), "median": median(values), "most": max(values)}
    found = sum(value >= ALIKE for value in values)
    return {name: round(value, 2) for name, value in shown.items()} | {"found" if is_copy else "looked_at": found}


if __name__ == "__main__":
    main()
