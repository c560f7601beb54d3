"""What browser and server tell each other while somebody drives: SI units, poses in whole mm and mrad."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from racecraft.serve.models.schemas import MedalTimes
from racecraft.serve.schemas import Message
from racecraft.serve.tracks.schemas import TrackGeometry, TrackSketch

Vehicles = Literal["v4", "v5", "v6"]
Directions = Literal["forward", "reverse"]


class NewDrive(Message):
    """Sit down in a car: on a track by its name, or on one that is being drawn."""

    track: str | None = Field(None, max_length=200)
    sketch: TrackSketch | None = None
    vehicle: Vehicles = "v5"
    direction: Directions = "forward"


class Drive(Message):
    """A car of one's own."""

    id: str
    geometry: TrackGeometry
    direction: Directions
    start: list[int]
    """Where the car stands: x, y, heading, speed, steering, share of the lap."""
    best: float | None
    """One's fastest lap here with this vehicle, s."""
    medals: MedalTimes | None
    """For laps here this way round in this vehicle, where they are known."""


class Controls(Message):
    """What the driver asks for, for some steps of 1/15 s."""

    steering: float = Field(ge=-1.0, le=1.0, allow_inf_nan=False)
    """rad, left positive; the car turns its wheels by at most 30 degrees."""
    speed: float = Field(ge=0.0, le=4.0, allow_inf_nan=False)
    """m/s; 0 asks it to stop."""
    steps: int = Field(1, ge=1, le=15)


class DrivenLap(Message):
    """A completed lap."""

    number: int
    seconds: float
    mistakes: int
    is_best: bool
    """Faster than all before, of this day or another."""


class DriveState(Message):
    """Where the car is."""

    pose: list[int]
    clock: float
    """s of the present lap."""
    lap: int
    standing: float
    """s left of a penalty."""
    mistake: str
    """What the last step's mistake was: off_track, reversed, or nothing."""
    mistakes: int
    """In this lap."""
    finished: DrivenLap | None
    """The lap that these steps completed."""


class GhostCard(Message):
    """A lap to drive against."""

    key: str
    """``you``, or ``model:NAME``."""
    name: str
    seconds: float
    direction: Directions
    """Which way round it was driven."""
    vehicle: Vehicles | None
    """What it was driven in; none of a car of its own."""


class Ghost(GhostCard):
    """The same, with where it was at every step of 1/15 s: x, y, heading."""

    trace: list[list[int]]
