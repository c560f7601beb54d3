"""What stands or drives on the track: the options that `train`, `evaluate` and `race` share."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import typer

from racecraft.errors import ConfigError

if TYPE_CHECKING:
    from racecraft.sim import Objects

Race = Annotated[str, typer.Option("--race", help="time-trial, object-avoidance or head-to-bot.")]
NumObjects = Annotated[int, typer.Option("--objects", help="Obstacles of object avoidance; 6 by default.")]
NumBots = Annotated[int, typer.Option("--bots", help="Bot cars of head-to-bot; 3 by default.")]
BotSpeed = Annotated[float | None, typer.Option("--bot-speed", help="m/s of the bot cars; 0.2 by default.")]
LaneChanges = Annotated[bool, typer.Option("--lane-changes", help="Bot cars change lanes every 3 to 5 s.")]
ParkedCars = Annotated[bool, typer.Option("--parked-cars", help="Obstacles are parked cars, not boxes.")]
Placement = Annotated[str, typer.Option("--placement", help="Of objects: random (each episode anew), even or fixed.")]
Ghosts = Annotated[
    list[str] | None,
    typer.Option("--ghost", help="Ghost in the video: a replay file, RUN[@STEP], @STEP or best-lap; repeatable."),
]
Positions = Annotated[str, typer.Option("--positions", help="Fixed places, lap and lane of each: '0.23,-1;0.46,1'.")]


def objects_of(
    race: str,
    *,
    objects: int = 0,
    bots: int = 0,
    bot_speed: float | None = None,
    lane_changes: bool = False,
    parked_cars: bool = False,
    placement: str = "",
    positions: str = "",
    option: str = "--race",
) -> Objects:
    """The objects that the options ask for; `option` is the one that names the race.

    Raises:
        ConfigError: An option does not go with the race, or has no meaning.
    """
    from racecraft.sim.objects import objects_for_race, parse_positions

    name = race.lower().replace("_", "-") or "time-trial"
    for name_given, is_given, needed in (
        ("--objects", objects != 0, "object-avoidance"),
        ("--parked-cars", parked_cars, "object-avoidance"),
        ("--bots", bots != 0, "head-to-bot"),
        ("--bot-speed", bot_speed is not None, "head-to-bot"),
        ("--lane-changes", lane_changes, "head-to-bot"),
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
    if objects or bots:
        settings["count"] = objects or bots
    if bot_speed is not None:
        settings["speed"] = bot_speed
    if lane_changes:
        settings["changes_lane"] = True
    if parked_cars:
        settings["kind"] = "car"
    return objects_for_race(name, settings=settings)
