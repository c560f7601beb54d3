"""`racecraft doctor` and `racecraft bench`: this machine."""

from __future__ import annotations

from typing import Annotated

import typer

from racecraft.cli.app import Json, app, print_json, text


@app.command()
def doctor(as_json: Json = False) -> None:
    """Look whether everything Racecraft needs is here and works."""
    from racecraft.bench.doctor import examine

    findings = examine()
    if as_json:
        print_json({"ok": all(f.ok for f in findings), "checks": [f.to_dict() for f in findings]})
    else:
        text().say_examined(findings)
    if not all(f.ok for f in findings):
        raise typer.Exit(1)


@app.command()
def bench(
    only: Annotated[
        list[str] | None,
        typer.Option("--only", help="simulator, races, reward, train, skill, rivals or learn; may be repeated."),
    ] = None,
    seconds: Annotated[float, typer.Option("--seconds", help="Time for each throughput.")] = 3.0,
    seeds: Annotated[int, typer.Option("--seeds", help="Trainings of the skill benchmark.")] = 5,
    as_json: Json = False,
) -> None:
    """Measure speed on this machine, with its limits."""
    from racecraft.bench import run_benchmarks

    say = None if as_json else text().say_progress
    results = run_benchmarks(only=only or [], seconds=seconds, seeds=seeds, say=say)
    if as_json:
        print_json(results)
    else:
        text().say_measured(results)
