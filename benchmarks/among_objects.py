"""How clean laps among boxes and bots are: the plain command on each route, judged on laps it never drove.

    .venv/bin/python benchmarks/among_objects.py --routes ../shared/tracks --seeds 1,2 --until "15 minutes"
    .venv/bin/python benchmarks/among_objects.py --routes ../shared/tracks --run starter:dodger   # one policy for all

For each seed and each route as wide as those of races among objects: `racecraft train --race object-avoidance` (six
boxes at random places) or, with `--race head-to-bot`, three bots that change lanes, at 1 m/s or with other `--actions`
and `--sensors`; then 60 laps by the best checkpoint, each with places of its own. Nobody puts the car back: a lap
counts only when it is clean. The last line on stdout is JSON with a figure for each seed: the share of laps that are
clean (no other is completed), the share of the worst route, and the median of the routes' lap times over their minimum
without objects.
"""

from __future__ import annotations

import argparse
import json
import statistics
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from racecraft import evaluate, load_tracks, train
from racecraft.limits import track_limit
from racecraft.sim import load_vehicle, objects_for_race
from racecraft.track import Track
from racecraft.training import Until

RACES = {
    "object-avoidance": {"count": 6, "placement": "random"},
    "head-to-bot": {"count": 3, "placement": "random", "speed": 0.2, "changes_lane": True},
}
WIDTHS = (0.9, 1.1)
"""m, mean, to the centimetre."""
JUDGED_BY = 777
"""Seed of the laps that judge; trainings have others."""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument(
        "--routes", required=True, help="folder or names of routes; those of another width are left out"
    )
    parser.add_argument("--only", action="append", help="name of a route; repeatable")
    parser.add_argument("--race", choices=RACES, default="object-avoidance")
    parser.add_argument("--actions", help="the cars' action space; by default the race's own, 1 m/s")
    parser.add_argument("--sensors", default="", help="what they see with, joined by +; by default the race's own")
    parser.add_argument("--until", default="10 minutes", help="limit of each training")
    parser.add_argument("--seeds", default="1", help="as 1,2,3")
    parser.add_argument("--laps", type=int, default=60, help="that judge")
    parser.add_argument("--run", help="a run or starter to be judged instead of trainings")
    parser.add_argument("--num-threads", type=int, default=0)
    parser.add_argument("--no-minimum", action="store_true", help="leave the minimum lap times out")
    parser.add_argument("--runs", type=Path, help="keep the runs here; by default they are thrown away")
    parser.add_argument("-o", "--output", type=Path, help="write the whole table here")
    options = parser.parse_args()
    routes = [track for track in load_tracks(options.routes) if _is_judged(track, options.only)]
    if not routes:
        parser.error("there is no such route")
    rows = []
    with tempfile.TemporaryDirectory() as scratch:
        for seed in map(int, options.seeds.split(",")):
            for route in routes:
                rows.append(_measure(route, seed, options, root=options.runs or Path(scratch)))
                print(json.dumps(rows[-1]), file=sys.stderr, flush=True)
    if options.output is not None:
        options.output.write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")
    told = {"race": options.race, "actions": options.actions, "sensors": options.sensors, "until": options.until}
    print(json.dumps({**told, "routes": len(routes), **_summary(rows)}))


def _is_judged(track: Track, only: list[str] | None) -> bool:
    if only:
        return track.name in only
    return track.is_closed and WIDTHS[0] <= round(float(track.mean_width), 2) <= WIDTHS[1]


def _address(route: Track, routes: str) -> str:
    """What training takes for it: the file in a folder, or a name."""
    return str(next(Path(routes).glob(f"{route.name}.*"))) if Path(routes).is_dir() else route.name


def _measure(route: Track, seed: int, options: argparse.Namespace, *, root: Path) -> dict[str, Any]:
    """One training and what its policy does afterwards."""
    objects = objects_for_race(options.race, settings=RACES[options.race])
    path = _address(route, options.routes)
    row: dict[str, Any] = {"seed": seed, "route": route.name}
    run: str | Path = options.run
    if not run:
        cpu = time.process_time()
        result = train(
            path,
            objects=objects,
            actions=options.actions,
            sensors=tuple(filter(None, options.sensors.split("+"))),
            until=Until.parse(f"20 laps or {options.until}"),
            seed=seed,
            num_threads=options.num_threads,
            root=root,
            name=f"{options.race}-{route.name}-{seed}",
        )
        run = result.run
        row |= {"steps": result.steps, "seconds": round(result.wall_seconds, 1)}
        row["cpu_seconds"] = round(time.process_time() - cpu, 1)
    judged = evaluate(
        run,
        track=path,
        objects=objects,
        laps=1,
        max_resets=0,
        num_trials=options.laps,
        seed=JUDGED_BY,
        num_threads=options.num_threads,
        video=False,
    ).evaluation
    laps = [lap for trial in judged.trials for lap in trial.lap_times]
    row |= {"clean": len(laps), "of": options.laps, "lap_seconds": round(statistics.median(laps), 2) if laps else None}
    if laps and not options.no_minimum:
        row["over_minimum"] = round(row["lap_seconds"] / track_limit(route, load_vehicle("v5")).ideal, 2)
    return row


def _summary(rows: list[dict[str, Any]]) -> dict[str, list[float | None]]:
    found: dict[str, list[float | None]] = {"clean_share": [], "lap_share": [], "worst_route": [], "over_minimum": []}
    for seed in dict.fromkeys(row["seed"] for row in rows):
        of_seed = [row for row in rows if row["seed"] == seed]
        shares = [row["clean"] / row["of"] for row in of_seed]
        over = [row["over_minimum"] for row in of_seed if "over_minimum" in row]
        found["clean_share"].append(round(statistics.mean(shares), 4))
        found["lap_share"].append(round(statistics.mean(shares), 4))
        found["worst_route"].append(round(min(shares), 4))
        found["over_minimum"].append(statistics.median(over) if over else None)
    return found


if __name__ == "__main__":
    main()
