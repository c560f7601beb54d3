"""The command line: verbs only. Each one reads its options, calls the layer that does the work, and prints.

    racecraft train --until "5 laps"
    racecraft evaluate runs/NAME --laps 3

Everything heavy is imported inside the verbs, so that ``--help`` is instant; what people read is in `cli_text`.
"""

from __future__ import annotations

import json
import math
import os
import sys
import time
import traceback
import warnings
from pathlib import Path
from typing import Annotated, Any, cast

import typer

from racecraft import __version__
from racecraft.errors import RacecraftError

UsageError = cast(type[Exception], typer.BadParameter.__mro__[1])  # typer hands out no name for this base
INTERRUPTED = 130  # 128 + SIGINT, as shells say it

app = typer.Typer(
    name="racecraft",
    help="Teach a small car to race: reward function in, lap on video out.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,  # rich would take two thirds of the time that --help takes
    context_settings={"help_option_names": ["-h", "--help"]},
)
tracks_app = typer.Typer(help="List the tracks, or draw one.", rich_markup_mode=None)
reward_app = typer.Typer(help="Look at reward functions.", no_args_is_help=True, rich_markup_mode=None)
app.add_typer(tracks_app, name="tracks")
app.add_typer(reward_app, name="reward")

Json = Annotated[bool, typer.Option("--json", help="Print one JSON object on stdout instead of text.")]
TrackOption = Annotated[str, typer.Option("--track", "-t", help="Name of a track, or path of a track file.")]


@app.callback(invoke_without_command=True)
def root(
    version: Annotated[bool, typer.Option("--version", help="Print the version.")] = False,
    debug: Annotated[bool, typer.Option("--debug", help="Show the stack trace of an error.")] = False,
) -> None:
    """Options of every verb."""
    if version:
        typer.echo(__version__)
        raise typer.Exit


@app.command()
def train(
    context: typer.Context,
    track: TrackOption = "reinvent_2018",
    reward: Annotated[str, typer.Option("--reward", "-r", help="Preset, or path of a reward_function.py.")] = "racing",
    until: Annotated[
        str, typer.Option("--until", "-u", help="When to stop: '5 laps', '10 minutes', '200000 steps', 'A or B'.")
    ] = "",
    actions: Annotated[
        str, typer.Option("--actions", help="Action space: default, aws, fast or continuous.")
    ] = "default",
    model_metadata: Annotated[
        Path | None, typer.Option("--model-metadata", help="AWS's model_metadata.json; replaces --actions.")
    ] = None,
    hyperparameters: Annotated[
        Path | None, typer.Option("--hyperparameters", help="AWS's hyperparameters.json; trains as AWS did.")
    ] = None,
    network: Annotated[str, typer.Option("--network", help="RACECRAFT_SMALL or one of AWS's three names.")] = "",
    critic: Annotated[str, typer.Option("--critic", help="What the critic sees: privileged or camera.")] = "privileged",
    vehicle: Annotated[str, typer.Option("--vehicle", help="v4, v5, v6 or a vehicle file.")] = "",
    direction: Annotated[str, typer.Option("--direction", help="forward, reverse or alternate.")] = "forward",
    num_envs: Annotated[int, typer.Option("--num-envs", help="Cars driven at once; 0 decides by itself.")] = 0,
    seed: Annotated[int, typer.Option("--seed", "-s", help="The same seed repeats a run on the same machine.")] = 0,
    evaluate_every: Annotated[
        int, typer.Option("--evaluate-every", help="Camera steps between evaluations, and so checkpoints.")
    ] = 4096,
    num_threads: Annotated[int, typer.Option("--num-threads", help="0 takes one per core.")] = 0,
    name: Annotated[str | None, typer.Option("--name", "-n", help="Name of the run.")] = None,
    runs: Annotated[Path, typer.Option("--runs", help="Folder that holds the runs.")] = Path("runs"),
    resume: Annotated[Path | None, typer.Option("--resume", help="Continue this run from its last checkpoint.")] = None,
    video: Annotated[
        bool, typer.Option("--video", help="Afterwards evaluate the best checkpoint and film it.")
    ] = False,
    as_json: Json = False,
) -> None:
    """Train a car from camera pixels with a reward function."""
    started = _process_start()
    if resume is not None:
        _refuse_beside_resume(context)
    from racecraft import training
    from racecraft.training.progress import SilentReporter
    from racecraft.training.terminal import TerminalReporter

    title = f"Racecraft · {resume}" if resume else f"Racecraft · {Path(track).stem} · {Path(reward).stem}"
    with SilentReporter() if as_json else TerminalReporter(title=title) as reporter:
        if resume is not None:
            result = training.resume(resume, until=until or None, reporter=reporter, started=started)
        else:
            result = training.train(
                track,
                reward=reward,
                until=until or "5 laps",
                actions=actions,
                model_metadata=model_metadata,
                hyperparameters=hyperparameters,
                network=network,
                critic=critic,
                vehicle=vehicle,
                direction=direction,
                num_envs=num_envs,
                seed=seed,
                evaluate_every=evaluate_every,
                num_threads=num_threads,
                root=runs,
                name=name,
                reporter=reporter,
                started=started,
            )
    outcome = None
    if not as_json:
        _text().say_trained(result)
    if video and result.reason != "interrupted":
        from racecraft.race.run_evaluation import evaluate_run

        outcome = evaluate_run(result.run)
        if not as_json:
            _text().say_evaluated(outcome)
    if as_json:
        _print_json({**result.to_dict(), **({"evaluation": outcome.to_dict()} if outcome is not None else {})})
    if result.reason == "interrupted":
        raise typer.Exit(INTERRUPTED)


