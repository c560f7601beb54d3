"""What `racecraft export` and `racecraft car` print for people."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rich.console import Console
from rich.text import Text

from racecraft.agent.action_space import MAX_SPEED
from racecraft.errors import typed

if TYPE_CHECKING:
    from pathlib import Path

    from racecraft.car import ExportedModel
    from racecraft.car.calibration import CarCalibration


def say_exported(exported: ExportedModel) -> None:
    """What was written, and what a car makes of it."""
    console = Console()
    for note in exported.notes:
        console.print(Text.assemble(("note: ", "bold"), note), soft_wrap=True)
    kind = f"{exported.network}, step {exported.step:,}, {exported.size / 1e6:.1f} MB"
    console.print(Text.assemble("Written: ", (str(exported.file), "bold"), (f"  {kind}", "dim")), soft_wrap=True)


def say_calibrated(car: CarCalibration, path: Path) -> None:
    """What was made of the numbers, and how to go on."""
    speeds = ", ".join(f"{speed:g} m/s at {position:g} %" for position, speed in car.speeds)
    slider = f"slider at {car.slider_percent:g} %" if car.slider_percent is not None else "slider where it suits"
    lines = [
        f"Full lock: {car.left_degrees:g}° to the left, {car.right_degrees:g}° to the right.",
        f"Full throttle: {speeds or 'not measured, so as fast as a model was trained to drive'}; {slider}.",
        f"Latency: {1000 * car.latency_seconds:g} ms.",
    ]
    if any(speed > MAX_SPEED for _, speed in car.speeds):
        lines.append(f"The simulator drives {MAX_SPEED:g} m/s at most: what is faster is driven, and drawn, at that.")
    console = Console()
    for line in lines:
        console.print(Text(line), soft_wrap=True)
    console.print(
        Text.assemble("Drive with it: ", (f"racecraft evaluate RUN --as {typed(path)}", "bold")), soft_wrap=True
    )
