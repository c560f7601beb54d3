"""Laps in a world that shares nothing with the simulator but the routes: MuJoCo's physics, MuJoCo's renderer.

    make build/mujoco
    .venv/bin/python benchmarks/transfer.py geometry                       # a controller that knows where it is
    .venv/bin/python benchmarks/transfer.py runs/mine perception           # zero-shot: nothing is trained or tuned here
    .venv/bin/python benchmarks/transfer.py runs/mine --film lap.mp4 --sheet frames.webp

A run is exported, read back, and driven as a car's software drives it; perception and geometry turn the same wheels by
the same servo. A lap is tried once from each start, from standing, with nobody to put the car back; whether it is on
the road says our geometry. The last line on stdout is JSON, with --json the only one.
"""

from __future__ import annotations

import argparse
import json
import tempfile
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from PIL import Image
from second_world import CONTROL_DT, Pose, World

from racecraft.car.calibration import CarCalibration
from racecraft.car.driving import CarPolicy, car_picture
from racecraft.car.export import export_run, read_exported
from racecraft.film.encoding import write_video
from racecraft.perceiving import PerceptionDriver
from racecraft.race.autopilot import Autopilot
from racecraft.sim.camera import LUMA
from racecraft.track import Track, load_track

ROUTES: Final = ("reinvent_2018", "kidney", "delta")
LOCK: Final = 24.0  # degrees that this car's wheels turn at full lock
FULL_THROTTLE: Final = 4.0  # m/s with the slider at 100 percent
MODEL_LOCK: Final = np.radians(30.0)  # what perception's controller takes for full lock
REFERENCE_AHEAD: Final = 0.14  # m, from the car's middle to the point that progress speaks of
SLOWEST: Final = 0.3  # m/s; who is slower gets no lap

Driver = Callable[[NDArray[np.uint8] | None, Pose], tuple[float, float]]
"""From a picture of 480 x 640, grey, or the pose, to the wheels' angle in rad and the motor's speed in m/s."""


@dataclass
class Lap:
    """A lap that was tried."""

    track: str
    start: int
    completion: float
    """Share of the lap."""
    seconds: float | None
    """None where it was not completed."""
    ended: str
    pictures: list[NDArray[np.uint8]] = field(default_factory=list)


# --- drivers


def exported(run: Path, car: CarCalibration) -> Driver:
    """The file that a car takes, through the steps of a car's software."""
    with tempfile.TemporaryDirectory(prefix="racecraft-transfer-") as place:
        policy = read_exported(export_run(run, output=Path(place) / "model.tar.gz").file)
    driver = CarPolicy(policy, car)

    def drive(picture: NDArray[np.uint8] | None, _: Pose) -> tuple[float, float]:
        angle, speed = driver(np.asarray(picture)[None])[0]
        return float(angle), float(speed)

    return drive


def perception(speed: float) -> Driver:
    """What is seen, and a controller of which nothing was learned."""
    driver = PerceptionDriver(autopilot=Autopilot(speed=speed))

    def drive(picture: NDArray[np.uint8] | None, _: Pose) -> tuple[float, float]:
        angle, pace = driver(car_picture(np.asarray(picture)[None]))[0]
        return float(np.clip(angle / MODEL_LOCK, -1, 1) * np.radians(LOCK)), float(pace)

    return drive


def geometry(track: Track, speed: float = 1.2) -> Driver:
    """Turns in proportion to where the road's middle lies, which it is told: the world can be driven."""

    def drive(_: NDArray[np.uint8] | None, pose: Pose) -> tuple[float, float]:
        ahead = 0.3 + 0.1 * pose.speed
        s, _offset = track.project([pose.x, pose.y])
        x, y = track.point_at(float(s) + ahead) - [pose.x, pose.y]
        left = np.cos(pose.heading) * y - np.sin(pose.heading) * x
        return float(np.clip(3.5 * left, -np.radians(LOCK), np.radians(LOCK))), speed

    return drive


# --- a lap, judged


def drive_lap(world: World, track: Track, driver: Driver, *, start: int, sees: bool = True, keep: bool = False) -> Lap:
    """One lap from one of the starts, the first of them on the line.

    Args:
        world: Of this track.
        track: The way round that is driven.
        driver: Who drives.
        start: Which one: it draws where along the road, how far beside its middle and how turned.
        sees: Whether pictures are drawn.
        keep: Whether they are kept, with the view from behind.
    """
    draw = np.random.default_rng([start, 5])
    begin = track.length * start / 3
    offset, turned = (0.0, 0.0) if start == 0 else (draw.uniform(-0.05, 0.05), draw.uniform(-0.09, 0.09))
    heading = float(track.heading_at(begin)) + turned
    x, y = track.point_at(begin) + offset * np.array([-np.sin(heading), np.cos(heading)])
    world.place(float(x), float(y), heading)
    lap = Lap(track.name, start, 0.0, None, "too slow")
    last, driven = _along(track, world.pose), 0.0
    for step in range(1, int(track.length / SLOWEST / CONTROL_DT) + 1):
        pose = world.pose
        colours = world.picture() if sees else None
        angle, speed = driver(None if colours is None else grey(colours), pose)
        if keep and colours is not None:
            lap.pictures.append(beside(world.picture("chase"), colours))
        world.step(angle, speed)
        here = _along(track, world.pose)
        driven += (here - last + track.length / 2) % track.length - track.length / 2
        last = here
        lap.completion = min(max(driven / track.length, 0.0), 1.0)
        if driven >= track.length:
            lap.seconds, lap.ended = round(step * CONTROL_DT, 2), "completed"
            break
        if is_off(track, world.pose):
            lap.ended = "off the road"
            break
    return lap


