"""How well perception sees roads that it never learned from, and how a car drives by it, beside policies end to end.

    .venv/bin/python benchmarks/perception.py                       # everything, minutes of CPU time
    .venv/bin/python benchmarks/perception.py --only sight
    .venv/bin/python benchmarks/perception.py --routes ../shared/tracks

Errors are those of the lens, median and 90th percentile, over cars that drive badly near the road's middle. The last
line on stdout is JSON.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable
from typing import Any

import numpy as np

from racecraft.perception import Perceiver, PerceptionDriver
from racecraft.perception.answers import HALF, NUM_CONTINUOUS, NUMBERS, ROWS
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
SPEEDS = (1.0, 1.5, 2.0, 2.5)
"""m/s on straights of the driver by perception."""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", choices=("sight", "driving"))
    parser.add_argument("--routes", nargs="+", default=list(UNSEEN), help="tracks, as of evaluate --tracks")
    parser.add_argument("--num-threads", type=int, default=1)
    options = parser.parse_args()
    perceiver = Perceiver(num_threads=options.num_threads)
    found: dict[str, Any] = {}
    if options.only != "driving":
        found["sight"] = [sight(perceiver, options.routes, randomize) for randomize in CONDITIONS]
    if options.only != "sight":
        found["driving"] = driving(perceiver, options.routes, num_threads=options.num_threads)
    print(json.dumps(found))


def sight(perceiver: Perceiver, routes: list[str], randomize: str) -> dict[str, Any]:
    """Errors over some 3,000 pictures."""
    world = World(routes, num_envs=128, seed=11, randomize=randomize, lateral=0.1, turned=0.15, sway=0.08)
    looks = []
    for _ in range(24):
        frames, targets = [world.look() for _ in range(3)][-1]
        looks.append((perceiver(frames), targets))
    errors: dict[str, list[float]] = {"offset_cm": [], "heading_deg": [], "middle_px": []}
    for belief, truth in looks:
        errors["offset_cm"].extend(100 * np.abs(belief.offset - truth[:, 0] * NUMBERS["offset"]))
        errors["heading_deg"].extend(np.degrees(np.abs(belief.heading - truth[:, 1] * NUMBERS["heading"])))
        is_there = truth[:, NUM_CONTINUOUS : NUM_CONTINUOUS + len(ROWS)] > 0.5
        columns = truth[:, len(NUMBERS) : NUM_CONTINUOUS] * HALF + HALF - 0.5
        errors["middle_px"].extend(np.abs(belief.middle - columns)[is_there])
    row: dict[str, Any] = {"randomize": randomize}
    for name, values in errors.items():
        row[name] = {"median": round(float(np.median(values)), 2), "90 %": round(float(np.percentile(values, 90)), 2)}
    print(
        f"{randomize:8}",
        *(f"{name} {value['median']:.2f} / {value['90 %']:.2f}" for name, value in list(row.items())[1:]),
    )
    return row


def driving(perceiver: Perceiver, routes: list[str], *, num_threads: int) -> list[dict[str, Any]]:
    """Laps tried once on each track, each way, by perception at several speeds and by the starters."""
    drivers: dict[str, Callable[..., Any]] = {
        f"perception, {speed:g} m/s": PerceptionDriver(perceiver, autopilot=Autopilot(speed=speed)) for speed in SPEEDS
    }
    for name in ("steady", "quick"):
        drivers[f"starter:{name}"] = load_policy(RunFolder.open(FOLDER / name), num_threads=num_threads)[1]
    tracks, rows = load_tracks(routes), []
    for name, driver in drivers.items():
        for randomize in CONDITIONS:
            found = generalize(driver, tracks, randomize=randomize, num_threads=num_threads)
            paces = [result.length / time for result in found.results for time in result.lap_times]
            pace = round(float(np.mean(paces)), 2) if paces else None
            rows.append(
                {"driver": name, "randomize": randomize, "laps": found.laps, "trials": found.trials, "m/s": pace}
            )
            print(f"{name:20} {randomize:8} {found.laps:4} of {found.trials} laps, {pace} m/s")
    return rows


if __name__ == "__main__":
    main()
