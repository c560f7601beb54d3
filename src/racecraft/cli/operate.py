"""`racecraft league`: what whoever runs a league does beside the server."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer

from racecraft.cli.app import Json, app, print_json
from racecraft.cli.serve import Database
from racecraft.extras import needed_for

league_app = typer.Typer(help="Look after a league that runs here.", rich_markup_mode=None, no_args_is_help=True)
app.add_typer(league_app, name="league")

Runs = Annotated[Path, typer.Option("--runs", help="Folder that the league's server was given.")]


@league_app.command()
def backup(
    to: Annotated[Path, typer.Argument(help="File to write; keep it where only you can read it.")],
    runs: Runs = Path("runs"),
    database: Database = "",
    as_json: Json = False,
) -> None:
    """Write the database and the folder into one file; the server may be running."""
    with needed_for("A league"):
        from racecraft.serve.settings import ServeSettings
        from racecraft.serve.store.backup import back_up

    made = back_up(ServeSettings(runs=runs, database=database), to)
    if as_json:
        print_json({"file": str(to), **asdict(made)})
    else:
        typer.echo(f"{to}: {sum(made.rows.values())} rows and {made.files} files.")


@league_app.command()
def restore(
    source: Annotated[Path, typer.Argument(help="File that racecraft league backup wrote.")],
    runs: Runs = Path("runs"),
    database: Database = "",
    as_json: Json = False,
) -> None:
    """Put a league where there is none: an empty folder and an empty database; everybody signs in anew."""
    with needed_for("A league"):
        from racecraft.serve.settings import ServeSettings
        from racecraft.serve.store.backup import restore as put_back

    found = put_back(ServeSettings(runs=runs, database=database), source)
    if as_json:
        print_json({"runs": str(runs), **asdict(found)})
    else:
        typer.echo(f"{runs}: {sum(found.rows.values())} rows and {found.files} files of {found.created[:19]}.")


@league_app.command()
def audit(
    runs: Runs = Path("runs"),
    database: Database = "",
    count: Annotated[int, typer.Option("--count", min=1, help="How many of the latest lines.")] = 100,
    as_json: Json = False,
) -> None:
    """Who did what with power, oldest first; the server may be running."""
    with needed_for("A league"):
        from racecraft.serve.audit.audit import Audit
        from racecraft.serve.settings import ServeSettings
        from racecraft.serve.store.database import Database as Tables

    tables = Tables(ServeSettings(runs=runs, database=database).database_url)
    tables.require_current()
    lines = Audit(tables).latest(count)[::-1]
    tables.close()
    if as_json:
        print_json({"lines": [{**line.model_dump(), "when": line.when.isoformat()} for line in lines]})
        return
    for line in lines:
        told = " ".join(f"{key}={value}" for key, value in line.details.items())
        mark = "" if line.is_done else "  (not known to be done)"
        when = f"{line.when:%Y-%m-%d %H:%M:%S}"
        who = f"{line.name} ({line.who})" if line.who is not None else "(nobody)"
        typer.echo(f"{when}  {who}  {line.what}  {line.target}  {told}{mark}".rstrip())
    if not lines:
        typer.echo("Nobody has done anything with power yet.")


@league_app.command()
def token(
    title: Annotated[str, typer.Argument(help="What for, as the list of tokens shows it.")] = "worker",
    runs: Runs = Path("runs"),
    database: Database = "",
    days: Annotated[int, typer.Option("--days", min=1, max=365, help="How long it is good.")] = 90,
    as_json: Json = False,
) -> None:
    """Make a token for machines that work for this league, and print it; the server may be running."""
    from racecraft.checks import require

    with needed_for("A league"):
        from racecraft.serve.audit.audit import Audit
        from racecraft.serve.people.keys import WORKER, Keys
        from racecraft.serve.settings import OWNER, ServeSettings
        from racecraft.serve.store.database import Database as Tables

    require("The token's name", title, bool(title.strip()), "what the list of tokens is to show")
    tables = Tables(ServeSettings(runs=runs, database=database).database_url)
    tables.require_current()
    number, secret = Keys(tables).make_token(OWNER, title=title[:64], scopes=[WORKER], days=days)
    Audit(tables).note(OWNER, "make_token", "racecraft league token", title=title[:64])
    tables.close()
    if as_json:
        print_json({"id": number, "token": secret})
    else:
        typer.echo(secret)


@league_app.command()
def reset(
    name: Annotated[str, typer.Argument(help="Nickname of whose password is forgotten.")],
    runs: Runs = Path("runs"),
    database: Database = "",
    address: Annotated[str, typer.Option("--address", help="By which others call the league.")] = (
        "http://127.0.0.1:8321"
    ),
    as_json: Json = False,
) -> None:
    """Make a link by which somebody gives themselves a new password, once; the server may be running."""
    with needed_for("A league"):
        from racecraft.serve.audit.audit import Audit
        from racecraft.serve.people.keys import Keys
        from racecraft.serve.people.people import People
        from racecraft.serve.settings import OWNER, ServeSettings
        from racecraft.serve.store.database import Database as Tables

    settings = ServeSettings(runs=runs, database=database, address=address, league=True, plain_http=True)
    tables = Tables(settings.database_url)
    tables.require_current()
    person = People(tables).named(name)
    secret = Keys(tables).make_reset(person.id)
    Audit(tables).note(OWNER, "make_reset", "racecraft league reset", person=person.name)
    tables.close()
    link = f"{address.rstrip('/')}/reset#{secret}"
    if as_json:
        print_json({"person": person.id, "link": link})
    else:
        typer.echo(f"{link}\nGood once, for a day. Whoever opens it is {person.name}; give it to nobody else.")
