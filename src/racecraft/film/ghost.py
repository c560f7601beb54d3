"""Ghosts: cars in a video that were not there, to be compared with the one that was.

recording of an earlier checkpoint, of the best lap, of another model -> *ghost* -> translucent car at the same time
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from racecraft.race.recording import Recording
from racecraft.sim.simulation import CONTROL_DT
from racecraft.sim.views import RACER_COLORS, CarView
from racecraft.track.canvas import Color

MAX_GHOSTS: Final = 16
"""In one film."""
GHOST_ALPHA: Final = 0.5
"""How solid a ghost is."""
LINGERING: Final = 1.0
"""s that a ghost stays where it stopped."""
LIVERY: Final[tuple[Color, ...]] = RACER_COLORS
"""Colours of the cars of a race and of ghosts, in order; the first is the car that is filmed."""


@dataclass(frozen=True, eq=False)
class Ghost:
    """A car's way through time."""

    name: str
    """Shown beside its colour."""
    color: Color
    """Of its body."""
    poses: NDArray[np.float64]
    """x [m], y [m] and heading [rad] of its origin  (T, 3)."""
    steering: NDArray[np.float64]
    """rad, of the front wheels  (T,)."""
    clock: NDArray[np.float64]
    """s since it started  (T,)."""
    is_lap: bool = False
    """Whether it starts anew with every lap of the car it accompanies, instead of once, with the race."""

    def at(self, seconds: float) -> CarView | None:
        """Where it is so many seconds after its start; None once it has stopped for a while."""
        if seconds > self.clock[-1] + LINGERING:
            return None
        # half a step of slack: both clocks count steps of 1/15 s
        step = max(int(np.searchsorted(self.clock, seconds + 0.5 * CONTROL_DT, side="right")) - 1, 0)
        x, y, heading = self.poses[step].tolist()
        return CarView(x, y, heading, float(self.steering[step]), self.color, GHOST_ALPHA)

    def beside(self, recording: Recording) -> list[CarView | None]:
        """Where it is in every step of the car that it accompanies; None for steps in which it is not there  (T,)."""
        clock = recording.lap_clock if self.is_lap else recording.clock
        return [self.at(seconds) for seconds in clock.tolist()]


@dataclass(frozen=True, eq=False)
class Rival:
    """Another car of the race, on the same road: already in the picture, but not in the table and on the map."""

    name: str
    color: Color
    recording: Recording
    """Its own."""


def ghost_of(recording: Recording, *, name: str, color: Color) -> Ghost:
    """The ghost of a whole trial, which starts with the race."""
    steering = recording.column("actual_steering_angle")
    return Ghost(name, color, recording.poses, steering, recording.clock)


def best_lap_ghost(recordings: Sequence[Recording], *, color: Color, name: str = "best lap") -> Ghost | None:
    """The ghost of the fastest lap in some recordings, which starts with every lap; None without a completed lap."""
    laps = [(time, index, number) for index, one in enumerate(recordings) for number, time in one.lap_times.items()]
    if not laps:
        return None
    time, index, number = min(laps)
    lap = recordings[index].lap(number)
    clock = lap.clock - lap.clock[0] + CONTROL_DT
    return Ghost(f"{name} {time:.2f} s", color, lap.poses, lap.column("actual_steering_angle"), clock, is_lap=True)