def is_off(track: Track, pose: Pose) -> bool:
    """All wheels are beside the road, as the original's rules have it, or the car lies on its back."""
    s, offset = track.project(pose.wheels)
    return bool((np.abs(offset) > track.width_at(s) / 2).all()) or not pose.is_upright


def _along(track: Track, pose: Pose) -> float:
    x, y = pose.x + REFERENCE_AHEAD * np.cos(pose.heading), pose.y + REFERENCE_AHEAD * np.sin(pose.heading)
    return float(track.project([x, y])[0])


def grey(colours: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """As the car's software weighs colours  (H, W, 3) to (H, W)."""
    return np.asarray(colours @ np.array(LUMA) + 0.5).clip(0, 255).astype(np.uint8)


def beside(view: NDArray[np.uint8], lens: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """The view from behind, with what the driver gets in its corner."""
    both = view.copy()
    both[8:128, -168:-8] = car_picture(grey(lens))[..., None]
    return both


# --- all of it


def judge(name: str, routes: list[str], options: argparse.Namespace) -> list[Lap]:
    """All laps of a driver. The second start goes the other way round."""
    laps = []
    car = CarCalibration(
        left_degrees=LOCK, right_degrees=LOCK, speeds=((100.0, FULL_THROTTLE),), slider_percent=options.slider
    )
    drives_blind = name == "geometry"
    looks = name == "perception"
    driver = None if drives_blind or looks else exported(Path(name), car)
    for route in routes:
        for start in options.starts:
            track = load_track(route)
            track = track.reversed() if start == 1 else track
            world = World(track, seed=start, latency=options.latency, size=None if drives_blind else (640, 480))
            keep = bool(options.film or options.sheet)
            # perception remembers: a driver of its own for each lap
            drives = driver or (perception(options.speed) if looks else geometry(track))
            lap = drive_lap(world, track, drives, start=start, sees=not drives_blind, keep=keep)
            world.close()
            laps.append(lap)
            if not options.json:
                time = "" if lap.seconds is None else f" in {lap.seconds:.2f} s"
                print(
                    f"{name:30} {route:14} start {start}: {100 * lap.completion:3.0f} %, {lap.ended}{time}", flush=True
                )
    return laps


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("drivers", nargs="+", help="run folders, perception, or geometry")
    parser.add_argument("--routes", nargs="+", default=list(ROUTES), help="tracks, as of evaluate --track")
    parser.add_argument("--starts", nargs="+", type=int, default=[0, 1, 2])
    parser.add_argument("--slider", type=float, default=40.0, help="of the car's page, percent; runs alone")
    parser.add_argument("--speed", type=float, default=1.5, help="m/s of perception's controller on straights")
    parser.add_argument("--latency", type=float, default=0.04, help="s from a picture to the command's effect")
    parser.add_argument("--film", type=Path, help="write all laps, seen from behind, here (.mp4)")
    parser.add_argument("--sheet", type=Path, help="write pictures of all laps here")
    parser.add_argument("--json", action="store_true", help="print one JSON object alone")
    options = parser.parse_args()
    found: dict[str, Any] = {"slider_percent": options.slider, "latency_s": options.latency, "drivers": []}
    pictures: list[NDArray[np.uint8]] = []
    for name in options.drivers:
        laps = judge(name, options.routes, options)
        done = [lap for lap in laps if lap.seconds is not None]
        rows = [{key: value for key, value in vars(lap).items() if key != "pictures"} for lap in laps]
        completion = round(float(np.mean([lap.completion for lap in laps])), 3)
        found["drivers"].append(
            {"driver": name, "laps": len(done), "trials": len(laps), "completion": completion, "results": rows}
        )
        pictures += [picture for lap in laps for picture in lap.pictures]
        if not options.json:
            print(f"{name}: {len(done)} of {len(laps)} laps")
    if options.film and pictures:
        write_video(pictures, options.film)
    if options.sheet and pictures:
        chosen = [pictures[round(i)] for i in np.linspace(0, len(pictures) - 1, 12)]
        rows = [np.concatenate(chosen[i : i + 4], axis=1) for i in range(0, 12, 4)]
        Image.fromarray(np.concatenate(rows)).reduce(2).save(options.sheet, quality=70)
    print(json.dumps(found))


if __name__ == "__main__":
    main()
