"""`race_models`: hold a race between runs and write everything about it.

races/<time>/race.json                  results, rules, files
             <entry>.replay             every step, to be shown and driven again (race.replay where all share a road)
             <entry>.mp4                filmed, with the others as ghosts where they were not there
             <entry>/0-iteration.csv    sim-trace                  (AWS)
             <entry>/metrics.json       every lap                  (AWS)
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from racecraft.checks import check_path, require
from racecraft.contest.contest import Contest, hold_race
from racecraft.contest.terms import race_terms
from racecraft.errors import RunError
from racecraft.film.ghost import LIVERY, Ghost, Rival, ghost_of
from racecraft.film.ghost_source import check_sources, load_ghosts
from racecraft.film.video import film
from racecraft.race.announcement import Announcement
from racecraft.race.artifacts import write_metrics, write_simtrace
from racecraft.race.conditions import STANDARD_CAR, Conditions
from racecraft.race.entry import Entry, check_models, load_entries
from racecraft.race.results import Evaluation
from racecraft.race.rules import RaceRules, race_rules
from racecraft.replay.replay import SUFFIX, write_replay
from racecraft.run.atomic import write_json
from racecraft.run.folder import dated_folder, sanitize_name
from racecraft.sim.objects import NO_OBJECTS, Objects
from racecraft.sim.randomization import Randomization, load_randomization
from racecraft.sim.vehicle import Vehicle, load_vehicle
from racecraft.track import Track, load_track

RESULTS: Final = "race.json"
FORMAT: Final = 2
"""Of race.json; the first one has no such number: one trial from the line, in the car of the first model's run.json."""
FILMED: Final = 180.0
"""s of each entry's race that are filmed."""


@dataclass(frozen=True, kw_only=True)
class RunRace:
    """A race that was held, and where it is written."""

    contest: Contest
    """Results."""
    folder: Path
    """Of the race."""
    files: dict[str, Path]
    """What was written, by what it is."""

    def to_dict(self) -> dict[str, Any]:
        """As JSON."""
        files = {name: str(path) for name, path in self.files.items()}
        return {**self.contest.to_dict(), "folder": str(self.folder), "files": files}


def race_models(
    models: Sequence[str | Path],
    *,
    track: str | Track,
    kind: str = "time-trial",
    laps: int | None = None,
    rules: str | RaceRules = "drfc",
    ranking: str = "total",
    minimum_laps: int | None = None,
    num_trials: int | None = None,
    objects: Objects = NO_OBJECTS,
    vehicle: str | Vehicle = STANDARD_CAR,
    randomize: Randomization | str = "none",
    seed: int = 0,
    secret: bytes | None = None,
    announce: Callable[[Announcement], None] = lambda announcement: None,
    changes: dict[str, Any] | None = None,
    video: bool = True,
    ghosts: Sequence[str] = (),
    root: str | Path = "races",
    num_threads: int = 0,
) -> RunRace:
    """Race models against each other.

    Args:
        models: Run folders, ``RUN`` or ``RUN@CHECKPOINT``, in the order of the grid.
        track: Where.
        kind: Of `RACE_KINDS`.
        laps: By default the rules'.
        rules: A name of `RULE_SETS`, or rules.
        ranking: ``total``, ``best`` or ``average``.
        minimum_laps: Laps that a trial must have for a score.
        num_trials: Of each model that drives alone, from as many places of the lap; by default 5.
        objects: On the track.
        vehicle: What everybody drives, whatever they were trained with.
        randomize: What differs from what the models know; the same for all.
        seed: Of the starts and of what stands on the track, known to everybody.
        secret: 32 bytes that both are drawn from instead.
        announce: Is told what the race is held by, before anybody drives.
        changes: Single rules that differ, by name.
        video: Whether to film every entry.
        ghosts: More ghosts for the films, as for `load_ghosts`.
        root: Folder of all races.
        num_threads: 0 takes one per core.

    Raises:
        RacecraftError: A model, the track or a setting is not usable, or nothing can be written.
    """
    check_models(models)
    require("announce", announce, callable(announce), "a function that takes an announcement")
    require("changes", changes, changes is None or isinstance(changes, dict), "a dict of rules by name")
    check_path("root", root, "use a folder's path")
    given = {"laps": laps, **(changes or {})}
    conditions = Conditions(
        track=track if isinstance(track, Track) else load_track(track),
        rules=race_rules(rules, {name: value for name, value in given.items() if value is not None}),
        seed=seed,
        vehicle=vehicle if isinstance(vehicle, Vehicle) else load_vehicle(vehicle),
        objects=objects,
        randomize=randomize if isinstance(randomize, Randomization) else load_randomization(randomize),
    )
    terms = race_terms(
        conditions,
        kind=kind,
        num_cars=len(models),
        ranking=ranking,
        minimum_laps=minimum_laps,
        num_trials=num_trials,
        secret=secret,
    )
    entries = load_entries(models, num_threads=num_threads)
    check_sources(ghosts, conditions.track, conditions.rules, run=None)
    announce(terms.announcement)
    contest = hold_race(entries, terms, num_threads=num_threads)
    trial, colors = contest.shown_trial, LIVERY[len(entries) % len(LIVERY) :]
    recordings = [trials[trial].recording for trials in contest.trials]
    shown = load_ghosts(ghosts, terms.conditions, trial=trial, recordings=recordings, colors=colors) if video else []
    try:
        folder = dated_folder(Path(root))[1]
        files = _write(contest, entries, folder, ghosts=shown, is_filmed=video)
    except OSError as error:
        raise RunError(f"{error.filename or root} cannot be written: {error.strerror or error}.") from error
    return RunRace(contest=contest, folder=folder, files=files)


