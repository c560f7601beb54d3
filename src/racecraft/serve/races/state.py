"""What a race's row says of it: what was announced, and what it is now."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from racecraft.race.announcement import Announcement
from racecraft.serve.conditions import AskedRanges, AskedVehicle, told_randomization, told_vehicle
from racecraft.serve.store.tables import Race, now
from racecraft.sim.randomization import Randomization
from racecraft.sim.vehicle import Vehicle, load_vehicle

if TYPE_CHECKING:  # jobs do without messages
    from racecraft.serve.races.schemas import RaceState

OWN: Final = "own"
"""What a row says of a car that is no preset; its numbers are in the document."""


def announcement_of(race: Race) -> Announcement:
    """A race as it was made, with its secret."""
    return Announcement(document=race.document, commitment=race.commitment, secret=race.secret)


def car_of(race: Race) -> Vehicle:
    """What everybody drives in a race.

    Raises:
        ConfigError: Each drives its own, as in an old race.
    """
    return Vehicle(**race.document["vehicle"]) if race.document else load_vehicle(race.vehicle)


def told_car(race: Race) -> AskedVehicle:
    """The same as it is asked for; empty of an old race."""
    return told_vehicle(car_of(race)) if race.document else race.vehicle


def ranges_of(race: Race) -> Randomization:
    """What is otherwise than the models know."""
    return Randomization(**race.document["randomize"]) if race.document else Randomization()


def told_ranges(race: Race) -> AskedRanges:
    """The same as it is asked for."""
    return told_randomization(ranges_of(race)) if race.document else "none"


def is_withheld(race: Race) -> bool:
    """Whether nobody may see yet where it starts."""
    return bool(race.secret) and state_of(race) != "closed"


def state_of(race: Race) -> RaceState:
    """Whether a race can be entered now."""
    moment = now()
    if not race.commitment:
        return "closed"  # nobody can enter what was driven under the old rules
    if race.over is not None:
        return "closed"  # where it starts is no secret any more, whatever the clock says now
    if moment < race.opens:
        return "upcoming"
    return "closed" if race.closes is not None and moment >= race.closes else "open"
