"""`racecraft replay` and `racecraft calibrate`: logs of the original."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Final

import typer

from racecraft.cli.app import Json, TrackOption, app, is_given, make_folder_of, print_json, text
from racecraft.errors import ConfigError

OF_LOGS: Final = ("reward", "vehicle", "rows")
OF_A_FRAME: Final = ("palette",)


@app.command()
def replay(
    context: typer.Context,
    logs: Annotated[
        list[Path] | None, typer.Argument(help="Sim-traces: CSV or logs with SIM_TRACE_LOG lines, gzip or not.")
    ] = None,
    track: TrackOption = "reinvent_2018",
    reward: Annotated[
        str, typer.Option("--reward", "-r", help="Preset or file: compare its rewards with the logged ones.")
    ] = "",
    vehicle: Annotated[str, typer.Option("--vehicle", help="v4, v5, v6 or a vehicle file.")] = "v5",
    picture: Annotated[
        Path | None,
        typer.Option(
            "--picture",
            "-o",
            help="File for the median and the worst window, by default replay.png; or for the frames, by default none.",
        ),
    ] = None,
    rows: Annotated[
        Path | None, typer.Option("--rows", help="CSV file for every row that comes out otherwise, with both values.")
    ] = None,
    frame: Annotated[
        Path | None,
        typer.Option("--frame", help="Instead of logs: a camera frame of the original; find where it was taken."),
    ] = None,
    palette: Annotated[str, typer.Option("--palette", help="Colours of the frame's world: 2018, 2020, 2026.")] = "2018",
    as_json: Json = False,
) -> None:
    """Compare logs or a frame of the original with ours."""
    if (frame is None) == (not logs):
        raise ConfigError("Nothing to replay, or too much: give either logs or one --frame FILE.")
    for option in context.command.params:
        name = str(option.name)
        if name in (OF_LOGS if frame is not None else OF_A_FRAME) and is_given(context, name):
            context.fail(f"{option.opts[0]} goes with {'logs' if name in OF_LOGS else '--frame'}.")
    if frame is not None:
        _replay_frame(frame, track, palette, picture, as_json)
        return
    from racecraft.fidelity import draw_comparison
    from racecraft.fidelity import replay as compare
    from racecraft.reward import load_reward

    source = load_reward(reward) if reward else None
    result = compare(logs or [], track=track, vehicle=vehicle, reward=source, rows=rows)
    if picture is None and not as_json and result.examples:
        picture = Path("replay.png")
    if not as_json and not result.examples:
        text().say_replayed(result, None)  # what was found is not lost for want of something to draw
    if picture is not None:
        draw_comparison(result, picture)
    if as_json:
        print_json({**result.to_dict(), **({"picture": str(picture)} if picture is not None else {})})
    elif result.examples:
        text().say_replayed(result, picture)


def _replay_frame(frame: Path, track: str, palette: str, picture: Path | None, as_json: bool) -> None:
    from racecraft.fidelity import draw_frame, fit_frame

    fit = fit_frame(frame, track=track, palette=palette)
    if picture is not None:
        draw_frame(fit, picture)
    if as_json:
        print_json({**fit.to_dict(), **({"picture": str(picture)} if picture is not None else {})})
    else:
        text().say_frame(fit, picture)


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
    from racecraft.fidelity import calibrate as fit

    result = fit(logs, vehicle=vehicle, track=track or None)
    make_folder_of(output)
    result.vehicle.save(output)
    if as_json:
        print_json({**result.to_dict(), "file": str(output)})
    else:
        text().say_calibrated(result, output)