def _write(
    contest: Contest, entries: Sequence[Entry], folder: Path, *, ghosts: Sequence[Ghost], is_filmed: bool
) -> dict[str, Path]:
    safe, shown = _file_names(contest.names), contest.shown_trial
    files = {}
    for name, replay in contest.replays():
        path = folder / f"{safe.get(name, name)}{SUFFIX}"
        files[f"replay of {name}" if name in safe else "replay"] = write_replay(replay, path)
    for index, (entry, trials) in enumerate(zip(entries, contest.trials, strict=True)):
        inside = folder / safe[entry.name]
        inside.mkdir()
        alone = Evaluation(conditions=contest.conditions, trials=trials)
        write_metrics(alone, inside / "metrics.json")
        write_simtrace(alone, inside, action_space=entry.policy.action_space)
        files[f"sim-trace of {entry.name}"] = inside / "0-iteration.csv"
        if is_filmed:
            files[f"video of {entry.name}"] = film(
                trials[shown].recording.until(FILMED),
                folder / f"{safe[entry.name]}.mp4",
                name=entry.name,
                laps=contest.conditions.rules.laps,
                color=LIVERY[index % len(LIVERY)],
                ghosts=[*_others(contest, index, shown), *ghosts],
                rivals=_rivals(contest, index),
                sensors=entry.policy.sensors,
            )
    document = contest.to_dict()
    models = {entry.name: {"run": str(entry.run), "step": entry.step} for entry in entries}
    names = {name: path.relative_to(folder).as_posix() for name, path in files.items()}
    write_json(folder / RESULTS, {"format": FORMAT, **document, "models": models, "files": names})
    return {"results": folder / RESULTS, **files}


def _others(contest: Contest, index: int, shown: int) -> list[Ghost]:
    """Everybody else in the same trial, where they drove alone."""
    if contest.terms.shares_road:
        return []
    return [
        ghost_of(trials[shown].recording, name=contest.names[other], color=LIVERY[other % len(LIVERY)])
        for other, trials in enumerate(contest.trials)
        if other != index
    ]


def _rivals(contest: Contest, index: int) -> list[Rival]:
    """Everybody else, where they drove on the same road."""
    if not contest.terms.shares_road:
        return []
    return [
        Rival(contest.names[other], LIVERY[other % len(LIVERY)], trials[0].recording)
        for other, trials in enumerate(contest.trials)
        if other != index
    ]


def _file_names(names: Sequence[str]) -> dict[str, str]:
    """A file name for each name, all different even where letters' case is not told apart."""
    taken: dict[str, str] = {}
    for name in names:
        stem = sanitize_name(name)
        number, chosen = 2, stem
        while chosen.lower() in (other.lower() for other in (*taken.values(), "race")):
            chosen, number = f"{stem}-{number}", number + 1
        taken[name] = chosen
    return taken
