"""Roads drawn through control points."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from racecraft.errors import RacecraftError, TrackError
from racecraft.track import Sketch, draw_road, load_track, sketch_of, track_names, validate
from racecraft.track.track import CLOSED_GAP


def ring(count: int, radius: float, width: float = 0.8) -> Sketch:
    angles = [2 * math.pi * i / count for i in range(count)]
    points = tuple((radius * math.cos(a), radius * math.sin(a)) for a in angles)
    return Sketch(points=points, widths=(width,) * count)


def test_points_on_a_circle_draw_a_circle() -> None:
    track = draw_road(ring(12, 3.0), name="round")
    validate(track)
    radii = np.hypot(*track.centerline.T)
    assert np.abs(radii - 3.0).max() < 0.003
    assert track.mean_width == pytest.approx(0.8, rel=0.001)
    assert track.direction == "counter-clockwise"
    backwards = Sketch(points=ring(12, 3.0).points[::-1], widths=(0.8,) * 12)
    assert draw_road(backwards, name="round").direction == "clockwise"


@settings(max_examples=40, deadline=None)
@given(
    st.lists(st.tuples(st.floats(-9, 9), st.floats(-9, 9), st.floats(0.3, 2)), min_size=3, max_size=12),
    st.booleans(),
)
@example(places=[(2.0, 0.0, 1.0), (-1.0, 0.0, 1.0), (2.0, 0.0, 1.0)], is_closed=False)  # back on itself
@example(places=[(0.0, 1e-9, 1.0), (0.0, 1.0, 1.0), (0.0, 0.0, 1.0)], is_closed=False)  # ends beside its start
def test_the_line_goes_through_every_point(places: list[tuple[float, float, float]], is_closed: bool) -> None:
    try:
        sketch = Sketch(
            points=tuple((x, y) for x, y, _ in places), widths=tuple(w for *_, w in places), is_closed=is_closed
        )
    except TrackError:
        return
    track = draw_road(sketch, name="drawn")
    assert track.is_closed == (is_closed or math.dist(sketch.points[0], sketch.points[-1]) <= CLOSED_GAP)
    away = [
        float(np.hypot(*(track.point_at(np.arange(0, track.length, 0.01)) - point).T).min()) for point in sketch.points
    ]
    assert max(away) < 0.1  # waypoints are 0.15 m apart, and a point may be a spike
    rows = np.hypot(*(track.inner - track.outer).T)
    assert rows.min() > min(sketch.widths) - 0.01
    assert rows.max() < max(sketch.widths) + 0.01


@pytest.mark.parametrize("name", [*track_names(), "generated:3", "generated:8,difficulty=1"])
def test_a_track_can_be_sketched_and_drawn_again(name: str) -> None:
    track = load_track(name)
    again = draw_road(sketch_of(track), name=name)
    validate(again)
    assert again.length == pytest.approx(track.length, rel=0.02)
    assert again.direction == track.direction
    assert np.abs(track.project(again.centerline)[1]).max() < 0.12


def test_widths_follow_the_points() -> None:
    sketch = Sketch(points=((0, 0), (4, 0), (8, 0)), widths=(0.5, 1.0, 0.5), is_closed=False)
    track = draw_road(sketch, name="bulge")
    assert float(track.width_at(4.0)) == pytest.approx(1.0, abs=0.02)
    assert float(track.width_at(0.0)) == pytest.approx(0.5, abs=0.02)


@pytest.mark.parametrize(
    ("points", "widths", "message"),
    [
        (((0, 0), (1, 1)), (1, 1), "A drawing has 3 to 200 points; this one has 2."),
        (((0, 0), (1, 1), (2, 0)), (1, 1), "each point has one"),
        (((0, 0), (math.nan, 1), (2, 0)), (1, 1, 1), "Point 2"),
        (((0, 0), (1e9, 1), (2, 0)), (1, 1, 1), "Point 2"),
        (((0, 0), (1, 1), (2, 0)), (1, 0, 1), "wide at point 2"),
        (((0, 0), (1, 1), (2, 0)), (1, math.nan, 1), "wide at point 2"),
        (((0, 0), (0, 0), (2, 0)), (1, 1, 1), "Points 1 and 2"),
        (((0, 0), (300, 0), (300, 300)), (1, 1, 1), "long"),
    ],
)
def test_nonsense_is_refused(points: tuple[tuple[float, float], ...], widths: tuple[float, ...], message: str) -> None:
    with pytest.raises(TrackError, match=message):
        Sketch(points=points, widths=widths)


def test_a_figure_of_eight_is_told_by_its_place() -> None:
    points = ((-4, -2), (4, 2), (4, -2), (-4, 2))
    with pytest.raises(RacecraftError, match=r"crosses .* near \("):
        validate(draw_road(Sketch(points=points, widths=(0.6,) * 4), name="eight"))
