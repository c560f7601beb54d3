"""How well perception sees roads that it never learned from, and how a car drives by it, beside policies end to end.

    .venv/bin/python benchmarks/perception.py                       # everything, minutes of CPU time
    .venv/bin/python benchmarks/perception.py --only sight
    .venv/bin/python benchmarks/perception.py --only sight --pictures 150
    .venv/bin/python benchmarks/perception.py --routes ../shared/tracks
    .venv/bin/python benchmarks/perception.py --only driving --speeds 1.5 --runs runs/mine runs/beliefs

Errors are those of the lens, median and 90th percentile: over all cars, and over those who have the road's middle in
their picture; of each picture by itself, with those before it remembered, and told what the car was told as well; over
all pictures of drives from standing, and from the eighth of a drive on. Cars drive badly near the road's middle, and
then by what is seen and remembered, at 1.5 m/s. Drivers by perception remember, and those "alone" do not. The last line
on stdout is JSON.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from racecraft.perceiving import PerceptionDriver
from racecraft.perception import Belief, Perceiver, Watcher
from racecraft.perception.answers import HALF, IN_SIGHT, MIDDLES, NUMBERS, PLACES
from racecraft.perception.network import WEIGHTS
from racecraft.perception.worlds import Episodes, World
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
EARLY = 8
"""Pictures of a drive until memory has something to go by."""
PACE = 1.5
"""m/s on straights of who is watched while driving by what is seen."""
SPEEDS = (1.0, 1.5, 2.0, 2.5)
"""m/s on straights of the driver by perception."""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", choices=("sight", "driving"))
    parser.add_argument("--routes", nargs="+", default=list(UNSEEN), help="tracks, as of evaluate --tracks")
    parser.add_argument("--randomize", nargs="+", default=list(CONDITIONS), help="presets of the conditions")
    parser.add_argument("--looks", type=int, default=24, help="of sight: times that 128 cars are looked at")
    parser.add_argument("--pictures", type=int, default=30, help="of sight: those of a drive")
    parser.add_argument("--speeds", nargs="*", type=float, default=list(SPEEDS), help="m/s on straights, by perception")
    parser.add_argument("--starters", nargs="*", default=list(STARTERS), help="who drives end to end")
    parser.add_argument("--runs", nargs="*", type=lambda path: (Path(path).name, path), default=[], help="others")
    parser.add_argument("--weights", type=Path, help="others than those brought along")
    parser.add_argument("--num-threads", type=int, default=1)
    options = parser.parse_args()
    perceiver = Perceiver(options.weights or WEIGHTS, num_threads=options.num_threads)
    found: dict[str, Any] = {}
    if options.only != "driving":
        episodes = Episodes(lateral=0.1, turned=0.15, sway=0.08, steps=options.pictures)
        found["sight"] = [
            sight(perceiver, options.routes, each, episodes, looks=options.looks, by_sight=by_sight)
            for each in options.randomize
            for by_sight in (False, True)
        ]
    if options.only != "sight":
        found["driving"] = driving(perceiver, options)
    print(json.dumps(found))


class Seeing(World):
    """Cars that are driven by what is seen and remembered."""

    driver: PerceptionDriver

    def drive(self) -> NDArray[np.float32]:
        self.driver.forget(self.begins)
        return self.driver(self.simulation.frames)


def sight(
    perceiver: Perceiver, routes: list[str], randomize: str, episodes: Episodes, *, looks: int, by_sight: bool
) -> dict[str, Any]:
    """Errors over some 3,000 pictures, of 24 looks, every third of which counts."""
    world = (Seeing if by_sight else World)(routes, episodes, num_envs=128, seed=11, randomize=randomize)
    if isinstance(world, Seeing):
        world.driver = PerceptionDriver(perceiver, autopilot=Autopilot(speed=PACE))
    alone, told, ages = Watcher(perceiver), Watcher(perceiver), np.zeros(128, int)
    parts: list[dict[str, Any]] = []
    for look in range(1, 3 * looks + 1):
        frames, truth = world.look()
        for watcher in (alone, told):
            watcher.forget(world.begins)
        told.tell(world.commands)
        ages = np.where(world.begins, 1, ages + 1)
        remembering, knowing = alone(frames), told(frames)
        if look % 3 == 0:
            part: dict[str, Any] = {"is_in_sight": _is_there(truth).any(axis=1), "is_late": ages >= EARLY}
            part |= _where(perceiver(frames), truth) | _columns(remembering, truth)
            for name, belief in (("remembering", remembering), ("told commands", knowing)):
                part |= {f"{name} {what}": errors for what, errors in _where(belief, truth).items()}
            parts.append(part)
    errors = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
    in_sight, late = errors.pop("is_in_sight"), errors.pop("is_late")
    driver = f"by sight, {PACE:g} m/s" if by_sight else "badly"
    row: dict[str, Any] = {
        "randomize": randomize, "driven": driver, "pictures": episodes.steps,
        "middle_in_sight": round(float(in_sight.mean()), 3),
    }  # fmt: skip
    for name, values in errors.items():
        row[name] = _spread(values)
        if len(values) == len(in_sight):
            row[name]["in sight"] = _spread(values[in_sight])
            if late.any():
                row[name][f"from the {EARLY}th on"] = _spread(values[late])
    told_of = (f"{name} {row[name]['median']:.2f} / {row[name]['90 %']:.2f}" for name in errors)
    print(f"{randomize:8} driven {driver}:", *told_of)
    return row


def _where(belief: Belief, truth: NDArray[np.float32]) -> dict[str, NDArray[Any]]:
    """How far off it is where each of N lenses is and looks  (N,)."""
    found = {}
    for name, unit, told in (
        ("offset_cm", 100.0, belief.offset),
        ("heading_deg", np.degrees(1.0), belief.heading),
        ("heading_ahead_deg", np.degrees(1.0), belief.heading_ahead),
    ):
        wanted = name.rpartition("_")[0]
        column = truth[:, PLACES[wanted]] * NUMBERS[wanted]
        found[name] = unit * np.abs(told - column)
    return found


def _columns(belief: Belief, truth: NDArray[np.float32]) -> dict[str, NDArray[Any]]:
    columns = truth[:, MIDDLES] * HALF + HALF - 0.5
    return {"middle_px": np.abs(belief.middle - columns)[_is_there(truth)]}


def _is_there(truth: NDArray[np.float32]) -> NDArray[np.bool_]:
    return np.asarray(truth[:, IN_SIGHT] > 0.5)


def _spread(values: NDArray[np.float32]) -> dict[str, Any]:
    return {"median": round(float(np.median(values)), 2), "90 %": round(float(np.percentile(values, 90)), 2)}


def driving(perceiver: Perceiver, options: argparse.Namespace) -> list[dict[str, Any]]:
    """Laps tried once on each track, each way, by perception at several speeds and by the starters."""
    threads: int = options.num_threads
    drivers: dict[str, Callable[..., Any]] = {
        f"perception{name}, {speed:g} m/s": PerceptionDriver(
            perceiver, autopilot=Autopilot(speed=speed), remembers=remembers
        )
        for speed in options.speeds
        for name, remembers in (("", True), (" alone", False))
    }
    for name, folder in (*((f"starter:{name}", FOLDER / name) for name in options.starters), *options.runs):
        drivers[name] = load_policy(RunFolder.open(folder), num_threads=threads)[1]
    tracks, rows = load_tracks(options.routes), []
    for name, driver in drivers.items():
        for randomize in options.randomize:
            found = generalize(driver, tracks, randomize=randomize, num_threads=threads)
            paces = [result.length / time for result in found.results for time in result.lap_times]
            pace = round(float(np.mean(paces)), 2) if paces else None
            rows.append(
                {"driver": name, "randomize": randomize, "laps": found.laps, "trials": found.trials, "m/s": pace}
            )
            print(f"{name:26} {randomize:8} {found.laps:4} of {found.trials} laps, {pace} m/s")
    return rows


if __name__ == "__main__":
    main()
