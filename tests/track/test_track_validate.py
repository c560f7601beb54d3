from __future__ import annotations

import time

import numpy as np
import pytest
from round_tracks import ring, track_of

from racecraft.errors import TrackError
from racecraft.track import Track, validate
from racecraft.track.validate import MAX_WAYPOINTS, _check_crossings, check_rows


def bad(rows: np.ndarray, words: str) -> None:
    with pytest.raises(TrackError, match=words):
        validate(track_of(rows))


def changed(place: object, value: object) -> np.ndarray:
    rows = ring()
    rows[place] = value  # type: ignore[index]
    return rows


def test_a_ring_is_good_both_ways_and_open() -> None:
    validate(track_of(ring()))
    validate(track_of(ring()).reversed())
    validate(track_of(ring(turns=0.7)))
    swapped = ring(turns=0.7)[:, [0, 1, 4, 5, 2, 3]]
    validate(track_of(swapped))  # an open road has no inside, so either border may be called inner


def test_too_few_and_too_many_points() -> None:
    bad(ring()[:2], "2 waypoints")
    bad(ring(4), "3 different")
    bad(ring(50_000), "at most 10,000")
    validate(track_of(ring(MAX_WAYPOINTS, radius=200.0)))


def test_duplicates() -> None:
    rows = np.repeat(ring(100)[:, :2], 2, axis=0)
    with pytest.raises(TrackError, match="repeats 100 of its 200"):
        check_rows({"centerline": rows}, name="test")
    check_rows({"centerline": np.concatenate((rows[:1], ring(100)[:, :2]))}, name="test")


def test_far_away() -> None:
    bad(ring() + 1e9, "within 10,000")
    bad(ring(radius=1e9), "within 10,000")


def test_too_short() -> None:
    bad(ring(radius=0.1, width=0.15), "long")


@pytest.mark.parametrize(("width", "words"), [(0.0, "0 m wide"), (0.05, "at least 0.1"), (300.0, "at most 100")])
def test_width(width: float, words: str) -> None:
    bad(ring(radius=400.0, width=width), words)


def test_zero_width_at_one_place() -> None:
    rows = ring()
    rows[17, 2:] = np.tile(rows[17, :2], 2)
    bad(rows, "0 m wide at waypoint 17")


def test_negative_width_is_borders_swapped() -> None:
    bad(ring(width=-1.0), "inner border does not lie inside")


def test_borders_shifted_along_the_track() -> None:
    rows = ring()
    rows[:, 2:] = np.roll(rows[:-1, 2:], 50, axis=0)[np.r_[0:99, 0]]
    bad(rows, "face each other")


def test_border_running_backwards() -> None:
    rows = ring()
    rows[:, 4:] = rows[::-1, 4:]
    bad(rows, "face each other|wide|opposite directions")


def test_centre_line_crossing_itself() -> None:
    angle = np.linspace(0, 2 * np.pi, 200)
    centre = np.stack([4 * np.sin(angle), 2 * np.sin(2 * angle)], axis=1)
    centre[-1] = centre[0]
    tangent = np.gradient(centre, axis=0)
    tangent[-1] = tangent[0]
    normal = np.stack([-tangent[:, 1], tangent[:, 0]], axis=1) / np.hypot(*tangent.T)[:, None]
    bad(
        np.concatenate((centre, centre + 0.3 * normal, centre - 0.3 * normal), axis=1), "crosses or touches itself near"
    )


def test_border_crossing_itself() -> None:
    rows = ring(radius=0.4, width=1.2)  # the inner border has turned inside out
    rows[10:30, 2:4] = rows[29:9:-1, 2:4]
    bad(rows, "border|face")


def test_border_crossing_centre_line() -> None:
    rows = ring()
    rows[40:44, 2:4] = rows[40:44, :2] * 1.01
    bad(rows, "centre line crosses its inner border near")


def test_borders_of_two_stretches_of_road_crossing() -> None:
    # a spiral whose second turn lies half on the first
    angle = np.linspace(0, 3.5 * np.pi, 300)
    radius = 3.0 + 0.3 * angle / (2 * np.pi)
    unit = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    rows = np.concatenate([unit * (radius + d)[:, None] for d in (0.0, -0.5, 0.5)], axis=1)
    bad(rows, "crosses its|its ends cross")


def test_neither_open_nor_closed() -> None:
    bad(ring()[:-1], "neither open nor closed")


def test_border_that_does_not_close() -> None:
    rows = ring()
    rows[-1, 4] += 0.2
    bad(rows, "does not end where it begins")


def test_doubling_back() -> None:
    bad(changed((50, slice(None)), ring()[46] * 1.001), "degrees|crosses|face")


@pytest.mark.parametrize("num_points", [2_000, MAX_WAYPOINTS])
@pytest.mark.parametrize("kind", ["scribble", "comb", "star", "spiral"])
def test_never_hangs(kind: str, num_points: int) -> None:
    rng = np.random.default_rng(0)
    index = np.arange(num_points)
    if kind == "scribble":
        centre = rng.uniform(0, 1000, (num_points, 2))
    elif kind == "comb":  # every piece's box overlaps every other's, and none crosses
        centre = np.stack([index * 0.05 + (index % 2) * 900, (index % 2) * 900.0], axis=1)
    elif kind == "star":
        angle = index * 2.4
        centre = np.stack([500 * np.cos(angle), 500 * np.sin(angle)], axis=1)
    else:
        angle = np.sqrt(index + 1.0) * 3
        centre = np.stack([angle * np.cos(angle), angle * np.sin(angle)], axis=1)
    side = np.array([0.5, 0.0])
    track = Track(name=kind, centerline=centre, inner=centre - side, outer=centre + side)
    start = time.process_time()
    with pytest.raises(TrackError):
        validate(track)
    if num_points == 2_000:  # the search for crossings is quick also without the cheap checks before it
        with pytest.raises(TrackError):
            _check_crossings(track)
    assert time.process_time() - start < 8.0
