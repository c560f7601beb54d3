from __future__ import annotations

import dataclasses
import math
import pickle
from pathlib import Path

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from round_tracks import ring, track_of

from racecraft.errors import ShapeError, TrackError
from racecraft.track import Track, generate_track, load_track, polyline, track_names
from racecraft.track.readers import read_route, save_route

SOME = ["straight", "oval", "reinvent_2018", "lakeside", "bottleneck", "generated:3"]


def moved(track: Track, *, angle: float = 0.0, shift: tuple[float, float] = (0.0, 0.0), mirror: bool = False) -> Track:
    cos, sin = math.cos(angle), math.sin(angle)
    turn = np.array([[cos, sin], [-sin, cos]]) * (np.array([[1.0], [-1.0]]) if mirror else 1.0)
    lines = {name: getattr(track, name) @ turn + np.array(shift) for name in ("centerline", "inner", "outer")}
    return dataclasses.replace(track, **lines)


def test_arrays_are_float64_contiguous_and_read_only() -> None:
    rows = ring().astype(np.float32)
    track = track_of(rows)
    for line in (track.centerline, track.inner, track.outer, track.arc_length, track.widths):
        assert line.dtype == np.float64
        assert line.flags.c_contiguous
        assert not line.flags.writeable
    rows[:] = 0.0
    assert track.length > 1.0


def test_a_circle_has_its_length_width_radius_and_area() -> None:
    track = track_of(ring(2001, radius=3.0, width=0.8))
    assert track.is_closed
    assert track.length == pytest.approx(6 * math.pi, rel=1e-5)
    assert track.mean_width == pytest.approx(0.8)
    assert track.min_radius == pytest.approx(3.0, rel=1e-3)
    assert track.direction == "counter-clockwise"
    assert track.bounds == pytest.approx((-3.4, -3.4, 3.4, 3.4), abs=1e-4)
    assert track.curvature_at(np.linspace(0, 30, 99)) == pytest.approx(np.full(99, 1 / 3), rel=1e-3)


def test_the_width_is_that_of_the_road_also_where_rows_are_slanted() -> None:
    rows = ring(400, radius=3.0, width=0.8)
    for border, turned in ((slice(2, 4), 7), (slice(4, 6), -7)):
        rows[:-1, border] = np.roll(rows[:-1, border], turned, axis=0)
    rows[-1] = rows[0]
    assert np.hypot(*(rows[:, 2:4] - rows[:, 4:6]).T).min() > 1.0
    assert track_of(rows).widths == pytest.approx(np.full(400, 0.8), abs=1e-3)


def test_consecutive_duplicates_go_and_the_lap_still_closes() -> None:
    rows = ring(50)
    doubled = np.concatenate((rows[:1], rows[:20], rows[19:], rows[-1:]))
    track = track_of(doubled)
    assert len(track.centerline) == 50
    assert track.is_closed
    assert (np.diff(track.arc_length) > 0).all()
    assert track.digest == track_of(rows).digest
    assert track.repeats == (0, 19, 49)
    np.testing.assert_array_equal(track.waypoints, doubled[:, :2])


def test_waypoints_are_counted_as_the_route_has_them(tmp_path: Path) -> None:
    rows = ring(50)
    doubled = np.concatenate((rows[:20], rows[19:20], rows[19:]))  # row 19 three times
    forward = track_of(doubled)
    for track, points in ((forward, doubled[:, :2]), (forward.reversed(), doubled[::-1, :2])):
        np.testing.assert_array_equal(track.waypoints, points)
        # A piece lies between two neighbouring waypoints that are not the same point.
        np.testing.assert_array_equal(track.waypoints[track.waypoint_indices], track.centerline[:-1])
        np.testing.assert_array_equal(track.waypoints[track.waypoint_indices + 1], track.centerline[1:])
    assert forward.reversed().reversed().repeats == forward.repeats == (19, 19)
    written = read_route(save_route(forward, tmp_path / "ring.npy"))
    assert (written.repeats, written.digest) == (forward.repeats, forward.digest)
    assert track_of(rows).repeats == ()
    np.testing.assert_array_equal(track_of(rows).waypoint_indices, np.arange(49))