def _refuse_beside_resume(context: typer.Context) -> None:
    """A resumed run keeps its settings: only its limit may change."""
    for option in context.command.params:
        source = context.get_parameter_source(str(option.name))
        is_given = source is not None and source.name == "COMMANDLINE"
        if is_given and option.name not in ("resume", "until", "video", "as_json"):
            context.fail(f"{option.opts[0]} does not go with --resume: a run keeps the settings it was started with.")


@app.command()
def evaluate(
    run: Annotated[Path, typer.Argument(help="Run folder.")],
    track: Annotated[str, typer.Option("--track", "-t", help="Track; by default the one it was trained on.")] = "",
    laps: Annotated[int, typer.Option("--laps", "-l", help="Laps to a trial.")] = 3,
    trials: Annotated[
        int, typer.Option("--trials", help="Cars that start side by side, each a little differently.")
    ] = 5,
    rules: Annotated[str, typer.Option("--rules", help="drfc, worker, droa or live.")] = "drfc",
    checkpoint: Annotated[str, typer.Option("--checkpoint", help="best, last or a step.")] = "best",
    vehicle: Annotated[str, typer.Option("--vehicle", help="v4, v5, v6 or a vehicle file.")] = "",
    direction: Annotated[
        str, typer.Option("--direction", help="forward or reverse; by default as it was trained.")
    ] = "",
    offtrack_penalty: Annotated[
        float | None, typer.Option("--offtrack-penalty", help="Seconds; by default the rules'.")
    ] = None,
    max_resets: Annotated[int | None, typer.Option("--max-resets", help="Resets to a trial.")] = None,
    seed: Annotated[int, typer.Option("--seed", "-s", help="Of the starts.")] = 0,
    video: Annotated[bool, typer.Option("--video/--no-video", help="Write an MP4 of the best trial.")] = True,
    as_json: Json = False,
) -> None:
    """Race a run's policy against the clock and film it."""
    from racecraft.race.run_evaluation import evaluate_run

    outcome = evaluate_run(
        run,
        track=track or None,
        laps=laps,
        num_trials=trials,
        rules=rules,
        checkpoint=int(checkpoint) if checkpoint.isdigit() else checkpoint,
        vehicle=vehicle or None,
        direction=direction or None,
        offtrack_penalty=offtrack_penalty,
        max_resets=max_resets,
        seed=seed,
        video=video,
    )
    if as_json:
        _print_json(outcome.to_dict())
    else:
        _text().say_evaluated(outcome)


