"""Our own tracks, each a short table of corners: (x, y, radius) in metres, in driving direction.

A closed track starts in the middle of the straight from its last corner to its first.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache

import numpy as np

from racecraft.errors import TrackNotFound, did_you_mean
from racecraft.track.curve import Corner, road_along, trace_corners
from racecraft.track.polyline import signed_area
from racecraft.track.track import Track


@dataclass(frozen=True, kw_only=True)
class Course:
    """A track of the library, as it was designed."""

    name: str
    """What `load_track` knows it by."""
    display_name: str
    """What people call it."""
    description: str
    """One line on what it is good for."""
    difficulty: int
    """1 (a first lap) to 5 (for experts)."""
    width: float | tuple[tuple[float, float], ...]
    """Width of the road, metres; or (fraction of the lap, width) pairs, the first at 0 and the last at 1."""
    corners: tuple[Corner, ...]
    """(x, y, radius), metres, in driving direction."""
    is_closed: bool = True
    """Whether the last corner leads back to the first."""
    ease: float = 0.4
    """How gently the road goes from straight to bend, metres."""


def track_names() -> list[str]:
    """Names of the library's tracks, in the order of the list: from gentle to demanding."""
    return list(_COURSES)


def course(name: str) -> Course:
    """How a track of the library was designed.

    Raises:
        TrackNotFound: The library has no track of this name.
    """
    try:
        return _COURSES[name]
    except KeyError:
        hint = f"{did_you_mean(name, _COURSES)} List all with 'racecraft tracks'.".strip()
        raise TrackNotFound(f"Track {name!r} does not exist.", hint=hint) from None


@cache
def library_track(name: str) -> Track:
    """A track of the library.

    Raises:
        TrackNotFound: The library has no track of this name.
    """
    return build(course(name))


def build(design: Course) -> Track:
    """The road that a design describes."""
    line = trace_corners(design.corners, is_closed=design.is_closed, ease=design.ease)
    width: float | np.ndarray
    if isinstance(design.width, tuple):
        fraction, metres = np.array(design.width).T
        width = np.interp(np.linspace(0.0, 1.0, len(line)), fraction, metres)
    else:
        width = design.width
    is_clockwise = design.is_closed and signed_area(line) < 0.0
    return road_along(line, width, name=design.name, is_clockwise=is_clockwise)


def _polar(distance: float, degrees: float, radius: float) -> Corner:
    angle = math.radians(degrees)
    return distance * math.cos(angle), distance * math.sin(angle), radius


