"""The film of how a run learned: fifteen seconds, every car where it was, and what each came to."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from racecraft.errors import ConfigError
from racecraft.film.evolution import HOLD, SECONDS, WIDTH, film_drives, frames
from racecraft.film.racing_line import SPEED_COLORS
from racecraft.run.evolution import Drive
from racecraft.track import load_track
from racecraft.track.picture import TrackPicture

OVAL = load_track("oval")


def along(step: int, share: float, seconds: float) -> Drive:
    """A drive on the centre line, so far, in so many seconds."""
    places = np.linspace(0.0, share * OVAL.length, round(15 * seconds))
    poses = np.column_stack([OVAL.point_at(places % OVAL.length), OVAL.heading_at(places % OVAL.length)])
    is_whole = share == 1.0
    return Drive(
        step=step,
        lap_time=seconds if is_whole else None,
        completion=share,
        poses=np.rint(1000 * poses).astype(np.int64),
    )


DRIVES = [along(100, 0.25, 4.0), along(2000, 1.0, 8.0)]


def test_cars_are_where_they_were_and_the_film_ends_with_what_each_came_to() -> None:
    pictures = [frame.copy() for frame in frames(DRIVES, OVAL, name="heron", medal="gold", rate=4)]
    assert len(pictures) == 4 * SECONDS
    assert all(picture.shape[1] == WIDTH and picture.shape[0] % 2 == 0 for picture in pictures)
    canvas = TrackPicture(OVAL, width_px=WIDTH).canvas
    first, best = SPEED_COLORS[0], SPEED_COLORS[-1]  # dark to bright, as it got better
    halfway = round(4 * (SECONDS - HOLD)) // 2  # the lap of 8 s is half over, that of 4 s ends
    for drive, color, share in ((DRIVES[0], first, 1.0), (DRIVES[1], best, 0.5)):
        x, y = canvas.to_pixels(drive.poses[round(share * (len(drive.poses) - 1)), :2] / 1000).round().astype(int)
        assert tuple(pictures[halfway][y, x]) == color
        assert tuple(pictures[0][y, x]) != color
    np.testing.assert_array_equal(pictures[-1], pictures[-2])  # all stand
    table = pictures[halfway][-80:].astype(int) - pictures[-1][-80:]
    assert (table[:, : WIDTH // 4] == 0).all()  # who left the road stays at its share
    assert (table[:, WIDTH // 4 : WIDTH // 2] != 0).any()


def test_it_is_a_film_of_fifteen_seconds(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import av

    monkeypatch.setattr("racecraft.film.evolution.RATE", 4)
    monkeypatch.setattr("racecraft.film.evolution.WIDTH", 320)
    monkeypatch.setattr("racecraft.film.evolution.frames", lambda *args, **_: frames(*args, rate=4))
    path = film_drives(DRIVES, OVAL, tmp_path / "deep" / "evolution.mp4")
    with av.open(str(path)) as film:
        (stream,) = film.streams.video
        assert stream.frames == 4 * SECONDS
        assert float(stream.average_rate or 0) == 4
    for drives, name in (([], "x.mp4"), (DRIVES, "x.gif")):
        with pytest.raises(ConfigError):
            film_drives(drives, OVAL, tmp_path / name)
