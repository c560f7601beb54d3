"""The command line: verbs only. Each one reads its options, calls the layer that does the work, and prints.

    racecraft train --until "5 laps"
    racecraft evaluate runs/NAME --laps 3

Everything heavy is imported inside the verbs, so that ``--help`` is instant.
"""

from __future__ import annotations

import json
import os
import sys
import time
from pathlib import Path
from typing import Annotated, Any

import typer

from racecraft import __version__
from racecraft.errors import RacecraftError

app = typer.Typer(
    name="racecraft",
    help="Teach a small car to race: reward function in, lap on video out.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode="rich",
    context_settings={"help_option_names": ["-h", "--help"]},
)
reward_app = typer.Typer(
    name="reward", help="Look at reward functions before training with them.", no_args_is_help=True
)
tracks_app = typer.Typer(name="tracks", help="List the tracks, or draw one.", invoke_without_command=True)
app.add_typer(reward_app)
app.add_typer(tracks_app)

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
    from racecraft import training
    from racecraft.training.progress import SilentReporter
    from racecraft.training.terminal import TerminalReporter

    title = f"Racecraft · {resume}" if resume else f"Racecraft · {track} · {Path(reward).stem}"
    view = TerminalReporter(title=title) if not as_json else None
    reporter = view or SilentReporter()
    if view is not None:
        view.__enter__()
    try:
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
    finally:
        if view is not None:
            view.__exit__()
    if as_json:
        _print_json(result.to_dict())
    else:
        _say_trained(result)
    if video:
        evaluate(result.run, as_json=False) if not as_json else None
    if result.reason == "interrupted":
        raise typer.Exit(130)


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
    direction: Annotated[str, typer.Option("--direction", help="forward or reverse.")] = "forward",
    offtrack_penalty: Annotated[
        float | None, typer.Option("--offtrack-penalty", help="Seconds; by default the rules'.")
    ] = None,
    max_resets: Annotated[int | None, typer.Option("--max-resets", help="Resets to a trial.")] = None,
    seed: Annotated[int, typer.Option("--seed", "-s", help="Of the starts.")] = 0,
    video: Annotated[bool, typer.Option("--video/--no-video", help="Write an MP4 of the best trial.")] = True,
    as_json: Json = False,
) -> None:
    """Race a run's policy against the clock: lap times, penalties, a video and a picture of the racing line."""
    from racecraft.race.run_evaluation import evaluate_run

    outcome = evaluate_run(
        run,
        track=track or None,
        laps=laps,
        num_trials=trials,
        rules=rules,
        checkpoint=int(checkpoint) if checkpoint.isdigit() else checkpoint,
        vehicle=vehicle or None,
        direction=direction,
        offtrack_penalty=offtrack_penalty,
        max_resets=max_resets,
        seed=seed,
        video=video,
    )
    if as_json:
        _print_json(outcome.to_dict())
    else:
        _say_evaluated(outcome)


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
    from rich.table import Table

    table = Table(title="Tracks", title_style="bold", header_style="bold", border_style="dim")
    for heading, justify in (
        ("name", "left"),
        ("length", "right"),
        ("width", "right"),
        ("radius", "right"),
        ("", "left"),
    ):
        table.add_column(heading, justify=justify)  # type: ignore[arg-type]
    for track, design in listed:
        table.add_row(
            f"[bold]{track.name}[/bold]",
            f"{track.length:.1f} m",
            f"{track.mean_width:.2f} m",
            f"{track.min_radius:.2f} m",
            design.description,
        )
    _console().print(table)
    _console().print("Draw one with [bold]racecraft tracks show NAME[/bold]; 'generated:7' and files work too.")


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
        _console().print(f"{track.name}: {track.length:.2f} m, drawn to [bold]{path}[/bold]")


@reward_app.command("check")
def check(
    file: Annotated[str, typer.Argument(help="Path of a reward_function.py, or a preset.")],
    track: TrackOption = "reinvent_2018",
    as_json: Json = False,
) -> None:
    """Check a reward function, then try it in the situations a car gets into."""
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
        _say_checked(problems, outcomes, failed=failed)
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
    from rich.table import Table

    table = Table(header_style="bold", border_style="dim")
    table.add_column("name")
    table.add_column("")
    for name, text in listed.items():
        table.add_row(f"[bold]{name}[/bold]", text)
    _console().print(table)


@reward_app.command("show")
def show_reward(name: Annotated[str, typer.Argument(help="Preset, or path.")]) -> None:
    """Print a reward function, to start your own from: racecraft reward show racing > reward_function.py."""
    from racecraft.reward import load_reward

    typer.echo(load_reward(name), nl=False)


@app.command()
def doctor(as_json: Json = False) -> None:
    """Look whether everything Racecraft needs is here and works."""
    from racecraft.bench.doctor import examine

    findings = examine()
    if as_json:
        _print_json({"ok": all(f.ok for f in findings), "checks": [f.to_dict() for f in findings]})
    else:
        console = _console()
        for finding in findings:
            mark = "[green]ok[/green]  " if finding.ok else "[red]bad[/red] "
            console.print(f"{mark} {finding.name:<18} {finding.text}", highlight=False)
            if finding.hint:
                console.print(f"      [dim]hint: {finding.hint}[/dim]", highlight=False)
    if not all(f.ok for f in findings):
        raise typer.Exit(1)