@tracks_app.callback(invoke_without_command=True)
def tracks(context: typer.Context, as_json: Json = False) -> None:
    """List the tracks of the library."""
    if context.invoked_subcommand is not None:
        return
    from racecraft.track import course, load_track, track_names

    listed = [(load_track(name), course(name)) for name in track_names()]
    if as_json:
        _print_json({"tracks": [_track_facts(track) for track, _ in listed]})
        return
    _text().say_tracks(listed)


@tracks_app.command("show")
def show_track(
    name: Annotated[str, typer.Argument(help="Name, file, or generated:SEED.")],
    output: Annotated[Path | None, typer.Option("--output", "-o", help="PNG file; by default NAME.png.")] = None,
    width: Annotated[int, typer.Option("--width", help="Pixels.")] = 1600,
    as_json: Json = False,
) -> None:
    """Draw a track as a picture to hang on a wall."""
    from racecraft.track import draw_track, load_track

    track = load_track(name)
    path = draw_track(track, output or Path(f"{track.name.replace(':', '-')}.png"), width_px=width)
    if as_json:
        _print_json({**_track_facts(track), "picture": str(path)})
    else:
        typer.echo(f"{track.name}: {track.length:.2f} m, drawn to {path}")


@reward_app.command("check")
def check(
    file: Annotated[str, typer.Argument(help="Path of a reward_function.py, or a preset.")],
    track: TrackOption = "reinvent_2018",
    as_json: Json = False,
) -> None:
    """Check a reward function and try it in a car's situations."""
    from racecraft.reward import check_reward, dry_run, load_reward
    from racecraft.track import load_track

    source = load_reward(file)
    problems = check_reward(source)
    has_errors = any(problem.severity == "error" for problem in problems)
    outcomes = [] if has_errors else dry_run(source, load_track(track))
    failed = has_errors or any(outcome.error is not None for outcome in outcomes)
    if as_json:
        _print_json(
            {
                "ok": not failed,
                "problems": [
                    {"line": p.line, "column": p.column, "severity": p.severity, "message": p.message, "hint": p.hint}
                    for p in problems
                ],
                "situations": [
                    {"name": o.situation.name, "reward": o.reward, "error": str(o.error) if o.error else None}
                    for o in outcomes
                ],
            }
        )
    else:
        _text().say_checked(problems, outcomes, failed=failed)
    if failed:
        raise typer.Exit(1)


@reward_app.command("list")
def list_rewards(as_json: Json = False) -> None:
    """The rewards that ship with Racecraft."""
    import ast

    from racecraft.reward import load_preset, preset_names

    listed = {name: (ast.get_docstring(ast.parse(load_preset(name))) or "").split("\n")[0] for name in preset_names()}
    if as_json:
        _print_json({"rewards": listed})
        return
    _text().say_rewards(listed)


@reward_app.command("show")
def show_reward(name: Annotated[str, typer.Argument(help="Preset, or path.")], as_json: Json = False) -> None:
    """Print a reward function, to start your own from."""
    from racecraft.reward import load_reward

    source = load_reward(name)
    if as_json:
        _print_json({"source": source})
    else:
        typer.echo(source, nl=False)


@app.command()
def doctor(as_json: Json = False) -> None:
    """Look whether everything Racecraft needs is here and works."""
    from racecraft.bench.doctor import examine

    findings = examine()
    if as_json:
        _print_json({"ok": all(f.ok for f in findings), "checks": [f.to_dict() for f in findings]})
    else:
        _text().say_examined(findings)
    if not all(f.ok for f in findings):
        raise typer.Exit(1)


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
    as_json: Json = False,
) -> None:
    """Compare logs of the original with the simulator."""
    from racecraft.replay import draw_comparison
    from racecraft.replay import replay as compare
    from racecraft.reward import load_reward

    result = compare(logs, track=track, vehicle=vehicle, reward=load_reward(reward) if reward else None)
    if picture is None and not as_json and result.examples:
        picture = Path("replay.png")
    if picture is not None:
        draw_comparison(result, picture)
    if as_json:
        _print_json({**result.to_dict(), **({"picture": str(picture)} if picture is not None else {})})
    else:
        _text().say_replayed(result, picture)


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
        _print_json({**result.to_dict(), "file": str(output)})
    else:
        _text().say_calibrated(result, output)


