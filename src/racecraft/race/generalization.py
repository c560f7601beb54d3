"""`generalize`: how far a policy gets on each of many tracks, in both directions, in one batch of cars.

A trial is one lap from a standing start with nobody to put the car back. What happens in it depends on the policy, the
track, the direction, the trial's number and the seed, not on which other tracks are driven.
"""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from racecraft.agent.sensor_suite import FRONT_CAMERA, SensorSuite
from racecraft.checks import check_choice, check_type, check_whole
from racecraft.errors import ConfigError
from racecraft.race.evaluation import MAX_STEPS, Driver, RememberingDriver, begin_anew, drive_lap, sight_of
from racecraft.race.placement import start_pose
from racecraft.race.rules import RULE_SETS
from racecraft.race.statistics import Interval, wilson_interval
from racecraft.sim.camera import CameraSpec
from racecraft.sim.randomization import Randomization
from racecraft.sim.simulation import Simulation, Start
from racecraft.sim.vehicle import Vehicle
from racecraft.track.track import Track

DIRECTIONS: Final = ("forward", "reverse")
SLOWEST: Final = 0.3
"""m/s; a car that needs longer for its lap is not waited for."""
GROUP: Final = 32
"""Tracks whose grounds are in memory at once, some 9 MB each."""
MAX_TRIALS: Final = 100


@dataclass(frozen=True, kw_only=True)
class TrackResult:
    """What the trials on one track, in one direction, came to."""

    track: str
    direction: str
    length: float
    """m"""
    completions: tuple[float, ...]
    """Fraction of the lap that each trial drove."""
    lap_times: tuple[float, ...]
    """s, of the trials that completed it."""

    @property
    def laps(self) -> int:
        """Trials that completed the lap."""
        return len(self.lap_times)

    @property
    def completion(self) -> float:
        """Mean fraction of the lap."""
        return float(np.mean(self.completions))

    def to_dict(self) -> dict[str, Any]:
        """As JSON."""
        return {
            "track": self.track,
            "direction": self.direction,
            "length_m": round(self.length, 3),
            "trials": len(self.completions),
            "laps": self.laps,
            "completion": self.completion,
            "best_lap_s": min(self.lap_times, default=None),
            "mean_lap_s": float(np.mean(self.lap_times)) if self.lap_times else None,
        }


@dataclass(frozen=True, kw_only=True)
class Generalization:
    """How a policy did on many tracks."""

    results: tuple[TrackResult, ...]
    """By track, then direction."""

    @property
    def trials(self) -> int:
        """All laps tried."""
        return sum(len(result.completions) for result in self.results)

    @property
    def laps(self) -> int:
        """Laps completed."""
        return sum(result.laps for result in self.results)

    @property
    def lap_share(self) -> float:
        """Completed laps over laps tried: the figure of merit."""
        return self.laps / self.trials

    @property
    def lap_interval(self) -> Interval:
        """95 % interval of `lap_share`."""
        return wilson_interval(self.laps, self.trials)

    @property
    def completion(self) -> float:
        """Mean fraction of a lap over all trials."""
        return float(np.mean([value for result in self.results for value in result.completions]))

    @property
    def mastered(self) -> tuple[str, ...]:
        """Tracks on which every trial, in every direction, completed its lap."""
        failed = {result.track for result in self.results if result.laps < len(result.completions)}
        return tuple(dict.fromkeys(result.track for result in self.results if result.track not in failed))

    def to_dict(self) -> dict[str, Any]:
        """As JSON."""
        return {
            "tracks": len({result.track for result in self.results}),
            "trials": self.trials,
            "laps": self.laps,
            "lap_share": self.lap_share,
            "lap_interval": list(self.lap_interval),
            "completion": self.completion,
            "tracks_mastered": len(self.mastered),
            "results": [result.to_dict() for result in self.results],
        }


