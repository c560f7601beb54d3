"""`racecraft sweep`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from racecraft.cli.app import INTERRUPTED, Json, app, print_json, text
from racecraft.extras import check_installed

if TYPE_CHECKING:
    from racecraft.tuning.trial import Report


@app.command()
def sweep(
    context: typer.Context,
    file: Annotated[
        Path | None, typer.Argument(help="TOML with seeds, what all trainings have, and the settings.")
    ] = None,
    name: Annotated[
        str | None, typer.Option("--name", "-n", help="Of the sweep; its runs are NAME-SETTING-SEED.")
    ] = None,
    runs: Annotated[Path, typer.Option("--runs", help="Folder that holds the runs.")] = Path("runs"),
    processes: Annotated[
        int, typer.Option("--processes", min=0, max=256, help="Trainings at once; 0 for one per core. Same results.")
    ] = 0,
    cluster: Annotated[
        str, typer.Option("--cluster", help="Train on a cluster of Ray: auto, or ray://HOST:10001.")
    ] = "",
    resume: Annotated[str, typer.Option("--resume", help="Go on with the sweep of this name.")] = "",
    board: Annotated[bool, typer.Option("--board", help="Only show how it stands; with --resume NAME.")] = False,
    as_json: Json = False,
) -> None:
    """Train a table of settings over seeds, and compare them.

    What its seeds cannot tell apart is said to be so.
    """
    if (file is None) == (not resume):
        context.fail("Give the file of a new sweep, or --resume NAME.")
    if resume and name is not None:
        context.fail("--name does not go with --resume: a sweep keeps the name that it was made with.")
    if board and not resume:
        context.fail("--board shows a sweep that there is: name it with --resume NAME.")
    if cluster:
        check_installed("ray", "--cluster")
    from racecraft.cli import sweep_text
    from racecraft.json_file import read_text
    from racecraft.sweeping import Sweep, make_sweep, read_sweep

    def tell(run: str, how: Report | Exception) -> None:
        if not as_json:
            sweep_text.say_run(run, how)

    plan = None if file is None else read_sweep(read_text(file))
    swept = Sweep(runs, resume) if plan is None else make_sweep(plan, runs=runs, name=name)
    notes = () if plan is None else plan.notes
    if not as_json:
        for note in notes:
            text().say_progress(note)
    is_interrupted = False if board else swept.train(processes=processes, cluster=cluster, on_end=tell)
    found = swept.board()
    if as_json:
        print_json({"sweep": swept.name, **found.to_dict(), "is_interrupted": is_interrupted, "notes": list(notes)})
    else:
        sweep_text.say_board(swept.name, found, runs=runs)
    if is_interrupted:
        raise typer.Exit(INTERRUPTED)
