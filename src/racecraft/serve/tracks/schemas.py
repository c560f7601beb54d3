"""What browser and server tell each other about drawing and importing tracks; metres."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from racecraft.analysis.corners import Sector
from racecraft.serve.schemas import Message, Problem
from racecraft.track.sketch import FARTHEST, MAX_POINTS, WIDEST, Sketch

Coordinate = Annotated[float, Field(ge=-FARTHEST, le=FARTHEST, allow_inf_nan=False)]


class TrackFacts(Message):
    """A track in the gallery."""

    name: str
    title: str
    length: float
    mean_width: float
    min_radius: float | None
    direction: str
    is_closed: bool
    is_own: bool
    corners: int
    outline: list[list[float]]
    """Centre line for a thumbnail, at most 120 points (x, y)."""


class TrackGeometry(Message):
    """Everything to draw a track; three lines of the same number of points (x, y), closed ones without a repeat."""

    name: str
    length: float
    is_closed: bool
    center: list[list[float]]
    inner: list[list[float]]
    outer: list[list[float]]


class TrackSector(Message):
    """A corner with half of the straights around it, metres along the centre line; turn in radians, left positive."""

    number: int
    start: float
    end: float
    apex: float
    turn: float

    @classmethod
    def of(cls, sector: Sector) -> TrackSector:
        """From the analysis'."""
        return cls(number=sector.number, start=sector.start, end=sector.end, apex=sector.apex, turn=sector.turn)


class ControlPoint(Message):
    """A point that the road goes through, and its width there."""

    x: Coordinate
    y: Coordinate
    width: float = Field(ge=0.0, le=WIDEST, allow_inf_nan=False)


class TrackSketch(Message):
    """A road as it is drawn: control points in driving direction."""

    points: list[ControlPoint] = Field(max_length=MAX_POINTS)
    is_closed: bool = True

    def to_sketch(self) -> Sketch:
        """As the track package has it.

        Raises:
            TrackError: It is no drawing of a road.
        """
        return Sketch(
            points=tuple((point.x, point.y) for point in self.points),
            widths=tuple(point.width for point in self.points),
            is_closed=self.is_closed,
        )

    @classmethod
    def of(cls, sketch: Sketch) -> TrackSketch:
        """From the track package's."""
        points = [
            ControlPoint(x=x, y=y, width=width) for (x, y), width in zip(sketch.points, sketch.widths, strict=True)
        ]
        return cls(points=points, is_closed=sketch.is_closed)


class SketchVerdict(Message):
    """Whether a drawing can be driven; if not, why, and where if that is known."""

    ok: bool
    problem: Problem | None = None
    place: list[float] | None = None
    """x, y of the trouble."""
    geometry: TrackGeometry | None = None
    """Of the road, as far as one can be drawn."""
    min_radius: float | None = None
    mean_width: float | None = None
    corners: int = 0
    direction: str = ""
