"""`racecraft perceive`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

import typer

from racecraft.cli.app import Json, app, is_given, print_json, text
from racecraft.errors import ConfigError

if TYPE_CHECKING:
    from racecraft.perception import Perceiver


OF_DRIVING: Final = ("speed", "vehicle", "randomize", "trials", "seed")
OF_LEARNING: Final = ("updates", "roads", "store", "seed")


@app.command()
def perceive(
    context: typer.Context,
    sources: Annotated[
        list[Path] | None,
        typer.Argument(
            help="Pictures, folders of them, or a video, replay or run, seen with the pictures before in mind."
        ),
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", help="Folder for painted pictures, or an .mp4 of a video, replay or run."),
    ] = None,
    weights: Annotated[Path | None, typer.Option("--weights", help="Other weights than those brought along.")] = None,
    drive: Annotated[
        list[str] | None,
        typer.Option("--drive", help="Drive one lap on each track by what is seen: all, library, generated:0..9, …"),
    ] = None,
    speed: Annotated[float, typer.Option("--speed", help="With --drive: m/s on straights.")] = 1.5,
    vehicle: Annotated[str, typer.Option("--vehicle", help="With --drive: v4, v5, v6 or a vehicle file.")] = "v5",
    randomize: Annotated[
        str, typer.Option("--randomize", help="With --drive: light, strong, real, aws or a JSON file.")
    ] = "none",
    trials: Annotated[int, typer.Option("--trials", help="With --drive: laps tried on each track, each way.")] = 1,
    train: Annotated[Path | None, typer.Option("--train", help="Learn anew, and write the weights here.")] = None,
    updates: Annotated[int | None, typer.Option("--updates", help="With --train: gradient steps.")] = None,
    roads: Annotated[int | None, typer.Option("--roads", help="With --train: generated roads to learn on.")] = None,
    store: Annotated[int | None, typer.Option("--store", help="With --train: pictures remembered.")] = None,
    seed: Annotated[int, typer.Option("--seed", "-s", help="Of --train and --drive.")] = 1,
    as_json: Json = False,
) -> None:
    """Say what pictures show of the road, and paint it."""
    from racecraft.perceiving import perceive as look
    from racecraft.perception import Lessons, Perceiver
    from racecraft.perception import train as learn

    meant = OF_LEARNING if train is not None else OF_DRIVING if drive else ()
    for option in context.command.params:
        name = str(option.name)
        if name in (*OF_DRIVING, *OF_LEARNING) and name not in meant and is_given(context, name):
            verbs = [verb for verb, of in (("--drive", OF_DRIVING), ("--train", OF_LEARNING)) if name in of]
            context.fail(f"{option.opts[0]} goes with {' or '.join(verbs)}.")
    if train is not None:
        if sources or output or weights or drive:
            context.fail("--train goes alone; call perceive again for pictures and for driving.")
        if not train.parent.is_dir():  # told now, and not after hours of learning
            raise ConfigError(f"{train} cannot be written: there is no folder {train.parent}.")
        given = {"updates": updates, "roads": roads, "store": store}
        lessons = Lessons(seed=seed, **{name: value for name, value in given.items() if value is not None})

        def tell(update: int, loss: float) -> None:
            text().say_progress(f"{update:,} of {lessons.all_updates:,} updates, loss {loss:.3f}")

        learn(lessons, tell=tell).save(train)
        if as_json:
            print_json({"weights": str(train), "bytes": train.stat().st_size, "updates": lessons.updates})
        else:
            typer.echo(f"The weights are in {train}.")
        return
    perceiver = Perceiver() if weights is None else Perceiver(weights)
    if drive:
        if sources or output:
            context.fail("--drive drives in the simulator and looks at no other pictures.")
        _drive(
            drive,
            perceiver,
            speed=speed,
            vehicle=vehicle,
            randomize=randomize,
            trials=trials,
            seed=seed,
            as_json=as_json,
        )
        return
    told = look(sources or [], output=output, perceiver=perceiver)
    if as_json:
        print_json({"pictures": told, "output": None if output is None else str(output)})
        return
    from racecraft.cli import perceive_text

    perceive_text.say_perceived(told, output)


def _drive(
    tracks: list[str],
    perceiver: Perceiver,
    *,
    speed: float,
    vehicle: str,
    randomize: str,
    trials: int,
    seed: int,
    as_json: bool,
) -> None:
    """One lap on each of many tracks, both ways."""
    from racecraft.perceiving import PerceptionDriver
    from racecraft.race.autopilot import Autopilot
    from racecraft.race.generalization import generalize
    from racecraft.sim.randomization import load_randomization
    from racecraft.sim.vehicle import load_vehicle
    from racecraft.track import load_tracks

    found = generalize(
        PerceptionDriver(perceiver, autopilot=Autopilot(speed=speed)),
        load_tracks(tracks),
        num_trials=trials,
        seed=seed,
        vehicle=load_vehicle(vehicle),
        randomize=load_randomization(randomize),
    )
    if as_json:
        print_json({"driver": "perception", "speed": speed, "randomize": randomize, **found.to_dict()})
    else:
        text().say_laps(found, title=f"Perception at {speed:g} m/s")
