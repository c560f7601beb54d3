"""How near the best lap comes to the minimum lap time of the car, within minutes, on tracks of different kinds.

    .venv/bin/python benchmarks/fastest_lap.py --until "5 minutes" --seeds 1,2,3,4,5 -o table.json

For each track and seed: `racecraft train` as docs/training.md says, from random weights and from pixels, then
`racecraft evaluate` of its best checkpoint, five trials of three laps. A lap counts if it is clean. The last line on
stdout is JSON. `--from starter:quick` begins from a starter instead, and leaves the rest to the command.
"""

from __future__ import annotations

import argparse
import json
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from racecraft import load_track
from racecraft.limits import track_limit
from racecraft.sim import load_vehicle

TRACKS = ("reinvent_2018", "oval", "speedway", "serpent", "harbor")
RECIPE = ("--algorithm", "distill", "--reward", "lap_time", "--actions", "continuous")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--tracks", default=",".join(TRACKS), help="names or files, as oval,speedway")
    parser.add_argument("--from", dest="parent", help="a run or starter to begin from, as starter:quick")
    parser.add_argument("--until", default="5 minutes", help="limit of each training")
    parser.add_argument("--seeds", default="1", help="as 1,2,3")
    parser.add_argument("--num-threads", type=int, default=0)
    parser.add_argument("--runs", type=Path, help="keep the runs here; by default they are thrown away")
    parser.add_argument("-o", "--output", type=Path, help="write the whole table here")
    options = parser.parse_args()

    rows: list[dict[str, Any]] = []
    with tempfile.TemporaryDirectory() as scratch:
        for seed in map(int, options.seeds.split(",")):
            for track in options.tracks.split(","):
                rows.append(_measure(track, seed, options, root=options.runs or Path(scratch)))
                _say(rows[-1])
                if options.output is not None:
                    options.output.write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")
    medians = {}
    for track in options.tracks.split(","):
        gaps = [row["above_limit"] for row in rows if row["track"] == track and row["above_limit"] is not None]
        medians[track] = round(statistics.median(gaps), 4) if gaps else None
    print(json.dumps({"until": options.until, "above_limit": medians}))


def _measure(track: str, seed: int, options: argparse.Namespace, *, root: Path) -> dict[str, Any]:
    name, threads = f"fastest-{Path(track).stem}-{seed}", ("--num-threads", str(options.num_threads))
    method = RECIPE if options.parent is None else ("--from", options.parent)
    before, begun = _cpu_seconds(), time.perf_counter()
    trained = _racecraft(
        *("train", "--track", track, *method, "--until", options.until, "--seed", str(seed), *threads),
        *("--runs", str(root), "--name", name),
    )
    wall, cpu = time.perf_counter() - begun, _cpu_seconds() - before
    judged = _racecraft("evaluate", str(root / name), "--no-video")
    limit = judged["limit"] or track_limit(load_track(track), load_vehicle("v5")).to_dict()  # a file's takes seconds
    best = judged["best_lap_seconds"] if judged["laps_clean"] else None  # one that is not clean has lost five seconds
    return {
        "track": track,
        "seed": seed,
        "steps": trained["steps"],
        "wall_seconds": round(wall, 1),
        "cpu_seconds": round(cpu, 1),
        "checkpoint": judged["step"],
        "laps_clean": judged["laps_clean"],
        "laps": judged["laps_begun"],
        "best_clean_lap_seconds": best,
        "ideal_seconds": limit["ideal_seconds"],
        "driven_seconds": limit["driven_seconds"],
        "above_limit": round(best / limit["ideal_seconds"] - 1, 4) if best is not None else None,
    }


def _racecraft(*arguments: str) -> dict[str, Any]:
    """What a command says as JSON."""
    command = [sys.executable, "-m", "racecraft", *arguments, "--json"]
    said = subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True).stdout
    document: dict[str, Any] = json.loads(said)
    return document


def _cpu_seconds() -> float:
    """CPU time of the commands so far, the reward's process included."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def _say(row: dict[str, Any]) -> None:
    best, above = row["best_clean_lap_seconds"], row["above_limit"]
    found = "no clean lap" if best is None else f"best clean lap {best:.2f} s, {above:+.1%} of {row['ideal_seconds']} s"
    print(
        f"{row['track']}, seed {row['seed']}: {found} ({row['driven_seconds']} s driven); {row['laps_clean']} of "
        f"{row['laps']} laps clean; {row['steps']:,} steps, {row['wall_seconds']} s, {row['cpu_seconds']} s of CPU",
        flush=True,
    )


if __name__ == "__main__":
    main()
