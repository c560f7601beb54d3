"""Computes the limits of the library's closed tracks anew, for `src/racecraft/limits/library.csv`, on stdout.

Takes some seconds a track; `--vehicle v4 --vehicle v5` chooses the cars (default: v5); progress goes to stderr.
"""

from __future__ import annotations

import argparse
import csv
import sys
import time

from racecraft.limits import compute_limit
from racecraft.limits.limit import limit_key
from racecraft.sim.vehicle import load_vehicle
from racecraft.track import load_track, track_names


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--vehicle", action="append")
    parser.add_argument("--direction", action="append", choices=("forward", "reverse"))
    parser.add_argument("tracks", nargs="*", metavar="TRACK", help="default: all of the library")
    writer = csv.writer(sys.stdout, lineterminator="\n")
    writer.writerow(("key", "track", "direction", "vehicle", "ideal", "driven"))
    arguments = parser.parse_args()
    for name in arguments.vehicle or ["v5"]:
        vehicle = load_vehicle(name)
        for track in map(load_track, arguments.tracks or track_names()):
            for direction in arguments.direction or ("forward", "reverse"):
                if not track.is_closed:
                    continue
                road = track.reversed() if direction == "reverse" else track
                began = time.process_time()
                limit = compute_limit(road, vehicle)
                writer.writerow((limit_key(road, vehicle), track.name, direction, name, limit.ideal, limit.driven))
                sys.stdout.flush()
                seconds = time.process_time() - began
                print(
                    f"{name} {track.name} {direction}: {limit.ideal} {limit.driven} in {seconds:.1f} s of CPU time",
                    file=sys.stderr,
                )


if __name__ == "__main__":
    main()
