"""Tracks: the gallery, the geometry of each, and the user's own: drawn, imported, deleted."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
from fastapi import APIRouter, Body, Query, Response

from racecraft.errors import TrackError
from racecraft.serve.context import Computes, InContext
from racecraft.serve.schemas import Problem
from racecraft.serve.tracks.courses import geometry
from racecraft.serve.tracks.schemas import SketchVerdict, TrackFacts, TrackGeometry, TrackSketch
from racecraft.track import Track, draw_road, find_corners, track_names, validate

router = APIRouter(prefix="/api/tracks", tags=["tracks"])


@router.get("", dependencies=[Computes])
def list_tracks(context: InContext) -> list[TrackFacts]:
    """The library's tracks, then the user's own."""
    return [*(context.courses.facts(name) for name in track_names()), *context.courses.own_facts()]


@router.post("/validate", dependencies=[Computes])
def validate_sketch(sketch: TrackSketch) -> SketchVerdict:
    """Whether a drawing can be driven, as it is drawn; nothing is kept."""
    try:
        track = draw_road(sketch.to_sketch(), name="drawing")
    except TrackError as error:
        return SketchVerdict(ok=False, problem=_problem(error), place=_place(error))
    try:
        validate(track)
    except TrackError as error:
        return SketchVerdict(ok=False, problem=_problem(error), place=_place(error), **_described(track))
    return SketchVerdict(ok=True, **_described(track))


@router.post("/import", status_code=201, dependencies=[Computes])
def import_track(
    context: InContext,
    content: bytes = Body(media_type="application/octet-stream", max_length=2_000_000),
    file: str = Query(max_length=255, description="What the file is called."),
    name: str | None = Query(None, max_length=64),
) -> TrackFacts:
    """Take in a track file: an AWS route (.npy) or a centre line with widths (.csv)."""
    return context.courses.take_in(content, file_name=file, name=name)


@router.get("/{name}", dependencies=[Computes])
def get_track(name: str, context: InContext) -> TrackGeometry:
    """A track's lines."""
    return geometry(name, context.courses.load(name))


@router.get("/{name}/sketch", dependencies=[Computes])
def get_sketch(name: str, context: InContext) -> TrackSketch:
    """A track's control points, for the editor."""
    return context.courses.sketch(name)


@router.get("/{name}/route.npy", response_class=Response, dependencies=[Computes])
def get_route(name: str, context: InContext) -> Response:
    """A track as an AWS route file."""
    content = context.courses.route(name)
    return Response(content, media_type="application/octet-stream")


@router.put("/{name}", dependencies=[Computes])
def save_track(name: str, sketch: TrackSketch, context: InContext, replace: bool = False) -> TrackFacts:
    """Keep a drawing as one of the user's own tracks."""
    return context.courses.save(name, sketch, replace=replace)


@router.delete("/{name}", status_code=204)
def delete_track(name: str, context: InContext) -> Response:
    """Put one of the user's own tracks into the trash."""
    context.courses.remove(name)
    return Response(status_code=204)


@router.post("/{name}/restore", dependencies=[Computes])
def restore_track(name: str, context: InContext) -> TrackFacts:
    """Bring a deleted track back."""
    return context.courses.restore(name)


def _described(track: Track) -> dict[str, Any]:
    return {
        "geometry": geometry("drawing", track),
        "min_radius": round(track.min_radius, 3) if np.isfinite(track.min_radius) else None,
        "mean_width": round(track.mean_width, 3),
        "corners": len(find_corners(track)),
        "direction": track.direction,
    }


def _problem(error: TrackError) -> Problem:
    return Problem(
        code=type(error).__name__, message=str(error).replace("Track 'drawing'", "The road"), hint=error.hint
    )


def _place(error: TrackError) -> list[float] | None:
    found = re.search(r"near \((-?[\d.]+), (-?[\d.]+)\)", str(error))
    return [float(found[1]), float(found[2])] if found else None
