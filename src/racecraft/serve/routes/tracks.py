"""Tracks: the gallery and the geometry of each."""

from __future__ import annotations

from fastapi import APIRouter

from racecraft.serve.context import InContext
from racecraft.serve.courses import geometry
from racecraft.serve.schemas import TrackFacts, TrackGeometry
from racecraft.track import track_names

router = APIRouter(prefix="/api/tracks", tags=["tracks"])


@router.get("")
def list_tracks(context: InContext) -> list[TrackFacts]:
    """The library's tracks, then the user's own."""
    return [context.courses.facts(name) for name in (*track_names(), *context.courses.own_names())]


@router.get("/{name}")
def get_track(name: str, context: InContext) -> TrackGeometry:
    """A track's lines."""
    return geometry(name, context.courses.load(name))
