"""What stands or drives on a road: the settings that every request for a training or a race has alike.

request -> *road_objects* -> Objects -> simulation
"""

from __future__ import annotations

from typing import Annotated, Any, Final, Literal

from pydantic import Field

from racecraft.errors import ConfigError
from racecraft.serve.schemas import Message
from racecraft.sim.objects import MAX_OBJECTS, Objects, objects_for_race

Lane = Literal[1, -1]
Placement = Literal["even", "random", "fixed"]
Place = tuple[Annotated[float, Field(ge=0.0, le=1.0, allow_inf_nan=False)], Lane]
"""Fraction of a lap in driving direction, and lane: 1 inner, -1 outer."""
Seconds = Annotated[float, Field(ge=0.0, le=600.0, allow_inf_nan=False)]
"""That a mistake costs."""

_NEEDS: Final = (
    ("parked_cars", "object-avoidance"),
    ("bot_speed", "head-to-bot"),
    ("lane_changes", "head-to-bot"),
)


class OnRoad(Message):
    """How boxes, parked cars or bot cars are, where a race has them; how many is each request's own."""

    bot_speed: float | None = Field(None, ge=0.0, le=4.0, allow_inf_nan=False)
    """m/s of bot cars; 0.2 otherwise."""
    lane_changes: bool = False
    """Bot cars change lanes every 3 to 5 s."""
    parked_cars: bool = False
    """Obstacles are parked cars, not boxes."""
    placement: Placement | None = None
    """Along the lap in alternating lanes; with every episode anew; or where `positions` say."""
    positions: list[Place] = Field(default_factory=list, max_length=MAX_OBJECTS)
    """Fixed places, one for each: with them their number is how many there are."""


def road_objects(asked: OnRoad, race: str, *, count: int | None, placement: str = "even") -> Objects:
    """The objects that a request asks for.

    Args:
        asked: How they are.
        race: ``time-trial``, where there are none, ``object-avoidance`` or ``head-to-bot``.
        count: How many; by default as many as the race has. Fixed positions count themselves.
        placement: Where they are unless the request says.

    Raises:
        ConfigError: A setting does not go with the race, or two do not go together.
    """
    for name, needed in _NEEDS:
        if getattr(asked, name) not in (None, False) and race != needed:
            raise ConfigError(f"{name} goes with the race {needed}; this one is a {race}.")
    if race == "time-trial":
        if asked.placement is not None or asked.positions:
            raise ConfigError("placement and positions say where objects are; a time-trial has none.")
        return objects_for_race(race)
    if asked.positions and asked.placement not in (None, "fixed"):
        raise ConfigError(f"positions go with the placement fixed; this one is {asked.placement}.")
    settings: dict[str, Any] = {
        "placement": "fixed" if asked.positions else asked.placement or placement,
        "positions": tuple(asked.positions),
        "count": len(asked.positions) or count,
        "speed": asked.bot_speed,
        "changes_lane": asked.lane_changes or None,
        "kind": "car" if asked.parked_cars else None,
    }
    return objects_for_race(race, settings={name: value for name, value in settings.items() if value is not None})
