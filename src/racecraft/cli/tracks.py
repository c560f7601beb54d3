"""`racecraft tracks`: the list, and pictures."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated, Any

import typer

from racecraft.cli.app import Json, app, print_json, text

tracks_app = typer.Typer(help="List the tracks, or draw them.", rich_markup_mode=None)
app.add_typer(tracks_app, name="tracks")


@tracks_app.callback(invoke_without_command=True)
def tracks(context: typer.Context, as_json: Json = False) -> None:
    """List the tracks of the library."""
    if context.invoked_subcommand is not None:
        return
    from racecraft.limits import known_limit
    from racecraft.sim import Vehicle
    from racecraft.track import course, load_track, track_names

    listed = [(load_track(name), course(name)) for name in track_names()]
    if as_json:
        print_json({"tracks": [track_facts(track) for track, _ in listed]})
        return
    text().say_tracks(listed, [known_limit(track, Vehicle()) for track, _ in listed])


@tracks_app.command("show")
def show_track(
    name: Annotated[str, typer.Argument(help="Name, file, or generated:SEED.")],
    output: Annotated[Path | None, typer.Option("--output", "-o", help="PNG file; by default NAME.png.")] = None,
    width: Annotated[int, typer.Option("--width", help="Pixels.")] = 1600,
    as_json: Json = False,
) -> None:
    """Draw a track as a picture to hang on a wall."""
    from racecraft.limits import known_limit
    from racecraft.sim import Vehicle
    from racecraft.track import draw_track, load_track

    track = load_track(name)
    path = draw_track(track, output or Path(f"{track.name.replace(':', '-')}.png"), width_px=width)
    if as_json:
        print_json({**track_facts(track), "picture": str(path)})
    else:
        typer.echo(f"{track.name}: {track.length:.2f} m, drawn to {path}")
        limit = known_limit(track, Vehicle())
        if limit is not None:
            text().say_limit(track.name, limit)


@tracks_app.command("sheet")
def draw_sheet(
    names: Annotated[
        list[str] | None, typer.Argument(metavar="TRACKS", help="Names or files; by default the library.")
    ] = None,
    output: Annotated[Path, typer.Option("--output", "-o", help="PNG, JPEG or WebP file.")] = Path("tracks.png"),
    columns: Annotated[int, typer.Option("--columns", help="Tracks side by side.")] = 6,
    width: Annotated[int, typer.Option("--width", help="Pixels.")] = 1500,
    title: Annotated[str, typer.Option("--title", help="Written above.")] = "",
    as_json: Json = False,
) -> None:
    """Draw many tracks in one picture."""
    from racecraft.track import draw_contact_sheet, load_track, track_names

    tracks = [load_track(name) for name in names or track_names()]
    path = draw_contact_sheet(tracks, output, columns=columns, width_px=width, title=title)
    if as_json:
        print_json({"tracks": [track_facts(track) for track in tracks], "picture": str(path)})
    else:
        typer.echo(f"{len(tracks)} tracks drawn to {path}")


@tracks_app.command("limit")
def limit_track(
    name: Annotated[str, typer.Argument(help="Name, file, or generated:SEED.")],
    vehicle: Annotated[str, typer.Option("--vehicle", help="v4, v5, v6 or a vehicle file.")] = "v5",
    direction: Annotated[str, typer.Option("--direction", help="forward or reverse.")] = "forward",
    output: Annotated[Path | None, typer.Option("--output", "-o", help="Picture of the ideal line.")] = None,
    as_json: Json = False,
) -> None:
    """Find a car's minimum lap time on a track, and the medals."""
    from racecraft.checks import check_choice
    from racecraft.film.limit_picture import draw_limit
    from racecraft.limits import compute_limit, track_limit
    from racecraft.sim import load_vehicle
    from racecraft.track import load_track

    check_choice("direction", direction, ("forward", "reverse"))
    car, track = load_vehicle(vehicle), load_track(name)
    track = track.reversed() if direction == "reverse" else track
    limit = track_limit(track, car) if output is None else compute_limit(track, car)
    if output is not None:
        draw_limit(track, limit, output)
    if as_json:
        document = {"track": track.name, "direction": direction, "vehicle": vehicle, **limit.to_dict()}
        if limit.line is not None:
            points = zip(limit.line.places.tolist(), limit.line.speeds.tolist(), strict=True)
            document["line"] = [[round(x, 4), round(y, 4), round(speed, 3)] for (x, y), speed in points]
        print_json({**document, "picture": str(output) if output else None})
    else:
        text().say_limit(track.name, limit)


def track_facts(track: Any) -> dict[str, Any]:
    """What ``--json`` says of a track; its limit and medals are the default car's, where they are known."""
    from racecraft.limits import known_limit
    from racecraft.sim import Vehicle

    limit = known_limit(track, Vehicle())
    return {
        "name": track.name,
        "length_m": round(track.length, 3),
        "mean_width_m": round(track.mean_width, 3),
        "min_radius_m": round(track.min_radius, 3) if math.isfinite(track.min_radius) else None,
        "direction": track.direction,
        "is_closed": track.is_closed,
        "limit": limit.to_dict() if limit is not None else None,
    }
