"""`racecraft login`, `racecraft races` and `racecraft submit`: a league on another machine."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Annotated

import typer

from racecraft.cli.app import Checkpoint, Json, OneModel, app, model_of, print_json

if TYPE_CHECKING:
    from racecraft.judging.league import League


@app.command()
def login(
    url: Annotated[str, typer.Argument(help="Address of the league: https://NAME or http://NAME:PORT.")],
    token: Annotated[
        str,
        typer.Option(
            "--token",
            envvar="RACECRAFT_TOKEN",
            help="From your account there; without one a code is shown, to be typed there.",
        ),
    ] = "",
    as_json: Json = False,
) -> None:
    """Remember a league and the token that opens it."""
    from racecraft.judging.league import League, remember_league

    league = League(url, token or _token_by_code(League(url)))
    races = league.races()
    remember_league(league)
    if as_json:
        print_json({"url": league.url, "races": len(races)})
    else:
        typer.echo(f"{league.url} knows you. Races that you can see: {len(races)}; racecraft races lists them.")


def _token_by_code(league: League) -> str:
    asked = league.begin_login()
    typer.echo(f"Open {asked['link']} where you are signed in, and let {asked['code']} in.", err=True)
    while not (token := league.take_token(asked["secret"])):
        time.sleep(1.0)
    return token


@app.command()
def races(as_json: Json = False) -> None:
    """List the races of the league that you are logged in to."""
    from racecraft.judging.league import remembered_league

    found = remembered_league().races()
    if as_json:
        print_json({"races": found})
        return
    for race in found:
        typer.echo(f"{race['id']:>5}  {race['state']:<9} {race['kind']:<17} {race['track']:<24} {race['title']}")
    if not found:
        typer.echo("There is no race yet in your groups.")


@app.command()
def submit(
    context: typer.Context,
    run: OneModel,
    race: Annotated[int, typer.Option("--race", help="Number of the race, as racecraft races lists it.")],
    checkpoint: Checkpoint = "best",
    wait: Annotated[bool, typer.Option("--wait/--no-wait", help="Until it is judged.")] = True,
    as_json: Json = False,
) -> None:
    """Send a run to a race of a league, which drives it."""
    from racecraft.judging.league import LeagueRefused, remembered_league
    from racecraft.run import RunFolder

    run, checkpoint = model_of(context, run, checkpoint)
    league = remembered_league()
    found = league.submit(RunFolder.open(run), race, checkpoint=checkpoint)
    shown = None
    while wait and found["state"] in ("queued", "running"):
        if not as_json and found["ahead"] != shown:
            shown = found["ahead"]
            left = f", about {found['seconds_left']:.0f} s" if found["seconds_left"] is not None else ""
            typer.echo(f"Submission {found['id']} is {found['state']}; {shown} before it{left}.")
        time.sleep(1.0)
        found = league.submission(race, found["id"])
    if as_json:
        print_json(found)
    if found["state"] in ("failed", "cancelled"):
        error = found["error"] or {}
        raise LeagueRefused(str(error.get("message") or "It was cancelled."), hint=str(error.get("hint") or ""))
    if not as_json and found["state"] == "done":
        score = "no score: too few laps" if found["score"] is None else f"{found['score']:.3f} s"
        typer.echo(f"Submission {found['id']}: {score}.")
        if found.get("is_looked_at"):
            typer.echo("It drives like somebody else's entry, so a person looks at it; it counts meanwhile.")
