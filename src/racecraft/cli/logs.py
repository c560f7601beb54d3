"""`racecraft replay` and `racecraft calibrate`: logs of the original."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from racecraft.cli.app import Json, TrackOption, app, print_json, text


@app.command()
def replay(
    logs: Annotated[list[Path], typer.Argument(help="Sim-traces: CSV or logs with SIM_TRACE_LOG lines, gzip or not.")],
    track: TrackOption = "reinvent_2018",
    reward: Annotated[
        str, typer.Option("--reward", "-r", help="Preset or file: compare its rewards with the logged ones.")
    ] = "",
    vehicle: Annotated[str, typer.Option("--vehicle", help="v4, v5, v6 or a vehicle file.")] = "v5",
    picture: Annotated[
        Path | None, typer.Option("--picture", "-o", help="Draw the median and the worst window to this file.")
    ] = None,
    rows: Annotated[
        Path | None, typer.Option("--rows", help="CSV file for every row that comes out otherwise, with both values.")
    ] = None,
    as_json: Json = False,
) -> None:
    """Compare logs of the original with the simulator."""
    from racecraft.replay import draw_comparison
    from racecraft.replay import replay as compare
    from racecraft.reward import load_reward

    source = load_reward(reward) if reward else None
    result = compare(logs, track=track, vehicle=vehicle, reward=source, rows=rows)
    if picture is None and not as_json and result.examples:
        picture = Path("replay.png")
    if picture is not None:
        draw_comparison(result, picture)
    if as_json:
        print_json({**result.to_dict(), **({"picture": str(picture)} if picture is not None else {})})
    else:
        text().say_replayed(result, picture)


@app.command()
def calibrate(
    logs: Annotated[list[Path], typer.Argument(help="Sim-traces: CSV or logs with SIM_TRACE_LOG lines, gzip or not.")],
    vehicle: Annotated[
        str, typer.Option("--vehicle", help="Where the fit starts: v4, v5, v6 or a vehicle file.")
    ] = "v5",
    output: Annotated[Path, typer.Option("--output", "-o", help="Vehicle file to write.")] = Path("vehicle.json"),
    track: Annotated[
        str, typer.Option("--track", "-t", help="Refuse logs that were not driven on it; not needed for the fit.")
    ] = "",
    as_json: Json = False,
) -> None:
    """Fit a car to your own logs and write a vehicle file."""
    from racecraft.replay import calibrate as fit

    result = fit(logs, vehicle=vehicle, track=track or None)
    result.vehicle.save(output)
    if as_json:
        print_json({**result.to_dict(), "file": str(output)})
    else:
        text().say_calibrated(result, output)
