"""Races that models are entered in."""

from __future__ import annotations

from typing import Annotated, Final

from fastapi import APIRouter, Path, Query, Response

from racecraft.errors import ConfigError
from racecraft.serve.context import InContext, InUser
from racecraft.serve.evaluations.traces import read_laps
from racecraft.serve.races.schemas import Enter, NewRace, RaceCard, RaceChange, RaceDetail, RaceReplay, ReplayCar
from racecraft.serve.tracks.courses import geometry

router = APIRouter(prefix="/api/races", tags=["races"])

Id = Annotated[int, Path(ge=0, lt=2**31)]
MAX_CARS: Final = 12  # of a replay


@router.get("")
def list_races(context: InContext) -> list[RaceCard]:
    """The calendar, newest first."""
    return context.races.cards()


@router.post("", status_code=201)
def create_race(request: NewRace, context: InContext, user: InUser) -> RaceDetail:
    """Make a race."""
    return context.races.get(context.races.create(request, user_id=user))


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


@router.post("/{race_id}/entries", status_code=202)
def enter_race(race_id: Id, request: Enter, context: InContext, user: InUser) -> RaceDetail:
    """Enter models; each drives as a job."""
    context.races.enter(race_id, request, user_id=user)
    context.supervisor.wake()
    return context.races.get(race_id)


@router.delete("/{race_id}/entries/{entry_id}", status_code=204)
def withdraw_entry(race_id: Id, entry_id: Id, context: InContext) -> Response:
    """Take an entry back."""
    context.races.withdraw(race_id, entry_id)
    return Response(status_code=204)


@router.get("/{race_id}/replay")
def get_replay(
    race_id: Id, context: InContext, entries: Annotated[str, Query(max_length=200, pattern=r"^\d+(,\d+)*$")]
) -> RaceReplay:
    """Some entries side by side, step by step; `entries` are their ids joined by commas."""
    wanted = list(dict.fromkeys(int(part) for part in entries.split(",")))
    if len(wanted) > MAX_CARS:
        raise ConfigError(f"A replay shows at most {MAX_CARS} cars, {len(wanted)} were asked for.")
    race = context.races.get(race_id)
    cars = []
    for entry, model, folder in context.races.evaluations(race_id, wanted):
        trace: list[list[int]] = []
        ends = []
        for lap in read_laps(folder / "evaluation-simtrace" / "0-iteration.csv"):
            trace += lap.trace
            ends.append(len(trace))
        cars.append(ReplayCar(entry=entry, model=model, trace=trace, laps=ends))
    return RaceReplay(geometry=geometry(race.track, context.courses.load(race.track)), cars=cars)
