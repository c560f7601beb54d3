from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import shapely

from racecraft.errors import TrackError, TrackNotFound
from racecraft.track import course, find_corners, load_track, track_names, validate
from racecraft.track.curve import trace_corners

NAMES = track_names()


def test_there_are_enough_and_the_promised_ones() -> None:
    assert len(NAMES) >= 14
    assert {"oval", "bowtie", "reinvent_2018", "hairpin", "straight", "grand_circuit", "speedway"} <= set(NAMES)
    difficulties = [course(name).difficulty for name in NAMES]
    assert difficulties == sorted(difficulties)
    assert {load_track(name).direction for name in NAMES} == {"clockwise", "counter-clockwise"}
    assert max(load_track(name).length for name in NAMES) > 50.0
    assert not all(load_track(name).is_closed for name in NAMES)
    assert len({load_track(name).digest for name in NAMES}) == len(NAMES)


@pytest.mark.parametrize("name", NAMES)
def test_is_valid_and_drivable(name: str) -> None:
    track, design = load_track(name), course(name)
    validate(track)
    assert re.fullmatch(r"[a-z][a-z0-9_]*", name)
    assert design.display_name
    assert design.description.endswith(".")
    assert 1 <= design.difficulty <= 5
    assert track.min_radius > 0.7
    assert track.min_radius > 1.25 * track.widths.max() / 2
    assert 0.13 < np.diff(track.arc_length).mean() < 0.17


@pytest.mark.parametrize("name", NAMES)
def test_no_two_stretches_of_road_come_close(name: str) -> None:
    track = load_track(name)
    road = (
        shapely.Polygon(track.outer, [track.inner])
        if track.is_closed
        else shapely.Polygon(np.concatenate((track.inner, track.outer[::-1])))
    )
    for verge in (0.05, 0.1, 0.2):
        assert len(road.buffer(verge).interiors) == int(track.is_closed)


@pytest.mark.parametrize("name", NAMES)
def test_starts_on_a_straight(name: str) -> None:
    track = load_track(name)
    assert np.abs(track.curvature_at(np.linspace(-0.5, 0.8, 20))).max() < 0.2


def test_the_2018_track_has_its_published_dimensions() -> None:
    track = load_track("reinvent_2018")
    x_min, y_min, x_max, y_max = track.bounds
    assert track.length == pytest.approx(17.71, rel=0.005)
    assert track.mean_width == pytest.approx(0.762, abs=1e-4)
    assert track.direction == "counter-clockwise"
    assert (x_max - x_min, y_max - y_min) == pytest.approx((7.34, 4.59), abs=0.05)


def test_widths_may_vary() -> None:
    widths = load_track("bottleneck").widths
    assert widths.min() == pytest.approx(0.7, abs=0.01)
    assert widths.max() == pytest.approx(1.2, abs=0.01)


def test_the_same_object_twice() -> None:
    assert load_track("oval") is load_track("oval")


def test_a_misspelt_name_is_answered_with_the_right_one() -> None:
    with pytest.raises(TrackNotFound, match="'reinvent_2081' does not exist") as error:
        load_track("reinvent_2081")
    assert "reinvent_2018" in error.value.hint
    with pytest.raises(TrackNotFound):
        course("nothing like it")


def test_a_folder_is_no_track(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mine").mkdir()
    with pytest.raises(TrackNotFound, match="'mine' is a folder; here one track is wanted"):
        load_track("mine")
    for name in ("x" * 5000, "a\0b"):
        with pytest.raises(TrackNotFound, match="does not exist"):
            load_track(name)


def test_corners_without_room_are_refused() -> None:
    with pytest.raises(TrackError, match="smaller radii"):
        trace_corners([(4, 0, 2), (4, 3, 2), (0, 3, 1), (0, 0, 1)])


@pytest.mark.parametrize(("name", "count"), [("straight", 0), ("oval", 2), ("delta", 3), ("reinvent_2018", 5)])
def test_corners_are_found(name: str, count: int) -> None:
    track = load_track(name)
    corners = find_corners(track)
    assert len(corners) == count
    for corner in corners:
        assert 0 <= corner.start < track.length
        assert corner.start < corner.end < corner.start + track.length
        assert 0 <= corner.apex < track.length
        assert corner.radius >= track.min_radius - 0.05
    turns = sum(corner.turn for corner in corners)
    assert turns == pytest.approx(2 * np.pi if track.is_closed else 0.0, abs=0.25)


def test_a_corner_may_span_the_start() -> None:
    track = load_track("oval")
    rolled = np.concatenate(
        [np.roll(getattr(track, line)[:-1], -20, axis=0) for line in ("centerline", "inner", "outer")], axis=1
    )
    rolled = np.concatenate((rolled, rolled[:1]))
    other = type(track)(name="rolled", centerline=rolled[:, :2], inner=rolled[:, 2:4], outer=rolled[:, 4:])
    for shifted, corner in zip(
        sorted(c.radius for c in find_corners(other)), sorted(c.radius for c in find_corners(track)), strict=True
    ):
        assert shifted == pytest.approx(corner, rel=0.05)


def test_loading_by_name_imports_nothing_heavy() -> None:
    code = (
        "import sys; from racecraft.track import load_track; load_track('oval'); load_track('generated:1');"
        "print([m for m in ('scipy', 'shapely', 'PIL', 'torch') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
