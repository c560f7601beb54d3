"""What a checkpoint does on a road of its own training, among what it met there: a lap to be looked at.

run folder -> road, car, objects, opponents -> one lap from the line -> Trial
"""

from __future__ import annotations

from typing import Final

from racecraft.contest.contest import race_together
from racecraft.contest.terms import MAX_GRID, shared_road
from racecraft.errors import RacecraftError, RunError
from racecraft.judging.evolution import trained_rules
from racecraft.judging.trained import trained_camera, trained_objects, trained_tracks, trained_vehicle
from racecraft.race import evaluate
from racecraft.race.conditions import Conditions
from racecraft.race.policy import NetworkPolicy, load_driver, load_policy
from racecraft.race.results import Trial
from racecraft.run import RunFolder
from racecraft.run.folder import RunInfo

STARTS: Final = 5
"""Starts of a car that is alone, of which the best is shown."""


def demonstrate(folder: RunFolder, step: int, *, road: int = 0) -> Trial:
    """The lap of a checkpoint; against opponents it begins behind them, else it is the best of a few starts.

    Args:
        folder: The run.
        step: Of the checkpoint.
        road: Number of the track among those of the training, from 0.

    Raises:
        RacecraftError: Its files cannot be read.
    """
    info = folder.read_info()
    track, rules = trained_tracks(info)[road], trained_rules(folder)
    _, policy = load_policy(folder, checkpoint=step, num_threads=1)
    rivals = [_rival(name, policy) for name in _opponents(info)]
    if not rivals:
        return evaluate(
            policy,
            track,
            rules=rules,
            num_trials=STARTS,
            vehicle=trained_vehicle(info),
            camera=trained_camera(info),
            objects=trained_objects(info),
            num_threads=1,
        ).best_trial
    conditions = Conditions(
        track=track,
        rules=rules,
        vehicle=trained_vehicle(info),
        camera=trained_camera(info),
        objects=trained_objects(info),
    )
    return race_together([*rivals, policy], shared_road(conditions, len(rivals) + 1), num_threads=1)[-1]


def _opponents(info: RunInfo) -> list[str]:
    """Who drove each of the other cars of its races: ``self``, or a run folder."""
    raced = info.settings.get("opponents")
    if raced is None:
        return []
    try:
        drivers, cars = [str(name) for name in raced["drivers"]], int(raced["cars"])
        return [drivers[car % len(drivers)] for car in range(min(cars, MAX_GRID) - 1)]
    except (TypeError, KeyError, ValueError, ZeroDivisionError) as error:
        raise RunError(f"The opponents in run.json do not fit this version of Racecraft: {error!r}.") from error


def _rival(name: str, policy: NetworkPolicy) -> NetworkPolicy:
    """Who drove another car of its races; the policy itself where that was so, or where the other is gone."""
    if name == "self":
        return policy
    try:
        return load_driver(name)
    except RacecraftError:
        return policy
