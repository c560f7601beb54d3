"""`racecraft tune`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from racecraft.cli.app import INTERRUPTED, Json, app, is_given, print_json, refuse_beside_metadata, text

_OF_A_CALL = ("resume", "minutes", "trials", "processes", "as_json")


@app.command()
def tune(
    context: typer.Context,
    track: Annotated[
        list[str], typer.Option("--track", "-t", help="Track, file or generated:0..99; several by repeating it.")
    ] = ["reinvent_2018"],  # noqa: B006 (Typer copies it)
    reward: Annotated[str, typer.Option("--reward", "-r", help="Preset, or path of a reward_function.py.")] = "racing",
    search: Annotated[
        list[str],
        typer.Option("--search", help="Constant of the reward or hyperparameter, 'NAME' or 'NAME=LOW..HIGH'; repeat."),
    ] = [],  # noqa: B006 (Typer copies it)
    goal: Annotated[
        str, typer.Option("--for", help="laps (learn them soonest) or lap_time (the fastest lap).")
    ] = "laps",
    minutes: Annotated[float, typer.Option("--minutes", "-m", help="How long to search.")] = 10.0,
    trials: Annotated[int, typer.Option("--trials", help="Most trials; 0 for as many as the minutes hold.")] = 0,
    trial_steps: Annotated[int, typer.Option("--trial-steps", help="Camera steps after which a trial ends.")] = 40_000,
    actions: Annotated[
        str, typer.Option("--actions", help="Action space: default, aws, fast, safe, steady or continuous.")
    ] = "default",
    model_metadata: Annotated[
        Path | None, typer.Option("--model-metadata", help="AWS's model_metadata.json, in place of --actions.")
    ] = None,
    hyperparameters: Annotated[
        Path | None, typer.Option("--hyperparameters", help="AWS's hyperparameters.json, where the search begins.")
    ] = None,
    parent: Annotated[
        str | None, typer.Option("--from", help="Every trial begins with the weights of RUN or RUN@checkpoint.")
    ] = None,
    seed: Annotated[int, typer.Option("--seed", "-s", help="Of every trial and of the search.")] = 0,
    num_threads: Annotated[int, typer.Option("--num-threads", help="0 takes one per core.")] = 0,
    processes: Annotated[
        int, typer.Option("--processes", help="Trials at once, up to --window; 0 for one per core. Same results.")
    ] = 0,
    window: Annotated[
        int,
        typer.Option("--window", help="Trials that may be under way at once; trial n knows those up to n - window."),
    ] = 4,
    name: Annotated[str | None, typer.Option("--name", "-n", help="Name of the search's folder.")] = None,
    root: Annotated[Path, typer.Option("--root", help="Folder that holds the searches.")] = Path("tuning"),
    resume: Annotated[Path | None, typer.Option("--resume", help="Go on with this search.")] = None,
    as_json: Json = False,
) -> None:
    """Tune a reward's constants and hyperparameters within minutes."""
    if resume is not None:
        for option in context.command.params:
            if is_given(context, str(option.name)) and option.name not in _OF_A_CALL:
                context.fail(f"{option.opts[0]} does not go with --resume: a search keeps what it was started with.")
    refuse_beside_metadata(context)
    from racecraft.checks import check_choice
    from racecraft.cli import tune_text
    from racecraft.training.plan import make_plan
    from racecraft.tuning import GOALS, Tuning, check_limits, make_tuning

    check_choice("--for", goal, GOALS)
    check_limits(minutes=minutes, max_trials=trials, processes=processes)
    folder, notes = resume, tuple[str, ...]()
    if folder is None:
        options: dict[str, Any] = {"track": track, "reward": reward, "actions": actions}
        if parent is not None or model_metadata is not None:  # what is not given is the parent's or the file's
            options = {name: value for name, value in options.items() if is_given(context, name)}
        plan = make_plan(
            **options,
            model_metadata=model_metadata,
            hyperparameters=hyperparameters,
            parent=parent,
            seed=seed,
            num_threads=num_threads,
        )
        folder = make_tuning(
            plan, search=search, goal=goal, trial_steps=trial_steps, window=window, name=name, root=root
        )
        notes = plan.notes
    if not as_json:
        for note in notes:
            text().say_progress(note)
    tuning = Tuning(folder, on_trial=None if as_json else lambda trial: tune_text.say_trial(trial, tuning.goal))
    outcome = tuning.run(minutes=minutes, max_trials=trials, processes=processes)
    if as_json:
        print_json({**outcome.to_dict(), "notes": list(notes)})
    else:
        tune_text.say_tuned(outcome)
    if outcome.is_interrupted:
        raise typer.Exit(INTERRUPTED)