def generalize(
    policy: Driver,
    tracks: Sequence[Track],
    *,
    directions: Sequence[str] = DIRECTIONS,
    num_trials: int = 1,
    seed: int = 0,
    vehicle: Vehicle | str = "v5",
    camera: CameraSpec = CameraSpec(),
    sensors: SensorSuite = FRONT_CAMERA,
    randomize: Randomization | str = "none",
    num_threads: int = 0,
) -> Generalization:
    """Let a policy try one lap on each of many tracks.

    Args:
        policy: What drives: called with what the sensors of the cars that still do tell, frames uint8 (N, 120, 160) of
            the front camera alone; or with the state, where its attribute ``sees`` is ``"state"``.
        tracks: Where; one that is named twice is driven once.
        directions: ``forward``, ``reverse`` or both.
        num_trials: Laps to try on each track in each direction, 1 to 100; the first starts exactly on the line.
        seed: Of the starts and of the randomisation.
        vehicle: Preset name, vehicle file or `Vehicle`.
        camera: What the cars see with.
        sensors: Which camera it is, and the LIDAR.
        randomize: Preset, file or ranges of what differs from trial to trial.
        num_threads: Of the simulation; 0 takes one per core.

    Raises:
        ConfigError: No track, a direction that does not exist, or a setting outside its range.
    """
    check_whole("num_trials", num_trials, 1, MAX_TRIALS, is_plain=True)
    check_whole("seed", seed, 0, 2**64 - 1)
    if isinstance(directions, str):
        directions = [directions]
    check_type("directions", directions, Sequence, f"use a list of {', '.join(DIRECTIONS)}")
    for direction in directions:
        check_choice("direction", direction, DIRECTIONS)
    if not tracks or not directions:
        raise ConfigError("There is no track or no direction to drive.")
    # The same road twice would be the same laps twice, which tell no more and would count as more.
    tracks = list({(track.name, track.digest): track for track in tracks}.values())
    directions = list(dict.fromkeys(directions))
    sees = sight_of(policy)
    sight = {"camera": None} if sees == "state" else sensors.simulation_settings(camera)
    by_length = sorted(range(len(tracks)), key=lambda index: tracks[index].length)  # cars of a group end together
    results: dict[tuple[int, str], TrackResult] = {}
    for begin in range(0, len(by_length), GROUP):
        group = by_length[begin : begin + GROUP]
        roads = [tracks[index] for index in group]
        simulation = Simulation(
            roads,
            num_envs=num_trials * len(roads),
            vehicle=vehicle,
            direction="alternate",
            randomize=randomize,
            num_threads=num_threads,
            max_steps=MAX_STEPS,
            start=Start(mode="fixed"),
            **sight,
        )
        for direction in directions:
            _line_up(simulation, direction, seed=seed)
            patience = np.tile([road.length / SLOWEST for road in roads], num_trials)
            driver = _awake(policy, simulation)
            outcome = drive_lap(driver, simulation, sees=sees, sensors=sensors, max_seconds=patience)
            for course, index in enumerate(group):
                times = outcome.lap_times[course :: len(roads)]
                results[index, direction] = TrackResult(
                    track=tracks[index].name,
                    direction=direction,
                    length=tracks[index].length,
                    completions=tuple(outcome.completions[course :: len(roads)].tolist()),
                    lap_times=tuple(times[np.isfinite(times)].tolist()),
                )
    return Generalization(
        results=tuple(results[index, direction] for index in range(len(tracks)) for direction in directions)
    )


def _line_up(simulation: Simulation, direction: str, *, seed: int) -> None:
    """Every car at its start, under its conditions; both by what it drives, not by its place in the batch."""
    roads, rules = simulation.tracks, RULE_SETS["first_lap"]
    keys = []
    for car in range(simulation.num_envs):
        trial, course = divmod(car, len(roads))
        text = f"{seed}/{roads[course].digest}/{direction}/{trial}"
        keys.append(int.from_bytes(hashlib.sha256(text.encode()).digest()[:8], "little"))
    simulation.reset(seeds=np.array(keys, dtype=np.uint64))
    if direction == "reverse":
        simulation.reset()  # every car's second episode goes the other way
    driven = [road.reversed() if direction == "reverse" else road for road in roads]
    for car in range(len(roads), simulation.num_envs):
        pose = start_pose(driven[car % len(roads)], rules, seed=seed, trial=car // len(roads))
        simulation.set_pose(car, *pose)


def _awake(policy: Driver, simulation: Simulation) -> Driver:
    """A policy that is asked for the cars under way only: most of a group's time a few slow ones are.

    Who remembers begins anew here, and is told which cars they are.
    """
    commands = np.zeros((simulation.num_envs, 2), dtype=np.float32)

    remembering = policy if isinstance(policy, RememberingDriver) else None
    begin_anew(policy)

    def drive(sight: NDArray[Any]) -> NDArray[np.float32]:
        awake = np.flatnonzero(~(simulation.terminated | simulation.truncated))
        seen = sight[awake]
        commands[awake] = policy(seen) if remembering is None else remembering(seen, awake)
        return commands

    return drive
