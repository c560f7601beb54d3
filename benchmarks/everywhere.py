"""How far, and how fast, a policy gets on roads that it never saw: train on our own, drive the official ones.

    .venv/bin/python benchmarks/everywhere.py --routes ../shared/tracks --seeds 1,2 --until "15 minutes" -o table.json

For each seed: `racecraft train --recipe everywhere` (or another one), then one lap on each route, both ways, from a
standing start and with nobody to put the car back, as it is and under strong randomisation. The last line on stdout is
JSON with a figure for each seed: the share of laps completed (each without leaving the road), and the median of their
times over the route's minimum (of its own direction; computed once, some seconds a route, and then kept).
"""

from __future__ import annotations

import argparse
import json
import resource
import statistics
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from racecraft import generalize, load_tracks, train
from racecraft.limits import track_limit
from racecraft.sim import load_vehicle
from racecraft.track import Track, joint_digest
from racecraft.training.recipes import RECIPES


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--recipe", default="everywhere", choices=RECIPES)
    parser.add_argument("--tracks", action="append", help="tracks to train on, instead of the recipe's")
    parser.add_argument("--routes", default="generated:1000..1063,radius=0.45", help="tracks to judge on")
    parser.add_argument("--until", default="15 minutes", help="limit of each training")
    parser.add_argument("--seeds", default="1", help="as 1,2,3")
    parser.add_argument("--num-threads", type=int, default=0)
    parser.add_argument("--no-minimum", action="store_true", help="leave the minimum lap times out")
    parser.add_argument("--runs", type=Path, help="keep the runs here; by default they are thrown away")
    parser.add_argument("-o", "--output", type=Path, help="write the whole table here")
    options = parser.parse_args()

    judged = load_tracks(options.routes)
    options.tracks = options.tracks or list(RECIPES[options.recipe]["track"])
    seen = {track.digest for track in load_tracks(options.tracks)}
    if seen & {track.digest for track in judged}:
        parser.error("a track of --routes is one of those to train on")
    minima = {} if options.no_minimum else _minima(judged)
    documents = []
    with tempfile.TemporaryDirectory() as scratch:
        for seed in map(int, options.seeds.split(",")):
            documents.append(_measure(seed, options, minima, root=options.runs or Path(scratch)))
            _say(documents[-1])
    document = {
        "recipe": options.recipe,
        "tracks": options.tracks,
        "judged_on": joint_digest(judged),
        "runs": documents,
    }
    if options.output is not None:
        options.output.write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")
    figures = {
        "lap_share": [run["as_it_is"]["lap_share"] for run in documents],
        "clean_share": [run["as_it_is"]["lap_share"] for run in documents],  # who leaves the road has no lap
        "over_minimum": [run["as_it_is"]["over_minimum"] for run in documents],
        "lap_share_strong": [run["strong"]["lap_share"] for run in documents],
        "over_minimum_strong": [run["strong"]["over_minimum"] for run in documents],
    }
    print(json.dumps({"recipe": options.recipe, "until": options.until, **figures}))


def _minima(tracks: list[Track]) -> dict[tuple[str, str], float]:
    """Minimum lap times, s, by track and direction, of those that are closed."""
    vehicle, minima = load_vehicle("v5"), {}
    for track in tracks:
        if track.is_closed:
            for direction, road in (("forward", track), ("reverse", track.reversed())):
                minima[track.name, direction] = track_limit(road, vehicle).ideal
    return minima


def _measure(
    seed: int, options: argparse.Namespace, minima: dict[tuple[str, str], float], *, root: Path
) -> dict[str, Any]:
    cpu, wall = time.process_time(), time.perf_counter()
    result = train(
        options.tracks,
        recipe=options.recipe,
        until=options.until,
        seed=seed,
        num_threads=options.num_threads,
        root=root,
        name=f"{options.recipe}-{seed}",
    )
    trained: dict[str, Any] = {
        "seed": seed,
        "steps": result.steps,
        "seconds": round(time.perf_counter() - wall, 1),
        "cpu_seconds": round(time.process_time() - cpu, 1),
        "peak_memory_mb": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss // 1024,
    }
    for kind, randomize in (("as_it_is", "none"), ("strong", "strong")):
        found = generalize(
            result.run, tracks=options.routes, randomize=randomize, seed=seed, num_threads=options.num_threads
        ).generalization
        ratios = [
            lap / minima[row.track, row.direction]
            for row in found.results
            if (row.track, row.direction) in minima
            for lap in row.lap_times
        ]
        over = round(statistics.median(ratios), 4) if ratios else None
        trained[kind] = {**found.to_dict(), "over_minimum": over}
    return trained


def _say(run: dict[str, Any]) -> None:
    parts = [f"{key} {run[key]:,}" for key in ("seed", "steps", "seconds", "cpu_seconds", "peak_memory_mb")]
    for kind in ("as_it_is", "strong"):
        found = run[kind]
        share, low, high = 100 * found["lap_share"], *(100 * end for end in found["lap_interval"])
        parts.append(f"{kind} {found['laps']}/{found['trials']} laps = {share:.1f} % ({low:.0f} to {high:.0f})")
        if found["over_minimum"] is not None:
            parts.append(f"median lap {found['over_minimum']:.2f} times the minimum")
    print(", ".join(parts), file=sys.stderr, flush=True)


if __name__ == "__main__":
    main()
