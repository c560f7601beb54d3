"""`racecraft race`, `racecraft ladder`, and replays: `racecraft film` and `racecraft verify`."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Protocol, TypeVar

import typer

from racecraft.cli import race_options
from racecraft.cli.app import Json, TrackOption, app, is_given, make_folder_of, print_json, text

if TYPE_CHECKING:
    from racecraft.race.announcement import Announcement
    from racecraft.sim import Objects

Models = Annotated[list[str], typer.Argument(metavar="MODELS", help="Runs, RUN or RUN@CHECKPOINT.")]
Kind = Annotated[
    str,
    typer.Option("--type", help="time-trial, object-avoidance, head-to-bot, head-to-model or grid."),
]
Rules = Annotated[str, typer.Option("--rules", help="drfc, worker, droa or live.")]
Vehicle = Annotated[str, typer.Option("--vehicle", help="Everybody's: v4, v5, v6 or a file.")]
Randomize = Annotated[str, typer.Option("--randomize", help="none, light, strong, real, aws or a JSON file.")]


@app.command()
def race(
    context: typer.Context,
    models: Models,
    track: TrackOption = "reinvent_2018",
    kind: Kind = "time-trial",
    laps: Annotated[int | None, typer.Option("--laps", "-l", help="By default the rules'.")] = None,
    rules: Rules = "drfc",
    ranking: Annotated[str, typer.Option("--ranking", help="total, best or average.")] = "total",
    minimum_laps: Annotated[
        int | None, typer.Option("--minimum-laps", help="Laps that a trial must have for a score; all with total.")
    ] = None,
    trials: Annotated[
        int | None,
        typer.Option("--trials", help="Of each model alone, from other places of the lap; 5. Their median counts."),
    ] = None,
    time_limit: Annotated[float | None, typer.Option("--time-limit", help="Seconds on the clock; 0 for none.")] = None,
    offtrack_penalty: race_options.OfftrackPenalty = None,
    collision_penalty: race_options.CollisionPenalty = None,
    max_resets: Annotated[int | None, typer.Option("--max-resets", help="Resets to a race.")] = None,
    direction: Annotated[str, typer.Option("--direction", help="forward or reverse.")] = "",
    objects: race_options.NumObjects = None,
    bots: race_options.NumBots = None,
    bot_speed: race_options.BotSpeed = None,
    lane_changes: race_options.LaneChanges = False,
    parked_cars: race_options.ParkedCars = False,
    placement: race_options.Placement = "",
    positions: race_options.Positions = "",
    vehicle: Vehicle = "v5",
    randomize: Randomize = "none",
    seed: Annotated[int, typer.Option("--seed", "-s", help="Of starts and objects, known to everybody.")] = 0,
    secret: Annotated[
        bool, typer.Option("--secret", help="Draw them from a secret instead; its commitment is told first.")
    ] = False,
    video: Annotated[bool, typer.Option("--video/--no-video", help="Write an MP4 of every entry.")] = True,
    ghost: race_options.Ghosts = None,
    output: Annotated[Path, typer.Option("--output", "-o", help="Folder of all races.")] = Path("races"),
    as_json: Json = False,
) -> None:
    """Race models against each other.

    Writes results, and for every entry a replay, a sim-trace and a film.
    """
    if secret and is_given(context, "seed"):
        context.fail("--secret and --seed are two ways to say where the race starts; give one.")
    from racecraft.judging.race import race_models
    from racecraft.race.announcement import draw_secret

    def announce(announcement: Announcement) -> None:
        if secret and not as_json:
            text().say_progress(f"Commitment {announcement.commitment}")

    outcome = race_models(
        models,
        track=track,
        kind=race_options.kind_of(kind),
        laps=laps,
        rules=rules,
        ranking=ranking,
        minimum_laps=minimum_laps,
        num_trials=trials,
        objects=_objects(kind, context.params),
        vehicle=vehicle,
        randomize=randomize,
        seed=seed,
        secret=draw_secret() if secret else None,
        announce=announce,
        changes={
            "time_limit": time_limit,
            "offtrack_penalty": offtrack_penalty,
            "collision_penalty": collision_penalty,
            "max_resets": max_resets,
            "direction": direction or None,
        },
        video=video,
        ghosts=ghost or (),
        root=output,
    )
    if as_json:
        print_json(outcome.to_dict())
    else:
        text().say_raced(outcome)


@app.command()
def ladder(
    context: typer.Context,
    models: Models,
    track: Annotated[
        list[str] | None,
        typer.Option("--track", "-t", help="Track, repeatable: a name, a file, library, generated:0..9."),
    ] = None,
    kind: Annotated[
        str, typer.Option("--type", help="time-trial, object-avoidance, head-to-bot or head-to-model.")
    ] = "time-trial",
    schedule: Annotated[str, typer.Option("--schedule", help="round-robin or swiss.")] = "round-robin",
    starts: Annotated[int, typer.Option("--starts", help="Different starts on each track.")] = 3,
    rounds: Annotated[int, typer.Option("--rounds", help="Of a Swiss schedule; by default one for every start.")] = 0,
    laps: Annotated[int, typer.Option("--laps", "-l", help="To a race.")] = 1,
    rules: Rules = "drfc",
    time_limit: Annotated[float, typer.Option("--time-limit", help="Seconds on the clock; 0 for none.")] = 180.0,
    objects: race_options.NumObjects = None,
    bots: race_options.NumBots = None,
    bot_speed: race_options.BotSpeed = None,
    lane_changes: race_options.LaneChanges = False,
    parked_cars: race_options.ParkedCars = False,
    placement: race_options.Placement = "",
    positions: race_options.Positions = "",
    vehicle: Vehicle = "v5",
    randomize: Randomize = "none",
    seed: Annotated[int, typer.Option("--seed", "-s", help="Of starts, objects and the order of races.")] = 0,
    as_json: Json = False,
) -> None:
    """Rate models by many races."""
    from racecraft.judging.ladder import rate_models

    found = rate_models(
        models,
        tracks=track or ["reinvent_2018"],
        kind=race_options.kind_of(kind),
        schedule=schedule,
        starts=starts,
        rounds=rounds,
        laps=laps,
        rules=rules,
        changes={"time_limit": time_limit},
        objects=_objects(kind, context.params, is_ladder=True),
        vehicle=vehicle,
        randomize=randomize,
        seed=seed,
        progress=(lambda line: None) if as_json else text().say_progress,
    )
    if as_json:
        print_json(found.to_dict())
    else:
        text().say_rated(found)


@app.command()
def film(
    context: typer.Context,
    replay: Annotated[Path, typer.Argument(help="Replay file, or a run's folder, of which it shows how it learned.")],
    car: Annotated[int, typer.Option("--car", help="Number of the car to follow, from 1; by default the best.")] = 0,
    ghost: race_options.Ghosts = None,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="MP4 file; by default beside the replay, or in the run's mp4.")
    ] = None,
    as_json: Json = False,
) -> None:
    """Make a film of a replay, or of how a run learned.

    The latter takes fifteen seconds: laps from its first to its best.
    """
    if replay.is_dir() and (car or ghost):
        context.fail("--car and --ghost are for a replay file; a run's folder is filmed as it learned.")
    if output is not None and output.suffix.lower() == ".mp4":  # any other is refused before it is written
        make_folder_of(output)
    if replay.is_dir():
        from racecraft.judging.evolution import film_evolution

        path = film_evolution(replay, output)
    else:
        from racecraft.film.replay_film import film_replay

        path = film_replay(replay, output, car=car, ghosts=ghost or ())
    if as_json:
        print_json({"video": str(path)})
    else:
        text().say_filmed(path)


@app.command()
def verify(
    context: typer.Context,
    replay: Annotated[Path | None, typer.Argument(help="Replay file, or a race's folder or race.json.")] = None,
    race: Annotated[
        str,
        typer.Option(
            "--race",
            help="That the replay must be of: its race.json, its folder, its commitment or its address in a league; "
            "without a replay that address alone, and the whole board is checked.",
        ),
    ] = "",
    commitment: Annotated[
        str, typer.Option("--commitment", help="With an address alone: what the race had while it was open.")
    ] = "",
    as_json: Json = False,
) -> None:
    """Drive a replay again and compare every bit.

    Of a race all replays, and that its starts were drawn beforehand and its result is theirs.
    """
    from racecraft.cli import verify_text
    from racecraft.judging.board_verification import is_address, published_at, verify_board

    for option, value in (("race", race), ("commitment", commitment)):
        if is_given(context, option) and not value.strip():  # an empty variable of a shell's: nothing would be compared
            context.fail(f"--{option} is empty; it says which race the replay must be of.")
    if replay is None:
        if not is_address(race):
            context.fail("Give a replay, or the address of a league's race with --race.")
        _tell(verify_board(race, commitment=commitment), verify_text.say_board_verified, as_json=as_json)
        return
    if commitment:
        context.fail("--commitment goes with the address of a race alone; with a replay --race takes it.")
    if replay.is_dir() or replay.suffix == ".json":
        from racecraft.judging.verification import verify_race

        _tell(verify_race(replay, race=race), verify_text.say_race_verified, as_json=as_json)
        return
    from racecraft.judging.verification import published
    from racecraft.replay import read_replay
    from racecraft.replay import verify as drive_again

    of = published_at(race) if is_address(race) else published(race) if race else None
    _tell(drive_again(read_replay(replay), race=of), verify_text.say_verified, as_json=as_json)


class _Verified(Protocol):
    """What one of the ways to verify found."""

    @property
    def is_genuine(self) -> bool: ...

    def to_dict(self) -> dict[str, Any]: ...


_V = TypeVar("_V", bound=_Verified)


def _tell(found: _V, say: Callable[[_V], None], *, as_json: bool) -> None:
    """Print it; what is not genuine is an error."""
    if as_json:
        print_json(found.to_dict())
    else:
        say(found)
    if not found.is_genuine:
        raise typer.Exit(1)


def _objects(kind: str, options: Mapping[str, Any], *, is_ladder: bool = False) -> Objects:
    """Those of the race's type; on a road that models share there are none unless boxes or bots are asked for."""
    from racecraft.contest.ladder import LADDER_KINDS
    from racecraft.contest.terms import RACE_KINDS, TOGETHER

    name = race_options.kind_of(kind)
    race_options.check_race(
        name,
        LADDER_KINDS if is_ladder else RACE_KINDS,
        hint="Two models on one road are --type head-to-model; head-to-head is how one trains for it.",
        what="Race type of a ladder" if is_ladder else "Race type",
    )
    if name in TOGETHER:
        asked = {"object-avoidance": options["objects"], "head-to-bot": options["bots"]}
        name = next((race for race, count in asked.items() if count is not None), "time-trial")
    return race_options.objects_of(name, options, option="--type")
