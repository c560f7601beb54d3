"""Cars that are driven to be looked at: by a learned policy, or by any function from a car's state to a command."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

import gymnasium
import numpy as np
from numpy.typing import NDArray

from racecraft.classic import Learned
from racecraft.classic.job import view_of
from racecraft.env.task import DrivingTask
from racecraft.sim.columns import STATUS_NAMES
from racecraft.track import Track

Driver = Callable[[NDArray[np.float32]], NDArray[Any]]
"""From states (N, 16) to steering angles in rad and speeds in m/s (N, 2)."""
STEPS_PER_SECOND: Final = 15


@dataclass(frozen=True, kw_only=True)
class Drives:
    """What N cars did in one episode each; NaN after its end."""

    track: Track
    x: NDArray[np.float64]
    """m (T, N)."""
    y: NDArray[np.float64]
    """m (T, N)."""
    heading: NDArray[np.float64]
    """rad, counter-clockwise from the x axis (T, N)."""
    speed: NDArray[np.float64]
    """m/s, really driven (T, N)."""
    steering: NDArray[np.float64]
    """Degrees, commanded, left positive (T, N)."""
    offset: NDArray[np.float64]
    """m to the left of the centre line (T, N)."""
    progress: NDArray[np.float64]
    """Share of the lap since the start (T, N)."""
    rewards: NDArray[np.float64]
    """(T, N)."""
    endings: tuple[str, ...]
    """How each episode ended, such as ``lap_complete``; ``in_progress`` where time was up (N,)."""

    @property
    def laps(self) -> int:
        """Cars that completed theirs."""
        return self.endings.count("lap_complete")

    @property
    def lap_seconds(self) -> float:
        """Mean time of completed laps; NaN where there is none."""
        steps = np.isfinite(self.x).sum(axis=0)[np.array([end == "lap_complete" for end in self.endings])]
        return float(steps.mean() / STEPS_PER_SECOND) if len(steps) else float("nan")


def drive(
    driver: Driver | Learned,
    track: str | Track | None = None,
    *,
    cars: int = 12,
    seconds: float = 30.0,
    seed: int = 0,
    is_turned: bool = False,
    **settings: Any,
) -> Drives:
    """Let cars drive one lap each, from places all around the track.

    Args:
        driver: What `racecraft.classic.learn` returned for a car, or a function from states to commands.
        track: Where; by default where it learned, or the oval.
        cars: N.
        seconds: After which a lap is given up.
        seed: Of the places.
        is_turned: Put the cars down facing against the direction of the track.
        settings: Of `racecraft.env.RacecraftEnv`, such as ``reward``.
    """
    settings = {"start": "random", "max_episode_steps": round(STEPS_PER_SECOND * seconds), **settings}
    commands: Any = driver
    if isinstance(driver, Learned):
        made = dict(driver.lesson.make)
        own = made.pop("track", None)
        track = track or own
        settings = {**made, **settings}
    settings.pop("observation", None)
    task = DrivingTask(track or "oval", num_envs=cars, num_threads=1, observation="state", **settings)
    if isinstance(driver, Learned):
        commands = _commands_of(driver, task)
    simulation = task.simulation
    everyone = np.ones(cars, np.bool_)
    task.reset(everyone, seeds=np.uint64(seed) + np.arange(cars, dtype=np.uint64))
    if is_turned:
        for car in range(cars):
            x, y, heading = (float(simulation.column(name)[car]) for name in ("x", "y", "heading"))
            simulation.set_pose(car, x, y, heading + np.pi)
    names = ("x", "y", "heading", "actual_speed", "steering_angle", "offset", "progress")
    rows: list[NDArray[np.float64]] = []
    over, endings = np.zeros(cars, np.bool_), ["in_progress"] * cars
    while not over.all():
        rewards = task.drive(np.asarray(commands(task.observer.batch(copy=True)), np.float32))
        row = np.stack([*(simulation.column(name) for name in names), rewards])
        row[:, over] = np.nan
        rows.append(row)
        statuses = simulation.column("status")
        for car in np.flatnonzero((simulation.terminated | simulation.truncated) & ~over).tolist():
            status = STATUS_NAMES[int(statuses[car])]
            endings[car] = status if simulation.terminated[car] else "in_progress"
        over = over | simulation.terminated | simulation.truncated
    task.close()
    x, y, heading, speed, steering, offset, progress, paid = np.stack(rows, axis=1)
    return Drives(
        track=simulation.tracks[0], x=x, y=y, heading=heading, speed=speed, steering=np.degrees(steering),
        offset=offset, progress=progress, rewards=paid, endings=tuple(endings),
    )  # fmt: skip


def _commands_of(learned: Learned, task: DrivingTask) -> Driver:
    """What was learned, as a function from states to commands."""
    space: gymnasium.Space[Any] = task.observer.space
    view = view_of(learned.lesson)(space)

    def commands(states: NDArray[np.float32]) -> NDArray[Any]:
        return task.action_space.to_commands(learned.policy.act(view(states)))  # type: ignore[arg-type]

    return commands
