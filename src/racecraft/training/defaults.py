"""What a training does where nothing else is said: against the clock, among boxes and bots, against other models."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from racecraft.sim.objects import Objects
from racecraft.training.opponents import Opponents


@dataclass(frozen=True)
class Defaults:
    """The choices a user need not make."""

    reward: str
    """Preset of the reward."""
    actions: str
    """Preset of the action space."""
    until: str
    """When to stop."""
    sensors: tuple[str, ...]
    """AWS's names of what the policy sees through."""


TIME_TRIAL: Final = Defaults("racing", "default", "5 laps", ("FRONT_FACING_CAMERA",))
RACE: Final = Defaults("dodge", "steady", "20 laps or 5 minutes", ("FRONT_FACING_CAMERA", "LIDAR"))
"""Among objects: 1 m/s, a reward that knows what is ahead, and a LIDAR, which sees what is beside the car."""

DUEL: Final = Defaults("duel", "continuous", "10 minutes", ("FRONT_FACING_CAMERA", "LIDAR"))
"""Against other models: pace, with dearer mistakes; time to find it; a LIDAR that sees who is beside."""


def defaults_for(objects: Objects, opponents: Opponents | None = None) -> Defaults:
    """The choices for a training with these objects on its track, and these drivers of other cars."""
    if objects.count:
        return RACE
    return TIME_TRIAL if opponents is None else DUEL
