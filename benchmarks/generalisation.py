"""How far a policy gets that never saw the tracks: train on our own, drive the official ones.

    .venv/bin/python benchmarks/generalisation.py --routes ../shared/tracks --seeds 0,1,2 -o table.json

For each seed: train by the recipe below, then one lap on each route, both ways, from a standing start and with nobody
to put the car back, by itself and under strong randomisation. The last line on stdout is JSON.
"""

from __future__ import annotations

import argparse
import json
import resource
import sys
import tempfile
import time
from pathlib import Path

from racecraft import generalize, load_tracks, train
from racecraft.track import joint_digest

TRACKS = ("library", "generated:0..47,radius=0.45,difficulty=0.9")
RECIPE = {"reward": "centerline", "direction": "alternate", "randomize": "strong", "actions": "safe"}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--tracks", action="append", help="tracks to train on")
    parser.add_argument("--routes", default="generated:1000..1063,radius=0.45", help="tracks to judge on")
    parser.add_argument("--until", default="15 minutes", help="limit of each training")
    parser.add_argument("--seeds", default="0", help="as 0,1,2")
    parser.add_argument("--num-threads", type=int, default=0)
    parser.add_argument("--runs", type=Path, help="keep the runs here; by default they are thrown away")
    parser.add_argument("-o", "--output", type=Path, help="write the whole table here")
    options = parser.parse_args()

    judged = load_tracks(options.routes)
    options.tracks = options.tracks or list(TRACKS)
    seen = {track.digest for track in load_tracks(options.tracks)}
    if seen & {track.digest for track in judged}:
        parser.error("a track of --routes is one of those to train on")
    documents = []
    with tempfile.TemporaryDirectory() as scratch:
        for seed in map(int, options.seeds.split(",")):
            documents.append(_measure(seed, options, root=options.runs or Path(scratch)))
            _say(documents[-1])
    document = {"tracks": options.tracks, **RECIPE, "judged_on": joint_digest(judged), "runs": documents}
    if options.output is not None:
        options.output.write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")
    shares = {kind: [run[kind]["lap_share"] for run in documents] for kind in ("as_it_is", "strong")}
    print(json.dumps({"until": options.until, "lap_share": shares}))


def _measure(seed: int, options: argparse.Namespace, *, root: Path) -> dict[str, object]:
    cpu, wall = time.process_time(), time.perf_counter()
    result = train(
        options.tracks,
        **RECIPE,
        until=options.until,
        seed=seed,
        num_threads=options.num_threads,
        root=root,
        name=f"far-{seed}",
    )
    trained = {
        "seed": seed,
        "steps": result.steps,
        "seconds": round(time.perf_counter() - wall, 1),
        "cpu_seconds": round(time.process_time() - cpu, 1),
        "peak_memory_mb": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss // 1024,
    }
    for kind, randomize in (("as_it_is", "none"), ("strong", "strong")):
        found = generalize(
            result.run, tracks=options.routes, randomize=randomize, seed=seed, num_threads=options.num_threads
        )
        trained[kind] = found.generalization.to_dict()
    return trained


def _say(run: dict[str, object]) -> None:
    parts = [f"{key} {run[key]:,}" for key in ("seed", "steps", "seconds", "cpu_seconds", "peak_memory_mb")]
    for kind in ("as_it_is", "strong"):
        found = run[kind]
        share, low, high = 100 * found["lap_share"], *(100 * end for end in found["lap_interval"])
        parts.append(f"{kind} {found['laps']}/{found['trials']} laps = {share:.1f} % ({low:.0f} to {high:.0f})")
    print(", ".join(parts), file=sys.stderr, flush=True)


if __name__ == "__main__":
    main()
