"""`racecraft reward`: check, list and show reward functions."""

from __future__ import annotations

from typing import Annotated

import typer

from racecraft.cli.app import Json, TrackOption, app, print_json, text

NumObjects = Annotated[int, typer.Option("--objects", help="Boxes on the track, as in object avoidance.")]
NumBots = Annotated[int, typer.Option("--bots", help="Bot cars on the track, as in head-to-bot.")]
reward_app = typer.Typer(help="Look at reward functions.", no_args_is_help=True, rich_markup_mode=None)
app.add_typer(reward_app, name="reward")


@reward_app.command("check")
def check(
    file: Annotated[str, typer.Argument(help="Path of a reward_function.py, or a preset.")],
    track: TrackOption = "reinvent_2018",
    objects: NumObjects = 0,
    bots: NumBots = 0,
    as_json: Json = False,
) -> None:
    """Check a reward function and try it in a car's situations."""
    from racecraft.reward import check_reward, dry_run, load_reward
    from racecraft.sim import Bots, Objects, Obstacles
    from racecraft.track import load_track

    around = Objects(obstacles=Obstacles(count=objects) if objects else None, bots=Bots(count=bots) if bots else None)
    source = load_reward(file)
    problems = check_reward(source)
    has_errors = any(problem.severity == "error" for problem in problems)
    outcomes = [] if has_errors else dry_run(source, load_track(track), objects=around)
    failed = has_errors or any(outcome.error is not None for outcome in outcomes)
    if as_json:
        print_json(
            {
                "ok": not failed,
                "problems": [
                    {"line": p.line, "column": p.column, "severity": p.severity, "message": p.message, "hint": p.hint}
                    for p in problems
                ],
                "situations": [
                    {
                        "name": o.situation.name,
                        "reward": o.reward,
                        "error": str(o.error) if o.error else None,
                        "printed": o.printed,
                    }
                    for o in outcomes
                ],
            }
        )
    else:
        text().say_checked(problems, outcomes, failed=failed)
    if failed:
        raise typer.Exit(1)


@reward_app.command("list")
def list_rewards(as_json: Json = False) -> None:
    """The rewards that ship with Racecraft."""
    import ast

    from racecraft.reward import load_preset, preset_names

    listed = {name: (ast.get_docstring(ast.parse(load_preset(name))) or "").split("\n")[0] for name in preset_names()}
    if as_json:
        print_json({"rewards": listed})
        return
    text().say_rewards(listed)


@reward_app.command("show")
def show_reward(name: Annotated[str, typer.Argument(help="Preset, or path.")], as_json: Json = False) -> None:
    """Print a reward function, to start your own from."""
    from racecraft.reward import load_reward

    source = load_reward(name)
    if as_json:
        print_json({"source": source})
    else:
        typer.echo(source, nl=False)
