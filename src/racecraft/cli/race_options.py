"""Options that verbs share: what stands or drives on the track, penalties, ghosts."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Annotated, Any, Final

import typer

from racecraft.errors import ConfigError

if TYPE_CHECKING:
    from racecraft.sim import Objects
    from racecraft.training import Opponents

Race = Annotated[str, typer.Option("--race", help="time-trial, object-avoidance or head-to-bot.")]
TrainRace = Annotated[str, typer.Option("--race", help="time-trial, object-avoidance, head-to-bot or head-to-head.")]
Rivals = Annotated[
    list[str],
    typer.Option("--opponents", help="Of head-to-head: self, bots or a run folder; several runs by repeating it."),
]
Cars = Annotated[
    int | None,
    typer.Option("--cars", help="To a head-to-head race, the learner's included; 2 by default.", show_default=False),
]
NumObjects = Annotated[
    int | None, typer.Option("--objects", help="Obstacles of object avoidance; 6 by default.", show_default=False)
]
NumBots = Annotated[
    int | None, typer.Option("--bots", help="Bot cars of head-to-bot; 3 by default.", show_default=False)
]
BotSpeed = Annotated[
    float | None, typer.Option("--bot-speed", help="m/s of the bot cars; 0.2 by default.", show_default=False)
]
LaneChanges = Annotated[bool, typer.Option("--lane-changes", help="Bot cars change lanes every 3 to 5 s.")]
ParkedCars = Annotated[bool, typer.Option("--parked-cars", help="Obstacles are parked cars, not boxes.")]
Placement = Annotated[str, typer.Option("--placement", help="Of objects: random (each episode anew), even or fixed.")]
OfftrackPenalty = Annotated[float | None, typer.Option("--offtrack-penalty", help="Seconds; by default the rules'.")]
CollisionPenalty = Annotated[float | None, typer.Option("--collision-penalty", help="Seconds; by default the rules'.")]
Ghosts = Annotated[
    list[str] | None,
    typer.Option("--ghost", help="Ghost in the video: a replay file, RUN[@STEP], @STEP or best-lap; repeatable."),
]
Positions = Annotated[str, typer.Option("--positions", help="Fixed places, lap and lane of each: '0.23,-1;0.46,1'.")]


_OF_MODELS: Final = ("head-to-head", "head-to-model", "grid")
"""Of models against each other: how one trains for it, and what it is called where it is held."""


def kind_of(race: str) -> str:
    """Our spelling of a race's type; AWS's is understood, too."""
    return race.lower().replace("_", "-")


def check_race(name: str, allowed: Iterable[str], *, hint: str, what: str = "Race type") -> None:
    """Refuse a race that there is not; `hint` leads from a name of a race of models, which verbs call differently.

    Raises:
        ConfigError: Says what is allowed.
    """
    from racecraft.checks import check_choice

    try:
        check_choice(what, name, allowed)
    except ConfigError as error:
        raise ConfigError(str(error), hint=hint if name in _OF_MODELS else error.hint) from None


def objects_of(race: str, options: Mapping[str, Any], *, option: str = "--race") -> Objects:
    """The objects that a verb's options (its `context.params`) ask for; `option` is the one that names the race.

    Raises:
        ConfigError: An option does not go with the race, or has no meaning.
    """
    from racecraft.sim.objects import RACE_TYPES, objects_for_race, parse_positions

    name = kind_of(race) or "time-trial"
    check_race(name, RACE_TYPES, hint="racecraft race RUN OTHER --type head-to-model has models race each other.")
    placement, positions = options["placement"], options["positions"]
    count = options["bots"] if options["objects"] is None else options["objects"]
    for name_given, is_given, needed in (
        ("--objects", options["objects"] is not None, "object-avoidance"),
        ("--parked-cars", options["parked_cars"], "object-avoidance"),
        ("--bots", options["bots"] is not None, "head-to-bot"),
        ("--bot-speed", options["bot_speed"] is not None, "head-to-bot"),
        ("--lane-changes", options["lane_changes"], "head-to-bot"),
    ):
        if is_given and name != needed:
            raise ConfigError(f"{name_given} goes with {option} {needed}; the race is {name}.")
    if name == "time-trial" and (placement or positions):
        raise ConfigError("--placement and --positions say where objects are; a time trial has none.")
    settings: dict[str, Any] = {}
    if name != "time-trial":
        settings["placement"] = placement or ("fixed" if positions else "random")
    if positions:
        try:
            settings["positions"] = parse_positions(positions)
        except ValueError as error:
            raise ConfigError(f"--positions is {positions!r}; {error}.") from error
        settings["count"] = len(settings["positions"])
    if count is not None:
        settings["count"] = count
    if options["bot_speed"] is not None:
        settings["speed"] = options["bot_speed"]
    if options["lane_changes"]:
        settings["changes_lane"] = True
    if options["parked_cars"]:
        settings["kind"] = "car"
    return objects_for_race(name, settings=settings)


def opponents_of(race: str, *, opponents: list[str], cars: int | None = None) -> tuple[str, Opponents | None]:
    """The race as far as its objects go, and the other cars of a head-to-head race.

    Raises:
        ConfigError: There is no such race, or an option does not go with it, or has no meaning.
    """
    from racecraft.sim.objects import RACE_TYPES

    name = kind_of(race)
    check_race(name, (*RACE_TYPES, "head-to-head"), hint="Train for it with --race head-to-head.")
    for option, is_given in (("--opponents", bool(opponents)), ("--cars", cars is not None)):
        if is_given and name != "head-to-head":
            raise ConfigError(f"{option} goes with --race head-to-head; the race is {name}.")
    if name != "head-to-head":
        return race, None
    if opponents == ["bots"]:
        if cars is not None:
            raise ConfigError("--cars counts the cars that policies drive; bots are counted by --bots.")
        return "head-to-bot", None
    from racecraft.training.opponents import Opponents

    given: dict[str, Any] = {} if cars is None else {"cars": cars}
    return "time-trial", Opponents(drivers=tuple(opponents) or ("self",), **given)
