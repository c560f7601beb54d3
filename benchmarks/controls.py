"""Whether starters drive by what they see: the same laps without it, or with what another car saw.

    .venv/bin/python benchmarks/controls.py --routes ../shared/tracks
    .venv/bin/python benchmarks/controls.py dodger --routes ../shared/tracks --laps 20

A starter that drives alone tries one lap on each route, both ways; `dodger` tries laps among six boxes at random
places, on the closed routes of 0.9 to 1.1 m. Each does so as it is; blind, told in every step and every car the mean of
what all cars are told at the start; and shuffled, told what any of the last 4,096 sights was, of whatever car and
moment. Of several sensors each is taken away by itself, too. Nobody puts a car back. The last line on stdout is JSON
with laps, trials and the mean share of a lap that was driven, by starter and by what it was told.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable, Iterator, Sequence
from statistics import mean
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from racecraft import load_tracks
from racecraft.race import evaluate, generalize
from racecraft.race.policy import NetworkPolicy, load_driver
from racecraft.race.rules import RaceRules
from racecraft.run.starters import starter_names
from racecraft.sim import objects_for_race
from racecraft.track import Track

AMONG_OBJECTS: Final = frozenset({"dodger"})
BOXES: Final = objects_for_race("object-avoidance", settings={"count": 6, "placement": "random"})
WIDTHS: Final = (0.9, 1.1)
"""m, mean, of the roads that races among objects used."""
REMEMBERED: Final = 4096
SEED: Final = 777

Sights = NDArray[np.uint8]
Driver = Callable[[Sights], NDArray[np.float32]]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("starters", nargs="*", help=f"by default {', '.join(starter_names())}")
    parser.add_argument("--routes", required=True, help="folder or names of routes")
    parser.add_argument("--laps", type=int, default=6, help="among boxes, on each route")
    parser.add_argument("--num-threads", type=int, default=0)
    options = parser.parse_args()
    routes, found = load_tracks(options.routes), {}
    for starter in options.starters or starter_names():
        policy = load_driver(f"starter:{starter}")
        rows = {}
        for told, driver in drivers(policy):
            if starter in AMONG_OBJECTS:
                rows[told] = among_boxes(driver, policy, routes, options)
            else:
                rows[told] = alone(driver, policy, routes, options)
            print(f"{starter:8}{told:26}{rows[told]}", flush=True)
        found[starter] = rows
    print(json.dumps(found))


def drivers(policy: NetworkPolicy) -> Iterator[tuple[str, Driver]]:
    """The policy under each control, by what it is told."""
    yield "as it is", policy
    sensors: dict[str, Any] = {"": ...}
    if size := policy.sensors.lidar_size:
        sensors |= {"camera ": np.s_[:, :-size], "LIDAR ": np.s_[:, -size:]}
    for sensor, part in sensors.items():
        yield f"{sensor}blind", Blind(policy, part)
        yield f"{sensor}shuffled", Shuffled(policy, part)


class Blind:
    """Told the mean of what all cars were first told, of a part of each row."""

    def __init__(self, policy: NetworkPolicy, part: Any) -> None:
        self._policy, self._part = policy, part
        self._flat: NDArray[np.uint8] | None = None

    def __call__(self, sights: Sights) -> NDArray[np.float32]:
        told = sights.copy()
        if self._flat is None:
            self._flat = np.rint(told[self._part].mean(axis=0)).astype(np.uint8)
        told[self._part] = self._flat
        return self._policy(told)


class Shuffled:
    """Told what some car was told in one of the steps before, of a part of each row."""

    def __init__(self, policy: NetworkPolicy, part: Any) -> None:
        self._policy, self._part = policy, part
        self._draw = np.random.default_rng(SEED)
        self._before: NDArray[np.uint8] | None = None
        self._count = 0

    def __call__(self, sights: Sights) -> NDArray[np.float32]:
        if self._before is None:
            self._before = np.empty((REMEMBERED, *sights.shape[1:]), np.uint8)
        self._before[(self._count + np.arange(len(sights))) % REMEMBERED] = sights
        self._count += len(sights)
        told = sights.copy()
        drawn = self._draw.integers(0, min(self._count, REMEMBERED), len(sights))
        told[self._part] = self._before[drawn][self._part]
        return self._policy(told)


def alone(
    driver: Driver, policy: NetworkPolicy, routes: Sequence[Track], options: argparse.Namespace
) -> dict[str, float]:
    """A lap on each route, both ways."""
    found = generalize(driver, routes, sensors=policy.sensors, seed=SEED, num_threads=options.num_threads)
    return {"laps": found.laps, "trials": found.trials, "completion": round(found.completion, 3)}


def among_boxes(
    driver: Driver, policy: NetworkPolicy, routes: Sequence[Track], options: argparse.Namespace
) -> dict[str, float]:
    """Laps among boxes on each route of their width."""
    completions: list[float] = []
    for route in routes:
        if not (route.is_closed and WIDTHS[0] <= round(float(route.mean_width), 2) <= WIDTHS[1]):
            continue
        found = evaluate(
            driver,
            route,
            rules=RaceRules(laps=1, max_resets=0),
            num_trials=options.laps,
            seed=SEED,
            objects=BOXES,
            sensors=policy.sensors,
            num_threads=options.num_threads,
        )
        completions += [trial.completion for trial in found.trials]
    laps = sum(share >= 1.0 for share in completions)
    return {"laps": laps, "trials": len(completions), "completion": round(mean(completions), 3)}


if __name__ == "__main__":
    main()
