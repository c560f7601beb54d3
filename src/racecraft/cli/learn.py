"""`racecraft learn`."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Annotated, Any

import typer

from racecraft.cli.app import INTERRUPTED, Json, app, is_given, print_json


@app.command()
def learn(
    context: typer.Context,
    environment: Annotated[str, typer.Argument(help="Any id of Gymnasium; none lists what is tuned.")] = "",
    algorithm: Annotated[
        str, typer.Option("--algorithm", help="q-table, sarsa, dqn, reinforce, a2c, a3c, ppo or sac.")
    ] = "",
    until: Annotated[
        str, typer.Option("--until", "-u", help="When to stop: '475 return', '20000 steps', '1 minute', 'A or B'.")
    ] = "",
    seed: Annotated[int, typer.Option("--seed", "-s", help="The same seed repeats a run; not of a3c.")] = 0,
    changes: Annotated[list[str], typer.Option("--set", help="Setting of the algorithm, NAME=VALUE; repeat.")] = [],  # noqa: B006 (Typer copies it)
    make: Annotated[list[str], typer.Option("--make", help="Argument of the environment, NAME=VALUE; repeat.")] = [],  # noqa: B006
    name: Annotated[str | None, typer.Option("--name", "-n", help="Name of the run.")] = None,
    runs: Annotated[Path, typer.Option("--runs", help="Folder that holds the runs.")] = Path("runs"),
    resume: Annotated[Path | None, typer.Option("--resume", help="Go on with what this run has learned.")] = None,
    watch: Annotated[
        bool,
        typer.Option("--watch", help="Film an episode; with --resume, and without --until, only that."),
    ] = False,
    as_json: Json = False,
) -> None:
    """Learn any Gymnasium environment with readable algorithms."""
    if resume is not None:
        for option in context.command.params:
            if is_given(context, str(option.name)) and option.name not in ("resume", "until", "watch", "as_json"):
                context.fail(f"{option.opts[0]} does not go with --resume: a run keeps what it was started with.")
    for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):  # before NumPy: threads cost small products time
        os.environ.setdefault(variable, "1")
    from racecraft import classic
    from racecraft.cli import learn_text

    if resume is None and not environment:
        if as_json:
            print_json({"tuned": [{"environment": one, "algorithm": other} for one, other in classic.RECIPES]})
        else:
            learn_text.say_tuned()
        return
    if resume is not None and watch and not until:
        _film_saved(resume, as_json=as_json)
        return
    title = f"Racecraft · {resume or environment} · {algorithm}".removesuffix(" · ")
    with learn_text.CurveReporter(title=title, is_quiet=as_json) as reporter:
        if resume is not None:
            learned = classic.resume(resume, until=until, on_progress=reporter)
        else:
            algorithm = algorithm or classic.default_algorithm(environment)
            learned = classic.learn(
                environment,
                algorithm,
                seed=seed,
                until=until,
                settings=_pairs("--set", changes),
                make=_pairs("--make", make),
                root=runs,
                name=name,
                on_progress=reporter,
            )
    film = None
    if watch and learned.reason != "interrupted":
        from racecraft.classic.film import film_learned
        from racecraft.classic.saved import FILM

        assert learned.run is not None
        film = film_learned(learned.lesson, learned.policy, learned.run / FILM)
    if as_json:
        print_json({**learned.to_dict(), **({"film": str(film)} if film is not None else {})})
    else:
        learn_text.say_learned(learned, film)
    if learned.reason == "interrupted":
        raise typer.Exit(INTERRUPTED)


def _film_saved(run: Path, *, as_json: bool) -> None:
    """Film what a run has learned; it learns nothing more."""
    from racecraft import classic
    from racecraft.classic.film import film_learned
    from racecraft.classic.saved import FILM
    from racecraft.cli import learn_text

    lesson, policy = classic.recall(run)
    film = film_learned(lesson, policy, run / FILM)
    if as_json:
        print_json({"run": str(run), "film": str(film)})
    else:
        learn_text.say_film(film)


def _pairs(option: str, texts: list[str]) -> dict[str, Any]:
    """NAME=VALUE as a dict; a value is JSON where it can be, text otherwise."""
    from racecraft.errors import ConfigError

    found: dict[str, Any] = {}
    for text in texts:
        name, equals, value = text.partition("=")
        name = name.strip().replace("-", "_")
        if not equals or not name.isidentifier():
            raise ConfigError(f"{option} is {text!r}; write it like NAME=VALUE.")
        if name in found:
            raise ConfigError(f"{option} gives {name} twice.")
        try:
            found[name] = json.loads(value)
        except (ValueError, RecursionError):
            found[name] = value
    return found
