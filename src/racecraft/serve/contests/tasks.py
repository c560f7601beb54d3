"""The jobs of heats and ladders. Both end as they would have if they are begun again: every seed is settled."""

from __future__ import annotations

import json
import os
import zipfile
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

from racecraft import system
from racecraft.serve.contests.files import DRIVEN, MATCHES, REPLAY, VIDEO, contest_folder
from racecraft.serve.contests.terms import terms_of
from racecraft.serve.jobs.task import Task
from racecraft.serve.races.ghosts import entry_name, named_as_asked, sources_of, write_beside
from racecraft.serve.settings import STATE_FOLDER

if TYPE_CHECKING:
    from racecraft.contest.ladder import Match
    from racecraft.race.results import Trial

FILMED = 90.0
"""s of a heat that are filmed."""


def heat(task: Task) -> dict[str, Any]:
    """Let two to eight models race on one road."""
    from racecraft.contest.contest import hold_race
    from racecraft.contest.terms import race_terms
    from racecraft.errors import ConfigError
    from racecraft.film.ghost import LIVERY, Rival
    from racecraft.film.ghost_source import check_sources, load_ghosts
    from racecraft.film.video import film
    from racecraft.race.conditions import Conditions
    from racecraft.race.entry import load_entries
    from racecraft.replay.replay import write_replay
    from racecraft.track import load_track

    payload, folder = task.job.payload, _folder(task)
    held = terms_of(payload)
    conditions = Conditions(
        track=load_track(payload["paths"][0]),
        rules=held.rules,
        seed=payload["seed"] or 0,
        vehicle=held.vehicle,
        objects=held.objects,
        randomize=held.randomize,
    )
    entries = load_entries(_models(task))
    terms = race_terms(
        conditions,
        kind=payload["kind"],
        num_cars=len(entries),
        ranking=payload.get("ranking", "total"),
        minimum_laps=payload.get("minimum_laps"),
        secret=bytes.fromhex(payload.get("secret", "")) or None,
    )
    if payload.get("commitment") not in (None, "", terms.announcement.commitment):
        raise ConfigError(f"The track {conditions.track.name!r} is not the one that the race was announced on.")
    sources = sources_of(payload.get("ghosts", ()), folder=folder, runs=task.runs)
    check_sources(sources, conditions.track, conditions.rules, run=None)
    contest = hold_race(entries, terms)
    ((_, replay),) = contest.replays()
    write_replay(replay, folder / REPLAY)
    rows, first = contest.to_dict()["results"], contest.standings[0].car
    recordings = [trials[0].recording for trials in contest.trials]
    ghosts = load_ghosts(sources, terms.conditions, recordings=recordings, colors=LIVERY[len(entries) % len(LIVERY) :])
    ghosts = named_as_asked(ghosts, payload.get("ghosts", ()))
    write_beside(ghosts, recordings, first=first, folder=folder)
    film(
        recordings[first].until(FILMED),
        folder / VIDEO,
        name=contest.names[first],
        laps=terms.conditions.rules.laps,
        color=LIVERY[first % len(LIVERY)],
        rivals=[
            Rival(name, LIVERY[car % len(LIVERY)], recordings[car])
            for car, name in enumerate(contest.names)
            if car != first
        ],
        ghosts=ghosts,
        sensors=entries[first].sensors,
    )
    return {
        "digest": conditions.track.digest,
        "heat": [
            {
                **{name: row[name] for name in ("place", "name", "score", "gap", "best", "laps", "resets")},
                "car": contest.names.index(row["name"]),
                "off_tracks": row["off_track_count"],
                "crashes": row["crash_count"],
                "penalty": row["penalty_seconds"],
            }
            for row in rows
        ],
    }


def ladder(task: Task) -> dict[str, Any]:
    """Let every two models race, and rate them."""
    from racecraft.judging.ladder import rate_models

    payload, folder = task.job.payload, _folder(task)
    held = terms_of(payload)
    for left in folder.parent.glob(f"*/.{MATCHES}.*"):  # by a ladder that was killed; who lives has locked its own
        with suppress(OSError), left.open("r+b") as dead:
            system.lock(dead.fileno())
            left.unlink()
    unfinished = folder / f".{MATCHES}.{os.getpid()}"  # hidden: nobody copies it while it grows
    with unfinished.open("wb") as file, zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        system.lock(file.fileno())

        def watch(match: Match, trials: Sequence[Trial]) -> None:
            number = len(archive.namelist())
            cars = [_driven(trial) for trial in trials]
            document = {"track": match.track, "cars": cars}
            archive.writestr(f"{number}.json", json.dumps(document, separators=(",", ":")))
            (folder / DRIVEN).write_text(str(number + 1), encoding="ascii")

        found = rate_models(
            _models(task),
            tracks=payload["paths"],
            kind=payload["kind"],
            schedule=payload["schedule"],
            starts=payload["starts"],
            rounds=payload.get("rounds", 0),
            laps=payload["laps"],
            rules=held.rules,
            objects=held.objects,
            vehicle=held.vehicle,
            randomize=held.randomize,
            seed=payload["seed"],
            watch=watch,
        )
    unfinished.replace(folder / MATCHES)
    document = found.to_dict()
    table = [{name: value for name, value in row.items() if name != "floor"} for row in document["ladder"]]
    return {"ladder": table, "matches": document["matches"]}


def _driven(trial: Trial) -> dict[str, Any]:
    """What `ReplayCar` tells of a car besides its number and name."""
    from racecraft.serve.races.replays import car_of

    return car_of(0, "", trial.recording).model_dump(exclude={"entry", "model"})


def _models(task: Task) -> list[str]:
    """Their best checkpoint unless another is asked for, which their names then say."""
    return [str(task.runs / entry_name(one)) for one in task.job.payload["models"]]


def _folder(task: Task) -> Path:
    folder = contest_folder(task.runs / STATE_FOLDER, task.job.id)
    folder.mkdir(parents=True, exist_ok=True)
    return folder
