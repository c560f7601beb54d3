"""What perception believes of one moment of a drive and those before it, beside the camera's picture of it.

As of `racecraft perceive` of a run, it is known what the car was told.
"""

from __future__ import annotations

import base64
import functools
import threading
from typing import TYPE_CHECKING, Final

import numpy as np
from fastapi import APIRouter, Query

from racecraft.analysis import driven_direction, in_one, read_laps
from racecraft.serve.context import Computes, InContext
from racecraft.serve.evaluations.analysis import evaluation_track, lens_of, trace_of
from racecraft.serve.evaluations.objects import objects_of
from racecraft.serve.evaluations.schemas import RoadBelief, RoadObject
from racecraft.serve.problems import NotFound
from racecraft.sim.camera import LUMA
from racecraft.sim.views import BoxView, CarView, ObjectView, Scene

if TYPE_CHECKING:
    from racecraft.perception import Perceiver

REMEMBERED: Final = 150
"""Pictures of a drive that are looked at for one, 10 s of driving in 0.1 s: of more before it memory holds nothing."""
router = APIRouter(prefix="/api/models/{name}", tags=["analysis"])

_LOOKING: Final = threading.Lock()
"""One network for everybody, which looks at one picture at a time."""


@router.get("/evaluations/{stamp}/belief", dependencies=[Computes])
def get_belief(
    name: str,
    stamp: str,
    context: InContext,
    lap: int = Query(ge=1, le=10**6),
    row: int = Query(ge=0, le=10**6),
) -> RoadBelief:
    """The camera's picture of one step of a lap, with what stood on the road, and what perception believes of it."""
    from racecraft.perception.answers import REGION_COLUMNS, REGION_ROWS, ROWS
    from racecraft.perception.telling import sees_middle, tell
    from racecraft.perception.watching import Watcher

    folder = context.garage.folder(name)
    track = evaluation_track(context, folder, stamp)
    laps = read_laps(trace_of(folder, stamp))
    last = next((place for place, traced in enumerate(laps) if traced.number == lap), None)
    if last is None or row >= len(laps[last].time):
        raise NotFound(f"Evaluation {stamp} of {name!r} has no step {row} in lap {lap}.")
    begun = max(place for place in range(last + 1) if not laps[place].goes_on)
    driven, camera = in_one(laps[begun : last + 1]), lens_of(folder)
    poses, step = driven.seen_from(camera.age), len(driven.time) - len(laps[last].time) + row
    view = Scene(driven_direction(track, [driven.points]), palette=camera.palette).driver_view(camera, lit_walls=False)
    objects = objects_of(folder, stamp, laps)
    rows = [(traced.number, place) for traced in laps[begun : last + 1] for place in range(len(traced.time))]
    first = max(0, step - REMEMBERED + 1, *(put for put in driven.puts if put <= step))
    pictures = []
    for pose, (number, place) in zip(poses[first : step + 1].tolist(), rows[first:], strict=False):
        cars = [_view(one, place) for one in objects.get(number, [])]
        pictures.append(view.draw(*pose, cars=cars) @ np.array(LUMA))
    frames = (np.stack(pictures) + 0.5).astype(np.uint8)
    commands = driven.commands[first : step + 1]
    commands[0] = np.nan  # of what was before it nothing is remembered
    with _LOOKING:
        belief = Watcher(_perceiver()).film(frames, np.arange(len(frames)) == 0, commands=commands)
    frame, last = frames[-1], len(frames) - 1
    told = tell("", belief, last)
    del told["file"]
    seen = [place for place in range(len(ROWS)) if sees_middle(belief, last, place)]
    return RoadBelief(
        **told,
        line_rows=[ROWS[place] for place in seen],
        line_columns=belief.middle[last, seen].astype(float).round(2).tolist(),
        line_error=belief.middle_error[last, seen].astype(float).round(2).tolist(),
        regions=belief.regions[last].astype(float).round(3).tolist(),
        region_rows=list(REGION_ROWS),
        region_columns=list(REGION_COLUMNS),
        height=frame.shape[0],
        width=frame.shape[1],
        frame=base64.b64encode(frame.tobytes()).decode(),
    )


@functools.cache
def _perceiver() -> Perceiver:
    from racecraft.perception import Perceiver

    return Perceiver(num_threads=1)


def _view(thing: RoadObject, row: int) -> ObjectView:
    place = min(row, len(thing.x) - 1)  # what stands has one pose for the whole lap
    pose = (thing.x[place], thing.y[place], thing.heading[place])
    return BoxView(*pose) if thing.kind == "box" else CarView(*pose)