@app.command()
def bench(
    only: Annotated[
        list[str] | None, typer.Option("--only", help="simulator, reward, train, skill or rivals; may be repeated.")
    ] = None,
    seconds: Annotated[float, typer.Option("--seconds", help="Time for each throughput.")] = 3.0,
    seeds: Annotated[int, typer.Option("--seeds", help="Trainings of the skill benchmark.")] = 5,
    as_json: Json = False,
) -> None:
    """Measure speed on this machine, with its limits."""
    from racecraft.bench import run_benchmarks

    say = None if as_json else _text().say_progress
    results = run_benchmarks(only=only or [], seconds=seconds, seeds=seeds, say=say)
    if as_json:
        _print_json(results)
    else:
        _text().say_measured(results)


def main() -> None:
    """Run the command line.

    The exit status is 0; 1 for a mistake in what the user gave, told in one sentence; 2 for wrong usage; 130 when
    interrupted. With ``--json`` an error is a JSON object on stdout, too. ``--debug`` shows the stack trace.
    """
    arguments = [argument for argument in sys.argv[1:] if argument != "--debug"]
    is_debug, is_json = len(arguments) < len(sys.argv) - 1, "--json" in arguments
    warnings.showwarning = lambda message, *_, **__: typer.echo(f"warning: {message}", err=True)
    try:
        status = app(arguments, prog_name="racecraft", standalone_mode=False)
    except UsageError as error:
        usage: Any = error
        if is_json:
            verb = usage.ctx.command_path if usage.ctx is not None else "racecraft"
            _print_error("UsageError", usage.format_message(), f"See '{verb} --help'.")
        usage.show()
        sys.exit(2)
    except typer.Abort:
        sys.exit(INTERRUPTED)
    except Exception as error:
        is_expected = isinstance(error, RacecraftError | OSError)
        code, message = type(error).__name__, str(error)
        hint = getattr(error, "hint", "") if is_expected else "This is a bug in Racecraft. --debug shows where."
        if is_debug:
            traceback.print_exc()
        if is_json:
            _print_error(code, message, hint)
        if not is_debug:
            _text().say_error(code, message, hint)
        sys.exit(1)
    sys.exit(status if isinstance(status, int) else 0)


# ---- printing


def _text() -> Any:
    """What is printed for people; imported late, as rich takes its time."""
    from racecraft import cli_text

    return cli_text


def _print_json(document: dict[str, Any]) -> None:
    typer.echo(json.dumps(document, allow_nan=False, default=str))


def _print_error(code: str, message: str, hint: str) -> None:
    _print_json({"error": {"code": code, "message": message, "hint": hint}})


def _track_facts(track: Any) -> dict[str, Any]:
    return {
        "name": track.name,
        "length_m": round(track.length, 3),
        "mean_width_m": round(track.mean_width, 3),
        "min_radius_m": round(track.min_radius, 3) if math.isfinite(track.min_radius) else None,
        "direction": track.direction,
        "is_closed": track.is_closed,
    }


def _process_start() -> float:
    """`time.monotonic()` at which this process began, so that a training counts its own start-up."""
    try:
        with open("/proc/self/stat", encoding="ascii") as file:
            ticks = int(file.read().rsplit(")", 1)[1].split()[19])
        age = time.clock_gettime(time.CLOCK_BOOTTIME) - ticks / os.sysconf("SC_CLK_TCK")
    except (OSError, ValueError, AttributeError, IndexError):
        return time.monotonic()  # no such file outside Linux: the imports so far are not counted
    return time.monotonic() - max(age, 0.0)
