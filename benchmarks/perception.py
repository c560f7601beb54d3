"""How well perception sees roads that it never learned from, and how a car drives by it, beside policies end to end.

    .venv/bin/python benchmarks/perception.py                       # everything, minutes of CPU time
    .venv/bin/python benchmarks/perception.py --only sight
    .venv/bin/python benchmarks/perception.py --routes ../shared/tracks

Errors are those of the lens, median and 90th percentile, over cars that drive badly near the road's middle: over all of
them, and over those who have the road's middle in their picture. The last line on stdout is JSON.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from racecraft.perception import Perceiver, PerceptionDriver
from racecraft.perception.answers import HALF, NUM_CONTINUOUS, NUMBERS, ROWS
from racecraft.perception.network import WEIGHTS
from racecraft.perception.training import World
from racecraft.race.autopilot import Autopilot
from racecraft.race.generalization import generalize
from racecraft.race.policy import load_policy
from racecraft.run import RunFolder
from racecraft.run.starters import FOLDER
from racecraft.track import load_tracks

UNSEEN = ("kidney", "bowtie", "lakeside", "trefoil", "serpent", "boomerang", "delta", "harbor", "generated:500..511")
"""Tracks on which neither perception nor the starters learned."""
CONDITIONS = ("none", "strong", "real")
STARTERS = ("steady", "quick")
"""Policies end to end that come along."""
SPEEDS = (1.0, 1.5, 2.0, 2.5)
"""m/s on straights of the driver by perception."""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", choices=("sight", "driving"))
    parser.add_argument("--routes", nargs="+", default=list(UNSEEN), help="tracks, as of evaluate --tracks")
    parser.add_argument("--randomize", nargs="+", default=list(CONDITIONS), help="presets of the conditions")
    parser.add_argument("--looks", type=int, default=24, help="of sight: times that 128 cars are looked at")
    parser.add_argument("--speeds", nargs="+", type=float, default=list(SPEEDS), help="m/s on straights, by perception")
    parser.add_argument("--starters", nargs="*", default=list(STARTERS), help="who drives end to end")
    parser.add_argument("--weights", type=Path, help="others than those brought along")
    parser.add_argument("--num-threads", type=int, default=1)
    options = parser.parse_args()
    perceiver = Perceiver(options.weights or WEIGHTS, num_threads=options.num_threads)
    found: dict[str, Any] = {}
    if options.only != "driving":
        found["sight"] = [sight(perceiver, options.routes, each, looks=options.looks) for each in options.randomize]
    if options.only != "sight":
        found["driving"] = driving(perceiver, options)
    print(json.dumps(found))


def sight(perceiver: Perceiver, routes: list[str], randomize: str, *, looks: int) -> dict[str, Any]:
    """Errors over some 3,000 pictures, of 24 looks."""
    world = World(routes, num_envs=128, seed=11, randomize=randomize, lateral=0.1, turned=0.15, sway=0.08)
    errors: dict[str, list[NDArray[np.float32]]] = {}
    middle_seen: list[NDArray[np.bool_]] = []
    for _ in range(looks):
        frames, truth = [world.look() for _ in range(3)][-1]
        belief = perceiver(frames)
        for name, unit, told in (
            ("offset_cm", 100.0, belief.offset),
            ("heading_deg", np.degrees(1.0), belief.heading),
            ("heading_ahead_deg", np.degrees(1.0), belief.heading_ahead),
        ):
            wanted = name.rpartition("_")[0]
            column = truth[:, list(NUMBERS).index(wanted)] * NUMBERS[wanted]
            errors.setdefault(name, []).append(unit * np.abs(told - column))
        is_there = truth[:, NUM_CONTINUOUS : NUM_CONTINUOUS + len(ROWS)] > 0.5
        middle_seen.append(is_there.any(axis=1))
        columns = truth[:, len(NUMBERS) : NUM_CONTINUOUS] * HALF + HALF - 0.5
        errors.setdefault("middle_px", []).append(np.abs(belief.middle - columns)[is_there])
    in_sight = np.concatenate(middle_seen)
    row: dict[str, Any] = {"randomize": randomize, "middle_in_sight": round(float(in_sight.mean()), 3)}
    for name, parts in errors.items():
        values = np.concatenate(parts)
        row[name] = _spread(values)
        if len(values) == len(in_sight):
            row[name]["in sight"] = _spread(values[in_sight])
    told = (f"{name} {row[name]['median']:.2f} / {row[name]['90 %']:.2f}" for name in errors)
    print(f"{randomize:8}", *told)
    return row


def _spread(values: NDArray[np.float32]) -> dict[str, Any]:
    return {"median": round(float(np.median(values)), 2), "90 %": round(float(np.percentile(values, 90)), 2)}


def driving(perceiver: Perceiver, options: argparse.Namespace) -> list[dict[str, Any]]:
    """Laps tried once on each track, each way, by perception at several speeds and by the starters."""
    threads: int = options.num_threads
    drivers: dict[str, Callable[..., Any]] = {
        f"perception, {speed:g} m/s": PerceptionDriver(perceiver, autopilot=Autopilot(speed=speed))
        for speed in options.speeds
    }
    for name in options.starters:
        drivers[f"starter:{name}"] = load_policy(RunFolder.open(FOLDER / name), num_threads=threads)[1]
    tracks, rows = load_tracks(options.routes), []
    for name, driver in drivers.items():
        for randomize in options.randomize:
            found = generalize(driver, tracks, randomize=randomize, num_threads=threads)
            paces = [result.length / time for result in found.results for time in result.lap_times]
            pace = round(float(np.mean(paces)), 2) if paces else None
            rows.append(
                {"driver": name, "randomize": randomize, "laps": found.laps, "trials": found.trials, "m/s": pace}
            )
            print(f"{name:20} {randomize:8} {found.laps:4} of {found.trials} laps, {pace} m/s")
    return rows


if __name__ == "__main__":
    main()
