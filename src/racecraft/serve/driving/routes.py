"""Drive a car yourself."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Query, Response

from racecraft.errors import ConfigError
from racecraft.limits import known_limit
from racecraft.serve.context import Computes, InContext, InUser
from racecraft.serve.driving.schemas import (
    Controls,
    Directions,
    Drive,
    DriveState,
    Ghost,
    GhostCard,
    NewDrive,
    Vehicles,
)
from racecraft.serve.models.schemas import MedalTimes
from racecraft.serve.tracks.courses import geometry
from racecraft.sim import load_vehicle
from racecraft.track import draw_road, validate

router = APIRouter(prefix="/api", tags=["drives"])

Track = Annotated[str, Query(max_length=200)]


@router.post("/drives", status_code=201, dependencies=[Computes])
def begin_drive(request: NewDrive, context: InContext, user: InUser) -> Drive:
    """Sit down in a car at the start of a track."""
    if request.sketch is not None:
        track = draw_road(request.sketch.to_sketch(), name="drawing")
        validate(track)
    elif request.track is not None:
        track = context.courses.load(request.track)
    else:
        raise ConfigError("A drive needs a track or a sketch of one.")
    key, car = context.drives.begin(track, vehicle=request.vehicle, direction=request.direction, user_id=user)
    best = context.ghosts.best(track, vehicle=request.vehicle, direction=request.direction, user_id=user)
    driven = track.reversed() if request.direction == "reverse" else track
    limit = known_limit(driven, load_vehicle(request.vehicle))
    return Drive(
        id=key,
        geometry=geometry(request.track or "drawing", track),
        direction=request.direction,
        start=car.pose,
        best=best.seconds if best is not None else None,
        medals=MedalTimes(**vars(limit.medals)) if limit is not None else None,
    )


@router.post("/drives/{drive_id}/steps")
def drive_on(drive_id: str, controls: Controls, context: InContext, user: InUser) -> DriveState:
    """Drive on for some steps of 1/15 s."""
    car = context.drives.car(drive_id, user_id=user)
    with car.lock:
        state, trace = car.step(controls)
        if state.finished is not None and trace:
            state.finished.is_best = context.ghosts.keep(car, state.finished.seconds, trace)
    return state


@router.delete("/drives/{drive_id}", status_code=204)
def end_drive(drive_id: str, context: InContext, user: InUser) -> Response:
    """Get out."""
    context.drives.end(drive_id, user_id=user)
    return Response(status_code=204)


@router.get("/ghosts")
def list_ghosts(
    track: Track, context: InContext, user: InUser, vehicle: Vehicles = "v5", direction: Directions = "forward"
) -> list[GhostCard]:
    """Laps to drive against on a track."""
    course = context.courses.load(track)
    return context.ghosts.cards(course, vehicle=vehicle, direction=direction, user_id=user)


@router.get("/ghosts/{key}")
def get_ghost(
    key: str,
    track: Track,
    context: InContext,
    user: InUser,
    vehicle: Vehicles = "v5",
    direction: Directions = "forward",
) -> Ghost:
    """One of them, step by step."""
    course = context.courses.load(track)
    return context.ghosts.get(key, course, vehicle=vehicle, direction=direction, user_id=user)
