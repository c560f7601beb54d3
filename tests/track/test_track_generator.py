from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from racecraft.errors import TrackError
from racecraft.track import Track, find_corners, generate_track, load_track, validate


def check(track: Track) -> None:
    validate(track)
    assert track.is_closed
    assert track.min_radius > 0.68
    assert track.min_radius > track.mean_width / 2 + 0.1
    assert np.ptp(track.widths) < 1e-4


@pytest.mark.costly
def test_three_hundred_seeds_are_valid_and_all_different() -> None:
    digests = set()
    for seed in range(300):
        track = generate_track(seed, difficulty=seed % 5 / 4)
        check(track)
        digests.add(track.digest)
    assert len(digests) == 300


@pytest.mark.costly
@given(
    seed=st.integers(0, 2**63 - 1),
    width=st.floats(0.5, 2.0),
    laps=st.floats(0.0, 1.0),
    difficulty=st.floats(0.0, 1.0),
)
@settings(max_examples=60, deadline=None)
def test_any_wish_is_met(seed: int, width: float, laps: float, difficulty: float) -> None:
    shortest = max(12.0, 14.0 * width)
    length = min(200.0, shortest * (1 + 1e-9) + laps * 60)
    track = generate_track(seed, length=length, width=width, difficulty=difficulty)
    check(track)
    assert track.length == pytest.approx(length, rel=0.01)
    assert track.mean_width == pytest.approx(width, rel=1e-3)
    assert load_track(track.name).digest == track.digest


def test_the_same_seed_is_the_same_track_for_ever() -> None:
    assert generate_track(7).digest == generate_track(7).digest == load_track("generated:7").digest
    assert generate_track(7).name == "generated:7"
    assert generate_track(7, length=40).name == "generated:7,length=40"
    assert round(generate_track(7).length, 3) == pytest.approx(24.268, abs=0.02)


def test_difficulty_means_more_and_tighter_corners() -> None:
    seeds = range(40)
    easy = [generate_track(seed, length=40, difficulty=0.0) for seed in seeds]
    hard = [generate_track(seed, length=40, difficulty=1.0) for seed in seeds]
    assert np.mean([len(find_corners(t)) for t in hard]) > 1.5 * np.mean([len(find_corners(t)) for t in easy])
    assert np.median([t.min_radius for t in hard]) < np.median([t.min_radius for t in easy])


def test_both_directions_come_up() -> None:
    clockwise = sum(generate_track(seed).direction == "clockwise" for seed in range(60))
    assert 15 < clockwise < 45


@pytest.mark.parametrize(
    ("seed", "options", "words"),
    [
        (-1, {}, "seed is -1"),
        (1.5, {}, "seed is 1.5"),
        (True, {}, "seed is True"),
        ("7", {}, "seed"),
        (2**63, {}, "seed"),
        (1, {"length": 5}, "length is 5"),
        (1, {"length": float("nan")}, "length is nan"),
        (1, {"length": 20, "width": 2}, "14 times"),
        (1, {"width": 0}, "width is 0"),
        (1, {"difficulty": 1.1}, "difficulty is 1.1"),
        (1, {"difficulty": None}, "difficulty is None; allowed are 0 to 1"),
        (1, {"verge": "a"}, "verge is 'a'; allowed are 0.1 to 1"),
    ],
)
def test_what_cannot_be_is_refused(seed, options, words) -> None:
    with pytest.raises(TrackError, match=words):
        generate_track(seed, **options)


@pytest.mark.parametrize(
    "name", ["generated:", "generated:x", "generated:-1", "generated:1,size=3", "generated:1,length=", "generated:1,",
             "generated:" + "9" * 500, "generated:1,length=nan", "generated:²"]
)  # fmt: skip
def test_names_that_say_nothing_are_refused(name: str) -> None:
    with pytest.raises(TrackError):
        load_track(name)


def test_a_radius_makes_bends_as_tight_as_official_ones():
    tight = [generate_track(seed, radius=0.45, width=0.75, difficulty=0.9) for seed in range(12)]
    radii = [track.min_radius for track in tight]
    assert min(radii) > 0.42
    assert np.median(radii) < 0.62 < 0.69 < min(generate_track(seed, difficulty=0.9).min_radius for seed in range(12))
    for track in tight:
        validate(track)
        assert load_track(track.name).digest == track.digest
    assert tight[0].name == "generated:0,width=0.75,difficulty=0.9,radius=0.45"


@pytest.mark.parametrize("radius", [0.3, 6.0, math.nan, -1.0])
def test_radii_that_are_refused(radius):
    with pytest.raises(TrackError, match=r"radius is .*; allowed are 0.35 to 5"):
        generate_track(1, radius=radius)


def least_ground_and_sharpest_turn(track: Track) -> tuple[float, float]:
    """Between two stretches of road, metres, and within 2.6 m of it, radians."""
    s = np.arange(0.0, track.length, 0.05)
    points = track.point_at(s)
    distance = np.hypot(*(points[:, None] - points[None]).transpose(2, 0, 1))
    apart = np.abs(s[:, None] - s[None])
    is_elsewhere = np.minimum(apart, track.length - apart) > math.pi / 2 * (track.mean_width + 1.0)
    heading = np.concatenate([[0.0], np.cumsum(track.curvature_at(s)) * 0.05])
    turned = np.abs(heading[52:] - heading[:-52])
    return float(distance[is_elsewhere].min()) - track.mean_width, float(turned.max())


@pytest.mark.costly
def test_a_verge_folds_the_road_and_is_kept():
    options = {"width": 1.07, "radius": 0.45, "difficulty": 1}
    folded = [generate_track(seed, verge=0.3, **options) for seed in range(16)]
    ground, turns = zip(*map(least_ground_and_sharpest_turn, folded), strict=True)
    others, their_turns = zip(
        *(least_ground_and_sharpest_turn(generate_track(seed, **options)) for seed in range(16)), strict=True
    )
    assert min(ground) > 0.3
    assert np.median(ground) < 0.65 < np.median(others)
    assert np.median(turns) > math.radians(160) > np.median(their_turns)
    for track in folded:
        validate(track)
        assert load_track(track.name).digest == track.digest
    assert folded[0].name == "generated:0,width=1.07,difficulty=1,radius=0.45,verge=0.3"


def test_any_verge_is_kept():
    for seed in range(12):
        track = generate_track(seed, verge=1.0, width=0.5 + seed % 4 / 2, difficulty=seed / 11)
        validate(track)
        assert least_ground_and_sharpest_turn(track)[0] > 0.98


@pytest.mark.parametrize("verge", [0.05, 1.5, math.nan, 0.0])
def test_verges_that_are_refused(verge):
    with pytest.raises(TrackError, match=r"verge is .*; allowed are 0.1 to 1"):
        generate_track(1, verge=verge)