_LIST = (
    Course(
        name="straight",
        display_name="Drag Strip",
        description="Fifteen metres straight ahead: checks a car before its first corner.",
        difficulty=1,
        width=0.9,
        is_closed=False,
        corners=((0, 0, 0), (15, 0, 0)),
    ),
    Course(
        name="oval",
        display_name="Paperclip",
        description="Two straights, two even bends: the place for a first lap.",
        difficulty=1,
        width=0.9,
        corners=((6.6, 0, 1.6), (6.6, 3.2, 1.6), (0, 3.2, 1.6), (0, 0, 1.6)),
    ),
    Course(
        name="reinvent_2018",
        display_name="Las Vegas 2018",
        description="After the first DeepRacer track: one chicane, one long bend, 17.7 metres.",
        difficulty=2,
        width=0.762,
        corners=(
            (6.576, 0, 1.05),
            (6.576, 2.1, 1.05),
            (3.8, 2.1, 0.9),
            (2.6, 3.827, 0.8),
            (-0.31, 3.827, 0.88),
            (0.73, 0, 0.78),
        ),
    ),
    Course(
        name="speedway",
        display_name="Thunder Bowl",
        description="A wide tri-oval that is flat out all the way, for cars that like company.",
        difficulty=1,
        width=1.5,
        ease=1.2,
        corners=((7.5, -1.5, 7.0), (15, 0.2, 2.5), (14, 6.2, 2.7), (1, 6.2, 2.7), (0, 0.2, 2.5)),
    ),
    Course(
        name="kidney",
        display_name="Kidney Bean",
        description="One inward bend between long outward ones: the first lesson in turning both ways.",
        difficulty=2,
        width=0.9,
        ease=0.8,
        corners=((7.2, 0, 1.9), (7.8, 4.6, 1.4), (3.7, 2.6, 1.7), (-0.4, 4.6, 1.4), (0.2, 0, 1.9)),
    ),
    Course(
        name="delta",
        display_name="Delta",
        description="Three corners, three radii: one wide, one medium, one that needs the brakes.",
        difficulty=2,
        width=0.9,
        corners=((9.2, 0, 0.85), (4.4, 6.6, 1.9), (-0.6, 0, 1.2)),
    ),
    Course(
        name="bowtie",
        display_name="Bowtie",
        description="Two loops joined at a narrow waist, without a crossing: left and right in equal parts.",
        difficulty=2,
        width=0.8,
        corners=(
            (0.1, -0.5, 0.95),
            (4.0, 1.3, 1.5),
            (7.9, -0.5, 0.95),
            (7.9, 4.7, 0.95),
            (4.0, 2.9, 1.5),
            (0.1, 4.7, 0.95),
        ),
    ),
    Course(
        name="lakeside",
        display_name="Lakeside",
        description="Long sweepers round the water, driven clockwise: a test of patience at speed.",
        difficulty=3,
        width=1.0,
        ease=0.9,
        corners=(
            (2.2, 7.4, 2.0),
            (6.8, 8.2, 2.4),
            (9.0, 5.4, 1.5),
            (12.6, 6.0, 1.6),
            (13.6, 1.6, 1.8),
            (9.6, 0.4, 2.4),
            (6.2, 2.4, 2.0),
            (3.2, -0.6, 1.8),
            (-0.4, 1.4, 1.6),
        ),
    ),
    Course(
        name="trefoil",
        display_name="Trefoil",
        description="Three lobes of one size, right in between and left around: find the rhythm.",
        difficulty=3,
        width=0.8,
        corners=tuple(
            corner
            for axis in (0, 120, 240)
            for corner in (
                _polar(2.0, axis - 60, 1.0),
                _polar(5.0, axis - 17, 1.2),
                _polar(5.0, axis + 17, 1.2),
            )
        ),
    ),
    Course(
        name="serpent",
        display_name="Serpent",
        description="Esses one way, a straight the other: turn in early or run out of road.",
        difficulty=3,
        width=0.85,
        corners=(
            (12.2, 0, 1.3),
            (12.2, 3.4, 1.2),
            (9.6, 2.0, 1.1),
            (7.4, 4.6, 1.1),
            (5.2, 2.0, 1.1),
            (3.0, 4.6, 1.1),
            (0, 3.6, 1.2),
            (0, 0, 1.2),
        ),
    ),
    Course(
        name="bottleneck",
        display_name="Bottleneck",
        description="A road that narrows from 1.2 m to 0.7 m: aim before you arrive.",
        difficulty=3,
        width=(
            (0.0, 1.2),
            (0.16, 1.2),
            (0.28, 0.7),
            (0.46, 0.7),
            (0.56, 1.1),
            (0.7, 1.1),
            (0.82, 0.8),
            (1.0, 1.2),
        ),
        corners=(
            (8.6, 0, 1.3),
            (9.4, 3.2, 1.2),
            (6.4, 4.2, 1.2),
            (6.2, 7.0, 1.2),
            (1.6, 7.2, 1.4),
            (2.4, 3.6, 1.2),
            (-0.6, 2.4, 1.1),
            (-0.2, 0, 1.1),
        ),
    ),
    Course(
        name="harbor",
        display_name="Harbour Streets",
        description="Right-angled corners between the walls, driven clockwise, with a hairpin at the quay.",
        difficulty=4,
        width=0.9,
        ease=0.3,
        corners=(
            (0, 8.0, 0.9),
            (4.2, 8.0, 0.8),
            (4.2, 5.6, 0.8),
            (7.4, 5.6, 0.8),
            (7.4, 8.6, 0.9),
            (12.4, 7.4, 0.9),
            (12.4, 3.2, 0.8),
            (9.6, 3.2, 0.8),
            (9.6, 0.6, 0.9),
            (5.4, -0.6, 0.9),
            (5.4, 2.6, 0.8),
            (2.4, 2.6, 0.8),
            (2.4, 0, 0.8),
            (0, 0, 0.8),
        ),
    ),
    Course(
        name="hairpin",
        display_name="Four Hairpins",
        description="Straight, hairpin, straight, hairpin: brake late, turn once, go.",
        difficulty=3,
        width=0.8,
        ease=0.3,
        corners=(
            (9.0, 0, 0.9),
            (9.0, 1.8, 0.9),
            (2.4, 1.8, 0.9),
            (2.4, 3.6, 0.9),
            (9.0, 3.6, 0.9),
            (9.0, 5.4, 0.9),
            (0, 5.4, 1.2),
            (0, 0, 1.2),
        ),
    ),
    Course(
        name="needle",
        display_name="Eye of the Needle",
        description="Sixty centimetres wide and never straight for long: precision before pace.",
        difficulty=5,
        width=0.6,
        ease=0.3,
        corners=(
            (4.0, 0, 0.8),
            (5.2, 1.5, 0.75),
            (7.2, 0.2, 0.75),
            (8.2, 2.6, 0.8),
            (6.0, 3.6, 0.75),
            (6.8, 5.6, 0.75),
            (4.4, 6.4, 0.75),
            (3.6, 4.0, 0.75),
            (1.8, 5.8, 0.75),
            (-0.4, 4.4, 0.8),
            (1.2, 2.4, 0.75),
            (-0.6, 0.6, 0.75),
            (0.6, -0.3, 0.7),
        ),
    ),
    Course(
        name="alpine_pass",
        display_name="Alpine Pass",
        description="An open road up the mountain: switchback after switchback, and no second lap.",
        difficulty=4,
        width=0.85,
        is_closed=False,
        corners=(
            (0, 0, 0),
            (7.6, 0.4, 0.95),
            (7.9, 2.4, 0.95),
            (1.4, 2.5, 0.95),
            (1.1, 4.7, 0.95),
            (4.4, 4.1, 1.2),
            (6.6, 5.2, 0.95),
            (6.4, 7.2, 0.95),
            (2.6, 6.6, 1.2),
            (0, 8.4, 0),
        ),
    ),
    Course(
        name="boomerang",
        display_name="Boomerang",
        description="Out along one arm, back along the other, with a fast kink at the elbow.",
        difficulty=2,
        width=0.9,
        ease=0.6,
        corners=(
            (5.2, -1.2, 2.4),
            (9.6, 2.6, 1.1),
            (8.2, 4.4, 1.1),
            (4.7, 1.6, 1.6),
            (0.2, 3.2, 1.1),
            (-0.6, 0.6, 1.1),
        ),
    ),
    Course(
        name="grand_circuit",
        display_name="Grand Circuit",
        description="Nearly seventy metres with everything in it: main straight, chicane, hairpins, sweeper.",
        difficulty=4,
        width=1.0,
        ease=0.6,
        corners=(
            (15.4, 0, 1.1),
            (14.6, 2.6, 1.3),
            (17.8, 4.6, 1.7),
            (16.2, 9.4, 2.2),
            (11.8, 8.2, 1.4),
            (12.6, 4.9, 1.3),
            (9.9, 3.4, 1.2),
            (8.5, 5.6, 1.1),
            (9.6, 9.4, 1.2),
            (7.4, 10.4, 1.2),
            (4.6, 3.6, 1.3),
            (2.4, 4.6, 1.3),
            (3.2, 8.6, 1.5),
            (-0.6, 9.4, 1.6),
            (-2.6, 4.2, 2.4),
            (-1.2, 0, 1.6),
        ),
    ),
    Course(
        name="endurance",
        display_name="Endurance",
        description="Ninety-five metres through the forest: long enough to forget how the lap began.",
        difficulty=5,
        width=1.0,
        ease=0.8,
        corners=(
            (19.4, 0, 1.4),
            (19.4, 3.4, 1.4),
            (9.2, 2.6, 1.3),
            (8.2, 5.4, 1.3),
            (14.2, 6.2, 1.8),
            (16.6, 4.9, 2.0),
            (21.0, 6.4, 1.8),
            (20.2, 11.8, 2.2),
            (15.8, 12.4, 1.8),
            (14.0, 9.0, 1.5),
            (10.8, 9.0, 1.5),
            (10.0, 12.8, 1.6),
            (5.6, 12.2, 1.7),
            (5.8, 7.6, 1.7),
            (2.4, 6.6, 1.5),
            (1.4, 10.8, 1.5),
            (-2.4, 11.0, 1.6),
            (-3.4, 5.6, 2.6),
            (-0.6, 2.9, 1.8),
            (-1.4, 0, 1.2),
        ),
    ),
)  # fmt: skip

_COURSES = {design.name: design for design in sorted(_LIST, key=lambda design: design.difficulty)}