@app.command()
def bench(
    only: Annotated[
        list[str] | None, typer.Option("--only", help="simulator, reward, train, skill or rivals; may be repeated.")
    ] = None,
    seconds: Annotated[float, typer.Option("--seconds", help="Time for each throughput.")] = 3.0,
    seeds: Annotated[int, typer.Option("--seeds", help="Trainings of the skill benchmark.")] = 5,
    as_json: Json = False,
) -> None:
    """Measure speed on this machine: simulator, reward worker, training, time to a lap, rivals."""
    from racecraft.bench import run_benchmarks, table

    results = run_benchmarks(only=only or [], seconds=seconds, seeds=seeds, say=None if as_json else _say_progress)
    if as_json:
        _print_json(results)
    else:
        _console().print(table(results))


def main() -> None:
    """Run the command line: errors in one sentence, exit status 1; 2 for wrong usage; 130 when interrupted."""
    debug = "--debug" in sys.argv
    if debug:
        sys.argv.remove("--debug")
    try:
        app()
    except RacecraftError as error:
        if debug:
            raise
        if "--json" in sys.argv:
            _print_json({"error": {"code": type(error).__name__, "message": str(error), "hint": error.hint}})
        _say_error(type(error).__name__, str(error), error.hint)
        sys.exit(1)
    except (KeyboardInterrupt, BrokenPipeError):
        if debug:
            raise
        sys.exit(130)


# ---- printing


def _console(*, stderr: bool = False) -> Any:
    from rich.console import Console

    return Console(stderr=stderr)


def _print_json(document: dict[str, Any]) -> None:
    typer.echo(json.dumps(document, allow_nan=False, default=str))


def _say_progress(text: str) -> None:
    _console(stderr=True).print(text, style="dim", highlight=False)


def _say_error(name: str, message: str, hint: str) -> None:
    from rich.text import Text

    console = _console(stderr=True)
    console.print(Text.assemble((f"{name}: ", "bold red"), message))
    if hint:
        console.print(Text.assemble(("hint: ", "bold"), hint))


def _say_trained(result: Any) -> None:
    console = _console()
    ended = {
        "laps": "Learned it",
        "seconds": "Time is up",
        "steps": "All steps are done",
        "episodes": "All episodes are done",
        "score": "The score is reached",
        "interrupted": "Stopped",
    }[result.reason]
    lap = f", best lap {result.best_lap_seconds:.2f} s" if result.best_lap_seconds is not None else ""
    console.print(
        f"[bold]{ended}[/bold] after {result.wall_seconds:.1f} s and {result.steps:,} camera steps: "
        f"{result.laps_completed} of {result.evaluation_trials} evaluation laps{lap}.",
        highlight=False,
    )
    parts = ", ".join(f"{name} {seconds:.1f}" for name, seconds in result.parts.items() if seconds >= 0.05)
    console.print(f"[dim]Seconds: {parts}.[/dim]", highlight=False)
    console.print(f"Run folder: [bold]{result.run}[/bold]", highlight=False)
    if result.reason != "laps":
        console.print(f"Continue with: [bold]racecraft train --resume {result.run}[/bold]", highlight=False)


def _say_evaluated(outcome: Any) -> None:
    from rich.table import Table

    console = _console()
    evaluation = outcome.evaluation
    table = Table(header_style="bold", border_style="dim", title=f"{outcome.run.name} on {evaluation.track.name}")
    for heading in ("trial", "laps", "best lap", "mean lap", "total", "off track", "resets", "penalty", "completion"):
        table.add_column(heading, justify="right")
    for trial in evaluation.trials:
        times = trial.lap_times
        table.add_row(
            str(trial.index + 1),
            f"{len(times)} of {evaluation.rules.laps}",
            f"{min(times):.2f} s" if times else "–",
            f"{sum(times) / len(times):.2f} s" if times else "–",
            f"{trial.time:.2f} s",
            str(sum(lap.off_track_count for lap in trial.laps)),
            str(sum(lap.resets for lap in trial.laps)),
            f"{sum(lap.penalty_seconds for lap in trial.laps):.1f} s",
            f"{100 * trial.completion:.0f} %",
        )
    console.print(table)
    console.print(outcome.summary, highlight=False)
    for what, path in outcome.files.items():
        console.print(f"  {what:<12} [bold]{path}[/bold]", highlight=False, soft_wrap=True)


def _say_checked(problems: list[Any], outcomes: list[Any], *, failed: bool) -> None:
    from rich.table import Table
    from rich.text import Text

    console = _console()
    for problem in problems:
        style = "bold red" if problem.severity == "error" else "bold yellow"
        console.print(Text.assemble((f"{problem.severity}: ", style), str(problem)))
    if outcomes:
        table = Table(header_style="bold", border_style="dim")
        table.add_column("situation")
        table.add_column("reward", justify="right")
        for outcome in outcomes:
            reward = "error" if outcome.reward is None else f"{outcome.reward:.4g}"
            table.add_row(outcome.situation.description, reward)
        console.print(table)
        first = next((outcome.error for outcome in outcomes if outcome.error is not None), None)
        if first is not None:
            console.print(Text.assemble(("error: ", "bold red"), str(first)))
    console.print(
        "[bold red]Not fit for training.[/bold red]" if failed else "[bold green]Fit for training.[/bold green]"
    )


def _track_facts(track: Any) -> dict[str, Any]:
    return {
        "name": track.name,
        "length_m": round(track.length, 3),
        "mean_width_m": round(track.mean_width, 3),
        "min_radius_m": round(track.min_radius, 3),
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
