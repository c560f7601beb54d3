"""`racecraft car`."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer

from racecraft.cli.app import Json, app, make_folder_of, print_json

car_app = typer.Typer(help="What was measured on a physical car.", no_args_is_help=True, rich_markup_mode=None)
app.add_typer(car_app, name="car")


@car_app.command("calibrate")
def calibrate(
    context: typer.Context,
    output: Annotated[Path, typer.Option("--output", "-o", help="Car file to write.")] = Path("car.json"),
    circle_left: Annotated[
        float | None,
        typer.Option(help="Diameter of the slow circle at full lock to the left, m, between the rear wheels."),
    ] = None,
    circle_right: Annotated[float | None, typer.Option(help="The same to the right.")] = None,
    servo: Annotated[
        str, typer.Option(help="Pulse widths of full left, straight and full right, ms: 1.70,1.45,1.20.")
    ] = "",
    speed: Annotated[
        list[str] | None,
        typer.Option(help="Slider in percent and the speed driven there at full throttle, m/s: 30=0.8; repeat."),
    ] = None,
    slider: Annotated[
        float | None, typer.Option(help="Where the slider stands, percent; by default where it suits the model.")
    ] = None,
    latency: Annotated[float, typer.Option(help="From picture to effect, s, beyond the simulator's; to 0.133.")] = 0.0,
    as_json: Json = False,
) -> None:
    """Make a car's file from a few measured numbers, for 'racecraft evaluate --as'."""
    from racecraft.car.calibration import calibrate as calibrated
    from racecraft.cli import car_text

    def numbers(name: str, words: str, mark: str, count: int) -> list[float]:
        try:
            values = [float(word) for word in words.split(mark)]
        except ValueError:
            values = []
        if len(values) != count:
            context.fail(f"--{name} is {words[:80]!r}; expected {count} numbers with {mark!r} between them.")
        return values

    car = calibrated(
        circles=(circle_left, circle_right),
        servo=numbers("servo", servo, ",", 3) if servo else None,
        speeds=[(pair[0], pair[1]) for pair in (numbers("speed", words, "=", 2) for words in speed or ())],
        slider=slider,
        latency=latency,
    )
    make_folder_of(output)
    car.save(output)
    if as_json:
        print_json({"file": str(output), **asdict(car)})
    else:
        car_text.say_calibrated(car, output)
