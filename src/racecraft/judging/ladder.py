"""`rate_models`: a ladder of runs, from their paths."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from racecraft.checks import check_whole, require
from racecraft.contest.ladder import Ladder, Match, check_ladder, hold_ladder
from racecraft.race.conditions import STANDARD_CAR, Conditions
from racecraft.race.entry import check_models, load_entries
from racecraft.race.results import Trial
from racecraft.race.rules import RaceRules, race_rules
from racecraft.sim.objects import NO_OBJECTS, Objects
from racecraft.sim.randomization import Randomization, load_randomization
from racecraft.sim.vehicle import Vehicle, load_vehicle
from racecraft.track import load_tracks


def rate_models(
    models: Sequence[str | Path],
    *,
    tracks: str | Sequence[str],
    kind: str = "time-trial",
    schedule: str = "round-robin",
    starts: int = 3,
    rounds: int = 0,
    laps: int = 1,
    rules: str | RaceRules = "drfc",
    objects: Objects = NO_OBJECTS,
    vehicle: str | Vehicle = STANDARD_CAR,
    randomize: Randomization | str = "none",
    changes: dict[str, Any] | None = None,
    seed: int = 0,
    progress: Callable[[str], None] = lambda text: None,
    watch: Callable[[Match, Sequence[Trial]], None] = lambda match, trials: None,
    num_threads: int = 0,
) -> Ladder:
    """Rate models by their races against each other.

    Args:
        models: Run folders, ``RUN`` or ``RUN@CHECKPOINT``.
        tracks: Names, files or selections of tracks, as `load_tracks` takes them.
        kind: Of race.
        schedule: ``round-robin`` or ``swiss``.
        starts: On each track.
        rounds: Of a Swiss schedule.
        laps: To a race.
        rules: A name of `RULE_SETS`, or rules.
        objects: On the track.
        vehicle: What everybody drives, whatever they were trained with.
        randomize: What differs from what the models know; the same for all.
        changes: Single rules that differ, by name.
        seed: Of the starts and of the order of matches.
        progress: Is told what is being driven.
        watch: Sees every match as it is decided, with what its two models did.
        num_threads: 0 takes one per core.

    Raises:
        RacecraftError: A model, a track or a setting is not usable, or OpenSkill is not installed.
    """
    check_models(models)
    check_whole("seed", seed, 0, 2**64 - 1)
    require("progress", progress, callable(progress), "a function that takes a text")
    require("changes", changes, changes is None or isinstance(changes, dict), "a dict of rules by name")
    check_ladder(len(models), kind=kind, schedule=schedule, starts=starts, rounds=rounds)
    entries = load_entries(models, num_threads=num_threads)
    given = {name: value for name, value in (changes or {}).items() if value is not None}
    courses = [
        Conditions(
            track=track,
            rules=race_rules(rules, {**given, "laps": laps}),
            seed=seed,
            vehicle=vehicle if isinstance(vehicle, Vehicle) else load_vehicle(vehicle),
            objects=objects,
            randomize=randomize if isinstance(randomize, Randomization) else load_randomization(randomize),
        )
        for track in load_tracks(tracks)
    ]
    return hold_ladder(
        entries,
        courses,
        kind=kind,
        schedule=schedule,
        starts=starts,
        rounds=rounds,
        seed=int(seed),
        progress=progress,
        watch=watch,
        num_threads=num_threads,
    )