@pytest.mark.parametrize("name", SOME)
def test_projection_and_length_are_those_of_the_polyline(name: str) -> None:
    track = load_track(name)
    line = shapely.LineString(track.centerline)
    rng = np.random.default_rng(0)
    x_min, y_min, x_max, y_max = track.bounds
    points = rng.uniform((x_min - 1, y_min - 1), (x_max + 1, y_max + 1), (500, 2))
    s, offset = track.project(points)
    assert track.length == pytest.approx(line.length, rel=1e-12)
    assert s == pytest.approx(shapely.line_locate_point(line, shapely.points(points)), abs=1e-9)
    assert np.abs(offset) == pytest.approx(shapely.distance(line, shapely.points(points)), abs=1e-9)


@pytest.mark.parametrize("name", SOME)
def test_projection_undoes_a_step_to_the_side(name: str) -> None:
    track = load_track(name)
    s = np.linspace(0.1, track.length - 0.1, 200)
    heading = track.heading_at(s)
    normal = np.stack([-np.sin(heading), np.cos(heading)], axis=-1)
    side = np.random.default_rng(1).uniform(-0.2, 0.2, 200)
    found_s, found_offset = track.project(track.point_at(s) + side[:, None] * normal)
    assert found_offset == pytest.approx(side, abs=5e-3)
    assert found_s == pytest.approx(s, abs=0.05)


