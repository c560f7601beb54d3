"""How well the best of eyes could tell where a lens is from a single picture: the limit of `benchmarks/perception.py`.

    .venv/bin/python benchmarks/perception_limit.py                  # two minutes of CPU time a preset
    .venv/bin/python benchmarks/perception_limit.py --randomize none

A perceptron is given no picture but, without any error, where in the lens's own frame those points of the road's middle
and of its two borders are that lie within the picture, and learns what perception learns to tell. What it still errs by
no network can know: the road below the lens and behind it is in no picture. PyTorch comes with the development
environment. Errors are those on tracks that it did not learn from, median and 90th percentile. The last line on stdout
is JSON.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray

from perception import UNSEEN
from racecraft.perception.answers import HALF, NUMBERS, PLACES
from racecraft.perception.worlds import Episodes, World
from racecraft.sim import STATE_COLUMNS

Floats = NDArray[np.float64]

KNOWN = ("reinvent_2018", "oval", "hairpin", "generated:1000..1044", "generated:1100..1114,radius=0.45,difficulty=0.9")
"""Roads that perception learns from."""
AROUND = np.arange(-24, 112)
"""Points of a centre line, 2.5 cm apart, around the one nearest to the lens."""
TOLD = np.array([0, 1, 2, 3, 4, 5, 6, 8, 10, 12, 15, 18, 22, 27, 34, 42, 52, 64])
"""Points of a line that are told, counted from the first one in sight."""
SIGHT = 3.0
"""m to the last of them."""
WANTED = {"offset": 100.0, "heading": np.degrees(1.0), "heading_ahead": np.degrees(1.0)}
"""What is learned, and what its unit has of those that are printed: cm and degrees."""
UNITS = 256
"""Of each of the perceptron's two layers."""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--randomize", nargs="+", default=["strong"], help="presets of the conditions")
    parser.add_argument("--known", nargs="+", default=list(KNOWN), help="tracks to learn from, as of evaluate --tracks")
    parser.add_argument("--routes", nargs="+", default=list(UNSEEN), help="tracks to be told of")
    parser.add_argument("--looks", type=int, default=400, help="times that 512 cars are looked at, to learn from")
    parser.add_argument("--steps", type=int, default=10_000, help="of the perceptron's training")
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    torch.set_num_threads(1)
    found = []
    for randomize in options.randomize:
        seen, wanted, _ = gather(options.known, randomize, seed=options.seed, looks=options.looks, apart=1, wider=1.25)
        others, truth, nearest = gather(options.routes, randomize, seed=11, looks=max(options.looks // 30, 1), apart=3)
        told = learned(seen, wanted, steps=options.steps, seed=options.seed)(others)
        row: dict[str, Any] = {
            "randomize": randomize,
            "first_sight_cm": round(100 * float(np.median(nearest)), 1),
            "middle_in_sight": round(float((nearest < SIGHT).mean()), 3),
        }
        for place, (name, unit) in enumerate(WANTED.items()):
            errors = unit * np.abs(told[:, place] - truth[:, place])
            row[name] = {
                "median": round(float(np.median(errors)), 2),
                "90 %": round(float(np.percentile(errors, 90)), 2),
            }
        print(row)
        found.append(row)
    print(json.dumps(found))


def gather(
    tracks: list[str], randomize: str, *, seed: int, looks: int, apart: int, wider: float = 1.0
) -> tuple[Floats, Floats, Floats]:
    """What the best of eyes see, what is to be told of it, and m to where the road's middle comes into sight.

    Args:
        tracks: Names, as of `load_tracks`.
        randomize: Preset of the conditions.
        seed: Decides everything.
        looks: Times that 512 cars are looked at.
        apart: Steps between two of them.
        wider: Factor on how badly cars drive.
    """
    episodes = Episodes(lateral=0.1 * wider, turned=0.15 * wider, sway=0.08)
    world = World(tracks, episodes, num_envs=512, seed=seed, randomize=randomize)
    columns = [PLACES[name] for name in WANTED]
    sights, truths, firsts = [], [], []
    for _ in range(looks):
        targets = [world.look() for _ in range(apart)][-1][1]
        sight, first = in_sight(world)
        sights.append(sight)
        firsts.append(first)
        truths.append(targets[:, columns] * np.array(list(NUMBERS.values()))[columns])
    return np.concatenate(sights), np.concatenate(truths), np.concatenate(firsts)


def in_sight(world: World) -> tuple[Floats, Floats]:
    """Ahead, left and whether there is such a point, of each of three lines' points in the picture; m to the first."""
    truth, simulation = world._truth, world.simulation
    lenses = truth._lenses()
    x, y, cosine, sine, above, pitch, focal = (column[:, None] for column in lenses.T)
    roads = simulation.column("track_index").astype(int)
    nearest = truth._nearest(roads, x[:, 0], y[:, 0])
    line = truth._lines[roads[:, None], truth._index(roads, nearest[:, None] + AROUND)]
    along = np.gradient(line, axis=1)
    along /= np.linalg.norm(along, axis=2, keepdims=True) + 1e-9
    to_left = np.stack([-along[..., 1], along[..., 0]], axis=2)
    half_width = simulation.state[:, STATE_COLUMNS.index("half_width")].astype(float)[:, None, None]
    cars, told = np.arange(len(line))[:, None], []
    firsts = np.full(len(line), np.inf)
    for side in (0.0, 1.0, -1.0):
        points = line + side * half_width * to_left
        dx, dy = points[..., 0] - x, points[..., 1] - y
        ahead, left = dx * cosine + dy * sine, dy * cosine - dx * sine
        depth = ahead * np.cos(pitch) + above * np.sin(pitch)
        is_before = depth > 0.02
        deep = np.where(is_before, depth, 1.0)
        row = 59.5 + focal * (above * np.cos(pitch) - ahead * np.sin(pitch)) / deep
        is_seen = is_before & (row < 119.5) & (row > 30.0) & (np.abs(focal * left / deep) < HALF)
        is_seen &= np.hypot(ahead, left) < SIGHT
        first = np.where(is_seen.any(axis=1), is_seen.argmax(axis=1), 0)
        if side == 0.0:
            firsts = np.where(is_seen.any(axis=1), ahead[cars[:, 0], first], np.inf)
        which = (first[:, None] + TOLD).clip(0, len(AROUND) - 1)
        there = is_seen[cars, which]
        told += [np.where(there, ahead[cars, which], 0.0), np.where(there, left[cars, which], 0.0), there]
    return np.concatenate([*told, half_width[:, :, 0]], axis=1), firsts


def learned(seen: Floats, wanted: Floats, *, steps: int, seed: int) -> Callable[[Floats], Floats]:
    """A perceptron that has learned to tell what is wanted (N, 3) of what is seen (N, K)."""
    torch.manual_seed(seed)
    inputs, targets = torch.tensor(3.0 * seen).float(), torch.tensor(4.0 * wanted).float()
    network = torch.nn.Sequential(
        torch.nn.Linear(inputs.shape[1], UNITS),
        torch.nn.GELU(),
        torch.nn.Linear(UNITS, UNITS),
        torch.nn.GELU(),
        torch.nn.Linear(UNITS, targets.shape[1]),
    )
    adam = torch.optim.Adam(network.parameters())
    pace = torch.optim.lr_scheduler.OneCycleLR(adam, 3e-3, total_steps=steps)
    for _ in range(steps):
        rows = torch.randint(0, len(inputs), (512,))
        adam.zero_grad()
        (network(inputs[rows]) - targets[rows]).abs().mean().backward()
        adam.step()
        pace.step()

    def tell(others: Floats) -> Floats:
        with torch.no_grad():
            return np.asarray(network(torch.tensor(3.0 * others).float()), float) / 4.0

    return tell


if __name__ == "__main__":
    main()
