"""`racecraft train`."""

from __future__ import annotations

import os
import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final

import typer

from racecraft.cli import race_options
from racecraft.cli.app import INTERRUPTED, AwsLog, Json, app, is_given, print_json, refuse_beside_metadata, text

if TYPE_CHECKING:
    from racecraft.training.terminal import TerminalReporter

DEFAULT_TRACK: Final = "reinvent_2018"
_OPTIONS_OF: Final = {
    "objects": (
        *("race", "objects", "bots", "bot_speed", "lane_changes"),
        *("parked_cars", "placement", "positions"),
    ),
    "opponents": ("race", "opponents", "cars"),
}
"""Settings that several options make."""


@app.command()
def train(
    context: typer.Context,
    recipe: Annotated[
        str,
        typer.Option(
            "--recipe",
            help="Options under one name, for roads it has never seen: everywhere, slower steady, or traffic.",
        ),
    ] = "",
    track: Annotated[
        list[str],
        typer.Option("--track", "-t", help="Track, file, folder, library or generated:0..99; several by repeating it."),
    ] = [DEFAULT_TRACK],  # noqa: B006 (Typer copies it)
    reward: Annotated[
        str,
        typer.Option(
            "--reward",
            "-r",
            help="Preset or reward_function.py; racing, among objects dodge (slalom above 1 m/s), head to head duel.",
        ),
    ] = "",
    until: Annotated[
        str,
        typer.Option(
            "--until",
            "-u",
            help="When to stop: '5 laps', '8.8 s lap', 'no better lap', '10 minutes', '90000 steps', 'A or B'.",
        ),
    ] = "",
    actions: Annotated[
        str,
        typer.Option(
            "--actions", help="default, aws, fast, safe, continuous (head to head) or steady (among objects)."
        ),
    ] = "",
    sensors: Annotated[
        str, typer.Option("--sensors", help="AWS's names, joined by +; FRONT_FACING_CAMERA, in a race with LIDAR.")
    ] = "",
    model_metadata: Annotated[
        Path | None,
        typer.Option("--model-metadata", help="AWS's model_metadata.json, in place of --actions and --sensors."),
    ] = None,
    hyperparameters: Annotated[
        Path | None, typer.Option("--hyperparameters", help="AWS's hyperparameters.json; trains as AWS did.")
    ] = None,
    algorithm: Annotated[
        str, typer.Option("--algorithm", help="ppo, sac, distill, or Stable-Baselines3's sb3:ppo, a2c, dqn, sac, td3.")
    ] = "",
    network: Annotated[str, typer.Option("--network", help="RACECRAFT_SMALL, AWS's three or PERCEPTION.")] = "",
    critic: Annotated[
        str, typer.Option("--critic", help="What the critic sees: privileged, lap (that and its lap) or camera.")
    ] = "",
    vehicle: Annotated[str, typer.Option("--vehicle", help="v4, v5, v6 or a vehicle file.")] = "",
    camera: Annotated[
        str, typer.Option("--camera", help="What the car sees with: the original's camera of 2018, 2020 or 2026.")
    ] = "2018",
    direction: Annotated[str, typer.Option("--direction", help="forward, reverse or alternate.")] = "forward",
    randomize: Annotated[
        str,
        typer.Option("--randomize", help="What differs between episodes: light, strong, real, aws or a JSON file."),
    ] = "none",
    race: race_options.TrainRace = "time-trial",
    opponents: race_options.Rivals = [],  # noqa: B006 (Typer copies it)
    cars: race_options.Cars = None,
    objects: race_options.NumObjects = None,
    bots: race_options.NumBots = None,
    bot_speed: race_options.BotSpeed = None,
    lane_changes: race_options.LaneChanges = False,
    parked_cars: race_options.ParkedCars = False,
    placement: race_options.Placement = "",
    positions: race_options.Positions = "",
    num_envs: Annotated[int, typer.Option("--num-envs", help="Cars driven at once; 0 decides by itself.")] = 0,
    seed: Annotated[int, typer.Option("--seed", "-s", help="The same seed repeats a run on the same machine.")] = 0,
    evaluate_every: Annotated[
        int,
        typer.Option(
            "--evaluate-every",
            help="Camera steps between evaluations; 25,000 among objects, 50,000 head to head or on several tracks.",
        ),
    ] = 4096,
    num_threads: Annotated[int, typer.Option("--num-threads", help="0 takes one per core.")] = 0,
    device: Annotated[str, typer.Option("--device", help="cpu, or cuda: simulator and learner on a GPU.")] = "cpu",
    name: Annotated[str | None, typer.Option("--name", "-n", help="Name of the run.")] = None,
    runs: Annotated[Path, typer.Option("--runs", help="Folder that holds the runs.")] = Path("runs"),
    resume: Annotated[Path | None, typer.Option("--resume", help="Continue this run from its last checkpoint.")] = None,
    parent: Annotated[
        str | None, typer.Option("--from", help="Begin with the weights of RUN or RUN@checkpoint, in a new run.")
    ] = None,
    video: Annotated[
        bool, typer.Option("--video", help="Afterwards evaluate the best checkpoint and film it.")
    ] = False,
    aws_log: AwsLog = "",
    as_json: Json = False,
) -> None:
    """Train a car from camera pixels with a reward function."""
    started = process_start()
    is_quiet = as_json or aws_log == "-"
    if as_json and aws_log == "-":
        context.fail("--json and --aws-log - both want stdout; give the log a file.")
    if resume is not None:
        _refuse_beside_resume(context)
    refuse_beside_metadata(context)
    from racecraft import training
    from racecraft.sim import slower_than_could_be
    from racecraft.training.progress import NotingReporter
    from racecraft.training.regimes import regime_of

    if not is_quiet and (slower := slower_than_could_be()):
        text().say_progress(slower)
    race, rivals = race_options.opponents_of(race, opponents=opponents, cars=cars)
    on_track = race_options.objects_of(race, context.params)
    if not recipe:
        reward = reward or regime_of(objects=on_track, opponents=rivals).reward
    where = Path(track[0]).stem if len(track) == 1 else f"{len(track)} tracks"
    title = f"Racecraft · {resume}" if resume else f"Racecraft · {recipe or where + ' · ' + Path(reward).stem}"
    if parent is not None:
        title = f"Racecraft · from {parent}"
    silent = NotingReporter() if is_quiet else None
    with silent or _terminal(title) as reporter:
        if resume is not None:
            result = training.resume(
                resume,
                until=until or None,
                reward=reward if is_given(context, "reward") else None,
                reporter=reporter,
                aws_log=aws_log or None,
                started=started,
            )
        else:
            options: dict[str, Any] = {
                "track": track,
                "reward": reward,
                "actions": actions or None,
                "sensors": tuple(name.strip() for name in sensors.split("+")) if sensors else (),
                "model_metadata": model_metadata,
                "hyperparameters": hyperparameters,
                "algorithm": algorithm,
                "network": network,
                "critic": critic,
                "vehicle": vehicle,
                "camera": camera,
                "direction": direction,
                "randomize": randomize,
                "objects": on_track,
                "opponents": rivals,
                "num_envs": num_envs,
                "num_threads": num_threads,
                "device": device,
                "evaluate_every": evaluate_every,
            }
            # What is not given is the recipe's or the parent's, or follows from the rest.
            given = {
                name: value for name, value in options.items() if is_given(context, *_OPTIONS_OF.get(name, (name,)))
            }
            if parent is None and not recipe:
                given = {**options, "evaluate_every": 0, **given}
            result = training.train(
                **given,
                recipe=recipe,
                until=until,
                seed=seed,
                parent=parent,
                root=runs,
                name=name,
                reporter=reporter,
                aws_log=aws_log or None,
                started=started,
            )
    outcome = None
    if not is_quiet:
        text().say_trained(result)
    if video and result.reason != "interrupted":
        from racecraft.judging.evaluation import evaluate_run

        outcome = evaluate_run(result.run)
        if not is_quiet:
            text().say_evaluated(outcome)
    notes = silent.notes if silent is not None else []
    if as_json:
        judged = {} if outcome is None else {"evaluation": outcome.to_dict()}
        print_json({**result.to_dict(), "notes": notes, **judged})
    else:
        for note in notes:  # stdout is the log's
            text().say_progress(note)
    if result.reason == "interrupted":
        raise typer.Exit(INTERRUPTED)


def _terminal(title: str) -> TerminalReporter:
    """Imported late, as rich takes its time."""
    from racecraft.training.terminal import TerminalReporter

    return TerminalReporter(title=title)


def _refuse_beside_resume(context: typer.Context) -> None:
    """A resumed run keeps its settings: only its limit and its reward function may change."""
    for option in context.command.params:
        if is_given(context, str(option.name)) and option.name not in (
            "resume",
            "until",
            "reward",
            "video",
            "aws_log",
            "as_json",
        ):
            context.fail(f"{option.opts[0]} does not go with --resume: a run keeps the settings it was started with.")


def process_start() -> float:
    """`time.monotonic()` at which this process began, so that a training counts its own start-up."""
    try:
        with open("/proc/self/stat", encoding="ascii") as file:
            ticks = int(file.read().rsplit(")", 1)[1].split()[19])
        age = time.clock_gettime(time.CLOCK_BOOTTIME) - ticks / os.sysconf("SC_CLK_TCK")
    except (OSError, ValueError, AttributeError, IndexError):
        return time.monotonic()  # no such file outside Linux: the imports so far are not counted
    return time.monotonic() - max(age, 0.0)