@pytest.mark.parametrize("name", SOME)
def test_projection_onto_a_long_line_gives_the_same_bits(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """By a tree of the pieces, and by looking at every piece; also halfway between two roads, and at corners."""
    track, rng = load_track(name), np.random.default_rng(7)
    low_x, low_y, high_x, high_y = track.bounds
    anywhere = rng.uniform((low_x - 1, low_y - 1), (high_x + 1, high_y + 1), (500, 2))
    queries = np.concatenate((anywhere, track.centerline, track.inner, anywhere.round(1), [[np.nan, 0.0]]))
    expected = track.project(queries)
    monkeypatch.setattr(polyline, "_MANY", 0)
    for found, value in zip(track.project(queries), expected, strict=True):
        np.testing.assert_array_equal(found, value)


def test_projection_takes_any_shape_and_passes_nan_on() -> None:
    track = load_track("oval")
    s, offset = track.project([1.0, 0.1])
    assert s.shape == offset.shape == ()
    s, _ = track.project(np.zeros((3, 4, 2)))
    assert s.shape == (3, 4)
    s, _ = track.project([[np.nan, 0.0], [0.0, 0.0]])
    assert np.isnan(s[0])
    assert np.isfinite(s[1])
    with pytest.raises(ShapeError, match=r"\(3,\)"):
        track.project([1.0, 2.0, 3.0])


@pytest.mark.parametrize("name", SOME)
def test_left_is_left(name: str) -> None:
    track = load_track(name)
    assert (track.project(track.left)[1] > 0).all()
    assert (track.project(track.right)[1] < 0).all()


@pytest.mark.parametrize("name", track_names())
def test_reversed_drives_the_same_road_the_other_way(name: str) -> None:
    track = load_track(name)
    back = track.reversed()
    s = np.linspace(0.0, track.length, 50)
    assert back.length == pytest.approx(track.length)
    assert back.direction != track.direction
    assert back.point_at(track.length - s) == pytest.approx(track.point_at(s), abs=1e-9)
    assert back.curvature_at(track.length - s) == pytest.approx(-track.curvature_at(s), abs=1e-9)
    assert (back.left == track.right[::-1]).all()
    assert (back.inner == track.inner[::-1]).all()
    assert back.reversed().digest == track.digest


@given(angle=st.floats(-3.2, 3.2), x=st.floats(-100, 100), y=st.floats(-100, 100), mirror=st.booleans())
@settings(max_examples=25, deadline=None)
def test_moving_a_track_moves_nothing_else(angle: float, x: float, y: float, mirror: bool) -> None:
    track = load_track("reinvent_2018")
    other = moved(track, angle=angle, shift=(x, y), mirror=mirror)
    s = np.linspace(0.0, 20.0, 77)
    sign = -1.0 if mirror else 1.0
    assert other.length == pytest.approx(track.length, rel=1e-9)
    assert other.mean_width == pytest.approx(track.mean_width, rel=1e-9)
    assert other.curvature_at(s) == pytest.approx(sign * track.curvature_at(s), abs=1e-7)
    assert (other.direction == track.direction) != mirror


@pytest.mark.parametrize("name", track_names())
def test_curvature_is_smooth_and_adds_up_to_the_turn(name: str) -> None:
    track = load_track(name)
    s = np.arange(0.0, track.length, 0.01)
    curvature = track.curvature_at(s)
    assert np.abs(np.diff(curvature)).max() < 0.15  # no jump within a centimetre
    if track.is_closed:
        sign = 1.0 if track.direction == "counter-clockwise" else -1.0
        assert curvature.mean() * track.length == pytest.approx(sign * 2 * math.pi, rel=2e-3)


def test_everything_goes_round_a_closed_track_and_stops_at_the_ends_of_an_open_one() -> None:
    oval, straight = load_track("oval"), load_track("straight")
    s = np.array([0.3, 5.0, 11.0])
    for of in ("point_at", "heading_at", "width_at", "curvature_at"):
        assert getattr(oval, of)(s + 3 * oval.length) == pytest.approx(getattr(oval, of)(s), abs=1e-9)
        assert getattr(oval, of)(s - oval.length) == pytest.approx(getattr(oval, of)(s), abs=1e-9)
    assert straight.point_at([-5.0, 99.0]) == pytest.approx(np.array([[0.0, 0.0], [15.0, 0.0]]))
    assert straight.curvature_at([-5.0, 0.0, 7.0, 99.0]) == pytest.approx(np.zeros(4))
    assert straight.min_radius == math.inf


def test_heading_at_a_waypoint_looks_to_the_next_one() -> None:
    track = load_track("reinvent_2018")
    step = np.diff(track.centerline, axis=0)
    expected = np.arctan2(step[:, 1], step[:, 0])
    found = track.heading_at(track.arc_length[:-1])
    assert np.cos(found - expected) == pytest.approx(np.ones(len(expected)))


def test_digest_is_of_the_geometry_alone() -> None:
    track = load_track("oval")
    assert dataclasses.replace(track, name="other").digest == track.digest
    assert moved(track, shift=(1e-6, 0.0)).digest != track.digest
    assert pickle.loads(pickle.dumps(track)).digest == track.digest
    assert len(track.digest) == 64


def test_negative_zero_is_zero() -> None:
    rows = ring(40)
    rows[np.abs(rows) < 1e-12] = 0.0
    negative = rows.copy()
    negative[rows == 0.0] = -0.0
    assert track_of(negative).digest == track_of(rows).digest


@pytest.mark.parametrize(
    ("change", "error", "words"),
    [
        (lambda rows: rows[:, :4], ShapeError, "expected"),
        (lambda rows: rows[:1], TrackError, "at least two"),
        (lambda rows: np.repeat(rows[:1], 9, axis=0), TrackError, "at least two"),
        (lambda rows: np.where(np.arange(len(rows))[:, None] == 7, np.nan, rows), TrackError, r"centerline\[7\]"),
        (lambda rows: rows + np.inf, TrackError, "finite"),
    ],
)
def test_no_track_is_made_of_nonsense(change, error, words) -> None:
    rows = change(ring())
    with pytest.raises(error, match=words):
        Track(name="bad", centerline=rows[:, :2], inner=rows[:, 2:4], outer=rows[:, 4:])


def test_what_is_no_array_is_no_line() -> None:
    rows = ring()
    with pytest.raises(ShapeError, match=r"inner of track 'bad' is 'left'; use an array \(W, 2\), metres\."):
        Track(name="bad", centerline=rows[:, :2], inner="left", outer=rows[:, 4:])  # type: ignore[arg-type]


def test_repr_is_short() -> None:
    assert repr(load_track("oval")) == ("Track('oval', 16.79 m x 0.90 m, closed, counter-clockwise, 113 waypoints)")


def test_waypoints_of_generated_tracks_are_evenly_spaced() -> None:
    step = np.diff(generate_track(5).arc_length)
    assert step.max() / step.min() < 1.02
    assert step.mean() == pytest.approx(0.15, rel=0.02)
