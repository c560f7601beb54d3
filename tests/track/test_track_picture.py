from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from racecraft.errors import ConfigError, TrackError
from racecraft.track import TrackPicture, draw_contact_sheet, draw_track, generate_track, load_track, track_names
from racecraft.track.canvas import Canvas, text_width
from racecraft.track.road_art import ROAD, Ribbon


def test_a_picture_is_written(tmp_path: Path) -> None:
    path = draw_track(load_track("reinvent_2018"), tmp_path / "track.png", width_px=640)
    with Image.open(path) as image:
        assert image.size[0] == 640
        assert image.mode == "RGB"


@pytest.mark.parametrize("name", ["reinvent_2018", "harbor", "alpine_pass", "straight"])
def test_the_road_lies_where_the_transform_says(name: str) -> None:
    track = load_track(name)
    picture = TrackPicture(track, width_px=600)
    pixels = np.asarray(picture.image())
    assert pixels.shape == (picture.size[1], picture.size[0], 3)
    # a quarter of the way to the border there is bare asphalt, but for the start line and its arrows
    s = np.linspace(2.5, track.length - 0.5, 60)
    heading = track.heading_at(s)
    side = track.width_at(s)[:, None] / 4 * np.stack([-np.sin(heading), np.cos(heading)], axis=1)
    x, y = picture.canvas.to_pixels(track.point_at(s) + side).T
    assert (np.abs(pixels[y.astype(int), x.astype(int)].astype(int) - ROAD).max(axis=1) < 25).mean() > 0.9


@pytest.mark.parametrize("name", track_names())
def test_words_never_touch_the_road(name: str) -> None:
    track = load_track(name)
    plain = TrackPicture(track, width_px=400, has_numbers=False)
    numbered = TrackPicture(track, width_px=400)
    numbered.caption()
    before, after = (np.asarray(picture.image()).astype(int) for picture in (plain, numbered))
    y, x = np.nonzero(np.abs(before - after).max(axis=2) > 8)
    canvas = plain.canvas
    places = np.stack([x + 0.5 - canvas.origin[0], canvas.origin[1] - y - 0.5], axis=1) / canvas.scale
    s, offset = track.project(places)
    ends = (s <= 0.0) | (s >= track.length) if not track.is_closed else np.zeros(len(s), dtype=bool)
    assert (np.abs(offset)[~ends] > track.width_at(s)[~ends] / 2).all()


def test_lines_can_be_laid_over_the_road() -> None:
    track = load_track("oval")
    picture = TrackPicture(track, width_px=500)
    points = track.point_at(np.linspace(0, 3, 20))
    picture.canvas.line(points, (255, 0, 0), width_px=4)
    picture.canvas.line(points + 1.0, (0, 0, 0), width_px=4, colors=[(0, 0, 255)] * 19)
    pixels = np.asarray(picture.image())
    x, y = picture.canvas.to_pixels(points[10]).astype(int)
    assert tuple(pixels[y, x]) == (255, 0, 0)


def test_contact_sheet(tmp_path: Path) -> None:
    tracks = [load_track("oval"), generate_track(3), load_track("straight")]
    path = draw_contact_sheet(tracks, tmp_path / "sheet.png", columns=2, width_px=500, title="A title")
    with Image.open(path) as image:
        assert image.size[0] == 500


def test_a_long_title_is_cut_to_fit(tmp_path: Path) -> None:
    picture = TrackPicture(load_track("oval"), width_px=400)
    picture.caption(title="A very long title " * 40, subtitle="", figures=[("ONE", "1")])
    picture.save(tmp_path / "long.png")


@pytest.mark.parametrize("anchor", ["ls", "mm", "rt"])
@pytest.mark.parametrize("spacing", [0.0, 0.2])
@pytest.mark.parametrize(("letter", "base"), list(zip("äöüÄÖÜ", "aouAOU", strict=True)))
def test_an_umlaut_is_its_letter_and_two_dots(letter: str, base: str, anchor: str, spacing: float) -> None:
    inks = []
    for words in (f"n{base}n", f"n{letter}n"):
        canvas = Canvas((300, 200), scale=1.0, origin=(0.0, 0.0), background=(255, 255, 255))
        width = canvas.text((150, 100), words, (0, 0, 0), size=60, anchor=anchor, spacing=spacing)
        assert width == text_width(words, size=60, spacing=spacing) == text_width(f"n{base}n", size=60, spacing=spacing)
        inks.append(np.asarray(canvas.finish().convert("L")) < 128)
    plain, dotted = inks
    assert not (plain & ~dotted).any(), "the letter itself is as it was"
    rows, columns = np.nonzero(dotted & ~plain)
    top = rows.max() + np.argmax(plain[rows.max() :, columns.min() : columns.max() + 1].any(axis=1))
    assert 0 < top - rows.max() < 12, "just above it"
    left, right = columns[columns < columns.mean()], columns[columns > columns.mean()]
    assert left.max() + 2 < right.min(), "two of them"
    assert len(left) == pytest.approx(len(right), rel=0.2)


@pytest.mark.parametrize("name", ["track.txt", "track", "track.svg"])
def test_wrong_endings(tmp_path: Path, name: str) -> None:
    with pytest.raises(TrackError, match="must end in"):
        draw_track(load_track("oval"), tmp_path / name)
    with pytest.raises(ConfigError, match="path is 5; use a file's path"):
        draw_track(load_track("oval"), 5)  # type: ignore[arg-type]


@pytest.mark.costly
def test_a_picture_that_cannot_be_written_is_told(tmp_path: Path) -> None:
    (tmp_path / "taken.png").mkdir()
    for name, why in (("nowhere/a.png", "No such file"), ("taken.png", "Is a directory")):
        with pytest.raises(TrackError, match=rf"{name} cannot be written: {why}"):
            draw_track(load_track("oval"), tmp_path / name)
        with pytest.raises(TrackError, match=rf"{name} cannot be written: {why}"):
            draw_contact_sheet([load_track("oval")], tmp_path / name)


@pytest.mark.parametrize("width_px", [0, -5, 100, 10**9, None, "640", 640.5])
def test_wrong_sizes(tmp_path: Path, width_px: Any) -> None:
    with pytest.raises(TrackError, match="allowed are 320 to 6000"):
        draw_track(load_track("oval"), tmp_path / "track.png", width_px=width_px)
    with pytest.raises(TrackError, match="allowed are"):
        draw_contact_sheet([load_track("oval")], tmp_path / "track.png", width_px=width_px)
    with pytest.raises(TrackError, match="at least one"):
        draw_contact_sheet([], tmp_path / "track.png")


def test_places_of_numbers_are_looked_for_among_the_nearest_borders_and_are_apart_from_all() -> None:
    track = load_track("reinvent_2018")
    picture = TrackPicture(track, width_px=400, has_numbers=False)
    picture._area = (-math.inf, -math.inf, math.inf, math.inf)
    x_min, y_min, x_max, y_max = track.bounds
    places = np.random.default_rng(1).uniform((x_min - 0.5, y_min - 0.5), (x_max + 0.5, y_max + 0.5), (400, 2))
    s, offset = track.project(places)
    near = 0.4 * float(track.mean_width)
    borders = np.concatenate((Ribbon(track).left, Ribbon(track).right))
    apart = np.hypot(*(places[:, None] - borders).T).min(axis=0) >= 0.9 * near
    is_free = apart & (np.abs(offset) > track.width_at(s) / 2)
    found = [picture._is_free(place, near) for place in places]
    assert 100 < sum(found) < 350
    assert found == is_free.tolist()
