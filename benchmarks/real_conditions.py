"""What the preset `real` of the randomisation shows, and what it costs.

    python benchmarks/real_conditions.py                              # CPU time of a step, with it and without
    python benchmarks/real_conditions.py --sheet sheet.webp           # some of its pictures
    python benchmarks/real_conditions.py --sheet sheet.webp --beside ../shared/frames/car

Steps are timed in turns, a block with it after a block without, so that what else a machine does meets both; the ratio
is the median of the pairs' ratios. CPU time, one thread. The last line is JSON.
"""

from __future__ import annotations

import argparse
import json
import time
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from racecraft import Simulation, load_track
from racecraft.sim import STATE_COLUMNS, Start

TRACKS = ("reinvent_2018", "hairpin", "oval")
CARS = 48
STEPS = 60
"""Of a block that is timed."""
COLUMNS = 6
"""Pictures in a row of the sheet."""


def cars(randomize: str, num_envs: int = CARS) -> Simulation:
    """Cars all along the tracks, whose episodes last."""
    tracks = [load_track(name) for name in TRACKS]
    return Simulation(
        tracks, num_envs=num_envs, start=Start(spread=True), randomize=randomize, num_threads=1, seed=1, max_steps=150
    )


def drive(simulation: Simulation, steps: int) -> None:
    """Along the middle of the road, and anew where an episode ends."""
    offset, sine = STATE_COLUMNS.index("offset"), STATE_COLUMNS.index("sin_heading_error")
    bend = STATE_COLUMNS.index("curvature_1")
    for _ in range(steps):
        state = simulation.state
        turn = 0.2 * state[:, bend] - 0.3 * state[:, offset] - 0.8 * state[:, sine]
        commands = np.stack([turn.clip(-0.5, 0.5), np.full(len(turn), 1.2)], axis=1)
        simulation.step(commands.astype(np.float32))
        simulation.reset(simulation.terminated | simulation.truncated)


def measure(presets: list[str], pairs: int) -> dict[str, dict[str, float]]:
    """Microseconds of a car's step and their ratio to those of the first preset."""
    simulations = {name: cars(name) for name in presets}
    for simulation in simulations.values():
        drive(simulation, STEPS)
    times: dict[str, list[float]] = {name: [] for name in presets}
    for _ in range(pairs):
        for name, simulation in simulations.items():
            begun = time.process_time()
            drive(simulation, STEPS)
            times[name].append((time.process_time() - begun) / (STEPS * CARS) * 1e6)
    first = np.array(times[presets[0]])
    return {
        name: {
            "microseconds": round(float(np.median(each)), 2),
            "ratio": round(float(np.median(np.array(each) / first)), 3),
        }
        for name, each in times.items()
    }


def sheet(path: Path, beside: Path | None, rows: int = 4) -> None:
    """Write pictures of the preset, and beside them some from a folder."""
    simulation = cars("real", rows * COLUMNS)
    drive(simulation, 20)
    pictures = list(simulation.frames)
    halves = [grid(pictures)]
    if beside is not None:
        files = sorted(beside.glob("*.jpg"))
        chosen = [files[round(i)] for i in np.linspace(0, len(files) - 1, rows * COLUMNS)]
        halves.append(grid([np.asarray(Image.open(file).convert("L").resize((160, 120))) for file in chosen]))
    Image.fromarray(np.concatenate(halves, axis=1)).save(path, quality=80)


def grid(pictures: list[NDArray[np.uint8]]) -> NDArray[np.uint8]:
    """Pictures in rows of COLUMNS, with a white line between them."""
    framed = [np.pad(picture, 2, constant_values=255) for picture in pictures]
    rows = [np.concatenate(framed[i : i + COLUMNS], axis=1) for i in range(0, len(framed), COLUMNS)]
    return np.concatenate(rows)


def main() -> None:
    """Write the sheet, or measure."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--pairs", type=int, default=25, help="blocks of each preset that are timed")
    parser.add_argument("--presets", default="none,light,strong,real", help="the first is what others are held against")
    parser.add_argument("--sheet", type=Path, help="write pictures here and measure nothing")
    parser.add_argument("--beside", type=Path, help="folder of a real car's pictures to show beside them")
    arguments = parser.parse_args()
    if arguments.sheet is not None:
        sheet(arguments.sheet, arguments.beside)
        return
    found = measure(arguments.presets.split(","), arguments.pairs)
    for name, each in found.items():
        print(f"{name:8} {each['microseconds']:7.2f} us a step of a car, {each['ratio']:.3f} of {arguments.presets}")
    print(json.dumps(found))


if __name__ == "__main__":
    main()
