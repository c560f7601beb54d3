"""Races that models are entered in."""

from __future__ import annotations

import json
from pathlib import Path as FilePath
from typing import Annotated

from fastapi import APIRouter, Path, Query, Response
from fastapi.responses import FileResponse

from racecraft.contest.terms import MAX_TRIALS
from racecraft.errors import ConfigError
from racecraft.judging.race import FORMAT
from racecraft.serve.context import Computes, InConsoles, InContext, InUser, TakesPlace
from racecraft.serve.evaluations.objects import MAX_SHOWN
from racecraft.serve.evaluations.traces import read_laps
from racecraft.serve.problems import NotFound
from racecraft.serve.races.ghosts import read_beside
from racecraft.serve.races.replays import cars_there, replay_of, trial_of
from racecraft.serve.races.rules import rule_sets
from racecraft.serve.races.schemas import (
    MAX_CARS,
    Enter,
    NewRace,
    RaceCard,
    RaceChange,
    RaceDetail,
    RaceReplay,
    ReplayCar,
    RuleSet,
)
from racecraft.serve.races.standings import replay_trace
from racecraft.serve.races.tasks import REPLAY, VIDEO, entry_folder
from racecraft.serve.store.tables import Job

router = APIRouter(prefix="/api/races", tags=["races"])

Id = Annotated[int, Path(ge=0, lt=2**31)]


@router.get("")
def list_races(context: InContext) -> list[RaceCard]:
    """The calendar, newest first."""
    return context.races.cards()


@router.post("", status_code=201)
def create_race(request: NewRace, context: InContext, user: InUser) -> RaceDetail:
    """Make a race."""
    return context.races.get(context.races.create(request, user_id=user))


@router.get("/rules")
def list_rules() -> list[RuleSet]:
    """Sets of rules that models can race by, the usual one first."""
    return rule_sets()


@router.get("/{race_id}")
def get_race(race_id: Id, context: InContext) -> RaceDetail:
    """A race with its standings."""
    return context.races.get(race_id)


@router.patch("/{race_id}")
def change_race(race_id: Id, request: RaceChange, context: InContext) -> RaceDetail:
    """Another title, description or end."""
    context.races.change(race_id, request)
    return context.races.get(race_id)


@router.delete("/{race_id}", status_code=204)
def delete_race(race_id: Id, context: InContext) -> Response:
    """Put a race away."""
    context.races.set_deleted(race_id, is_deleted=True)
    return Response(status_code=204)


@router.post("/{race_id}/restore")
def restore_race(race_id: Id, context: InContext) -> RaceDetail:
    """Bring a deleted race back."""
    context.races.set_deleted(race_id, is_deleted=False)
    return context.races.get(race_id)


@router.post("/{race_id}/entries", status_code=202, dependencies=[TakesPlace])
def enter_race(race_id: Id, request: Enter, context: InContext, consoles: InConsoles, user: InUser) -> RaceDetail:
    """Enter models; each drives as a job."""
    consoles.quotas.require(user, "places", count=len(request.models))
    context.races.enter(race_id, request, user_id=user)
    context.supervisor.wake()
    return context.races.get(race_id)


@router.delete("/{race_id}/entries/{entry_id}", status_code=204)
def withdraw_entry(race_id: Id, entry_id: Id, context: InContext) -> Response:
    """Take an entry back."""
    context.races.withdraw(race_id, entry_id)
    return Response(status_code=204)


@router.get("/{race_id}/race.json")
def get_announcement(race_id: Id, context: InContext) -> Response:
    """What is published of a race, for `racecraft verify --race`: the secret is in it when the race is over."""
    announced = context.races.announcement(race_id)
    text = json.dumps({"format": FORMAT, **announced.to_dict()}, indent=2, ensure_ascii=False)
    return Response(text, media_type="application/json")


@router.get("/{race_id}/entries/{entry_id}/video")
def get_video(race_id: Id, entry_id: Id, context: InContext) -> FileResponse:
    """The film of an entry's trial that counted."""
    return _file(context, race_id, entry_id, VIDEO, media_type="video/mp4")


@router.get("/{race_id}/entries/{entry_id}/replay")
def get_entry_replay(race_id: Id, entry_id: Id, context: InContext) -> FileResponse:
    """The replay file of an entry, for `racecraft verify`."""
    return _file(context, race_id, entry_id, REPLAY, media_type="application/octet-stream")


@router.get("/{race_id}/replay", dependencies=[Computes])
def get_replay(
    race_id: Id,
    context: InContext,
    entries: Annotated[str, Query(max_length=200, pattern=r"^\d+(,\d+)*$")],
    trial: Annotated[int | None, Query(ge=0, lt=MAX_TRIALS)] = None,
) -> RaceReplay:
    """One trial of some entries side by side, step by step.

    `entries` are their ids joined by commas; by default it is the trial that the first of them is ranked by, whose
    ghosts are beside them. Those whose replay is gone or damaged are named, and the others shown.
    """
    wanted = list(dict.fromkeys(int(part) for part in entries.split(",")))
    if len(wanted) > MAX_CARS:
        raise ConfigError(f"A replay shows at most {MAX_CARS} cars, {len(wanted)} were asked for.")
    race, runs = context.races.get(race_id), context.settings.runs
    driven = context.races.driven(race_id, wanted)
    chosen = _median_trial(race, wanted[0]) if trial is None else min(trial, race.trials - 1)
    jobs = dict(driven)

    def car_of(entry: int) -> ReplayCar:
        job = jobs[entry]
        return _old_car(entry, job, runs) if race.is_old else _car(entry, job, runs, chosen)

    cars, missing = cars_there({entry: job.run for entry, job in driven}, car_of)
    is_first_there = cars[0].entry == driven[0][0]
    ghosts = read_beside(entry_folder(runs, driven[0][1].id), trial=chosen) if is_first_there else []
    track = context.courses.load(race.track)
    return replay_of(race.track, track, cars, trial=chosen, ghosts=ghosts, missing=missing)


def _file(context: InContext, race_id: int, entry_id: int, name: str, *, media_type: str) -> FileResponse:
    ((_, job),) = context.races.driven(race_id, [entry_id])
    path = entry_folder(context.settings.runs, job.id) / name
    if not path.is_file():
        raise NotFound(f"Entry {entry_id} of race {race_id} has no such file.")
    return FileResponse(path, media_type=media_type, filename=f"{job.run}-{name}", content_disposition_type="inline")


def _median_trial(race: RaceDetail, entry: int) -> int:
    """The trial that an entry is ranked by; the first where it has no score."""
    row = next((one for one in race.standings if one.entry == entry), None)
    if row is None or row.score is None:
        return 0
    away = [abs((one or 1e9) - row.score) for one in row.scores]
    return away.index(min(away))


def _car(entry: int, job: Job, runs: FilePath, trial: int) -> ReplayCar:
    """One trial of an entry."""
    path = entry_folder(runs, job.id) / REPLAY
    if not path.is_file():
        raise NotFound(f"{job.run!r} has no replay in this race.")
    return trial_of(path, trial, entry=entry, model=job.run, max_numbers=MAX_SHOWN)


def _old_car(entry: int, job: Job, runs: FilePath) -> ReplayCar:
    """The same of an entry under the old rules, whose file does not say what stood on the road."""
    path = replay_trace(job, runs=runs)
    if path is None:
        raise NotFound(f"{job.run!r} has no replay in this race.")
    trace: list[list[int]] = []
    ends = []
    for lap in read_laps(path):
        trace += lap.trace
        ends.append(len(trace))
    return ReplayCar(entry=entry, model=job.run, trace=trace, laps=ends, objects=[])
