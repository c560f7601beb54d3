"""`racecraft evaluate`."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Annotated, Any, Final

import typer

from racecraft.cli import race_options
from racecraft.cli.app import AwsLog, Checkpoint, Json, OneModel, app, is_given, model_of, print_json, text

RACE_ONLY: Final = ("as_what", "track", "laps", "rules", "offtrack_penalty", "max_resets", "video", "aws_log", "ghost")


@app.command()
def evaluate(
    context: typer.Context,
    run: OneModel,
    track: Annotated[str, typer.Option("--track", "-t", help="Track; by default the one it was trained on.")] = "",
    tracks: Annotated[
        list[str] | None,
        typer.Option("--tracks", help="A table of one lap on each: all, library, generated:0..99 or a folder."),
    ] = None,
    as_what: Annotated[
        str, typer.Option("--as", help="car, or a file of 'racecraft car calibrate': as that physical car would drive.")
    ] = "",
    laps: Annotated[int | None, typer.Option("--laps", "-l", help="Laps to a trial; by default the rules'.")] = None,
    trials: Annotated[
        int | None, typer.Option("--trials", help="Cars that start side by side, 5; with --tracks on each of them, 1.")
    ] = None,
    rules: Annotated[
        str, typer.Option("--rules", help="drfc, worker, droa or live; by default the run's own, else drfc.")
    ] = "",
    checkpoint: Checkpoint = "best",
    vehicle: Annotated[str, typer.Option("--vehicle", help="v4, v5, v6 or a vehicle file.")] = "",
    direction: Annotated[
        str, typer.Option("--direction", help="forward or reverse; by default as it was trained.")
    ] = "",
    randomize: Annotated[
        str,
        typer.Option("--randomize", help="What differs from trial to trial: light, strong, real, aws or a JSON file."),
    ] = "none",
    offtrack_penalty: race_options.OfftrackPenalty = None,
    collision_penalty: race_options.CollisionPenalty = None,
    race: race_options.Race = "",
    objects: race_options.NumObjects = None,
    bots: race_options.NumBots = None,
    bot_speed: race_options.BotSpeed = None,
    lane_changes: race_options.LaneChanges = False,
    parked_cars: race_options.ParkedCars = False,
    placement: race_options.Placement = "",
    positions: race_options.Positions = "",
    max_resets: Annotated[int | None, typer.Option("--max-resets", help="Resets to a trial.")] = None,
    seed: Annotated[int, typer.Option("--seed", "-s", help="Of the starts.")] = 0,
    video: Annotated[bool, typer.Option("--video/--no-video", help="Write an MP4 of the best trial.")] = True,
    ghost: race_options.Ghosts = None,
    aws_log: AwsLog = "",
    as_json: Json = False,
) -> None:
    """Race a run's policy against the clock and film it.

    By default among the objects it was trained with. With --tracks it tries one lap on each of many tracks, both ways.
    """
    run, checkpoint = model_of(context, run, checkpoint)
    if tracks:
        _generalize(
            context,
            run,
            tracks=tracks,
            directions=(direction,) if direction else ("forward", "reverse"),
            num_trials=1 if trials is None else trials,
            checkpoint=checkpoint,
            vehicle=vehicle or None,
            randomize=randomize,
            seed=seed,
            as_json=as_json,
        )
        return
    if as_json and aws_log == "-":
        context.fail("--json and --aws-log - both want stdout; give the log a file.")
    from racecraft.judging.evaluation import evaluate_run

    judge: Any = evaluate_run
    if as_what:
        from racecraft.car.calibration import load_calibration
        from racecraft.car.evaluation import evaluate_as_car

        judge = partial(evaluate_as_car, car=load_calibration(as_what))
    given = race_options.objects_of(race, context.params)
    outcome = judge(
        run,
        track=track or None,
        laps=laps,
        num_trials=5 if trials is None else trials,
        rules=rules or None,
        checkpoint=checkpoint,
        vehicle=vehicle or None,
        direction=direction or None,
        randomize=randomize,
        offtrack_penalty=offtrack_penalty,
        collision_penalty=collision_penalty,
        objects=given if race else None,
        max_resets=max_resets,
        seed=seed,
        video=video,
        aws_log=aws_log or None,
        ghosts=ghost or (),
    )
    if as_json:
        print_json(outcome.to_dict())
    elif aws_log != "-":
        text().say_evaluated(outcome)


def _generalize(context: typer.Context, run: Path, *, as_json: bool, **settings: Any) -> None:
    """One lap on each of many tracks; the rules of a race do not apply."""
    for option in context.command.params:
        asks_nothing = option.name == "video" and not context.params["video"]  # there is none anyway
        if option.name in RACE_ONLY and is_given(context, str(option.name)) and not asks_nothing:
            context.fail(f"{option.opts[0]} does not go with --tracks: each track is one lap without a reset.")
    from racecraft.judging.generalization import generalize_run

    outcome = generalize_run(run, **settings)
    if as_json:
        print_json(outcome.to_dict())
    else:
        text().say_generalized(outcome)
