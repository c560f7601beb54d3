"""What a race is held under: all that a re-simulation needs besides the actions."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from racecraft.checks import check_type, check_whole, make_plain
from racecraft.race.rules import RaceRules
from racecraft.sim.camera import CameraSpec
from racecraft.sim.objects import NO_OBJECTS, Objects
from racecraft.sim.randomization import PRESETS, Randomization
from racecraft.sim.vehicle import PRESETS as VEHICLES
from racecraft.sim.vehicle import Vehicle
from racecraft.track.track import Track

STANDARD_CAR: Final = "v5"
"""The vehicle of a race that names no other; never an entrant's own."""


@dataclass(frozen=True, kw_only=True)
class Conditions:
    """Where, by which rules, with which car and among what; the same for every car of a race."""

    track: Track
    """As handed in; with direction ``reverse`` it is driven the other way."""
    rules: RaceRules
    """Laps, resets, penalties, starts."""
    seed: int = 0
    """Of the starts, of what stands on the track and of the randomisation."""
    vehicle: Vehicle = VEHICLES[STANDARD_CAR]
    """What is driven."""
    camera: CameraSpec | None = None
    """What the rules take the driver's camera for (`object_in_camera`); None where no car has one."""
    objects: Objects = NO_OBJECTS
    """On the track, around every car of its own."""
    randomize: Randomization = PRESETS["none"]
    """What differs from car to car."""
    cars_per_race: int = 1
    """Cars that share a road; with one, each has the road for itself."""

    def __post_init__(self) -> None:
        check_type("track", self.track, Track, "get one with load_track(name or path)")
        check_type("rules", self.rules, RaceRules, "use racecraft.RaceRules(...)")
        check_whole("seed", self.seed, 0, 2**64 - 1)
        check_type("objects", self.objects, Objects, "use racecraft.sim.Objects(...)")
        make_plain(self)  # the seed is kept in files

    @property
    def num_objects(self) -> int:
        """Around every car: boxes, bots and the other cars of its race."""
        return self.objects.count + self.cars_per_race - 1
