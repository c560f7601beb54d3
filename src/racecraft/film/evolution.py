"""`film_drives`: many laps as cars on one road at the same time, seen from above: fifteen seconds to be sent around.

picture of the road -> + their lines, as far as they have come -> + cars -> + who is where -> frames
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import cache
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from racecraft.errors import ConfigError, RunError
from racecraft.film.encoding import write_video
from racecraft.film.lettering import Lettering, Mask, blend, disc_mask
from racecraft.film.racing_line import speed_color
from racecraft.run.evolution import Drive
from racecraft.sim.simulation import CONTROL_DT
from racecraft.track import Track
from racecraft.track.canvas import Color
from racecraft.track.picture import TrackPicture, describe
from racecraft.track.road_art import INK, SOFT_INK

RATE: Final = 30
"""Pictures a second."""
SECONDS: Final = 15.0
HOLD: Final = 2.5
"""s at the end in which all stand where they came to."""
WIDTH: Final = 960
LENGTH: Final = 0.34  # m, of a car
BREADTH: Final = 0.2  # m
SMALLEST: Final = 15  # pixels, of a car's length: it is seen on the longest road, too
COLUMNS: Final = 4
LATEST: Final = 1.15
"""Times the slowest whole lap, after which the film does not wait for who has not arrived."""

_ROW, _RESULT = Lettering(15), Lettering(15, weight=0.03)


def film_drives(drives: Sequence[Drive], track: Track, path: str | Path, *, name: str = "", medal: str = "") -> Path:
    """Write the film.

    Args:
        drives: From the first to the best, which is drawn on top; one at least.
        track: In driving direction.
        path: Where to, ending in ``.mp4``.
        name: The model's.
        medal: Of the last one's lap, if any.

    Raises:
        ConfigError: There are no drives, or the path does not end in .mp4.
        RunError: The file cannot be written.
    """
    path = Path(path)
    if path.suffix.lower() != ".mp4":
        raise ConfigError(f"Cannot write a video to {path.name!r}; the name must end in .mp4.")
    if not drives:
        raise ConfigError("There are no laps to film.")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise RunError(f"{path} cannot be written: {error.strerror or error}.") from error
    write_video(frames(drives, track, name=name, medal=medal), path, rate=RATE)
    return path


def colors_of(count: int) -> list[Color]:
    """A colour for each of so many drives, from the first to the best."""
    return [speed_color(place / max(count - 1, 1)) for place in range(count)]


def frames(
    drives: Sequence[Drive], track: Track, *, name: str = "", medal: str = "", rate: int = RATE
) -> Iterator[NDArray[np.uint8]]:
    """The frames, RGB (height, width, 3), each in the same array: copy what must last."""
    picture = TrackPicture(track, width_px=WIDTH, has_numbers=False)
    title, _ = describe(track)
    picture.caption(title=name or title, subtitle=f"How it learned, on {title}", figures=(), has_scale=False)
    sheet = np.asarray(picture.image())[: picture.size[1] // 2 * 2].copy()
    colors = colors_of(len(drives))
    size = max(LENGTH * picture.canvas.scale, SMALLEST)
    ways = [picture.canvas.to_pixels(drive.poses[:, :2] / 1000.0) for drive in drives]
    turns = [np.unwrap(drive.poses[:, 2] / 1000.0) for drive in drives]
    shares = [_shares(drive, track) for drive in drives]
    ink, frame = disc_mask(max(1.2, 0.05 * size)), np.empty_like(sheet)
    end, count = _end(drives), round(rate * (SECONDS - HOLD))
    drawn = [0] * len(drives)
    for index in range(round(rate * SECONDS)):
        now = end * min(index / count, 1.0)
        places = [min(now / CONTROL_DT, len(way) - 1.0) for way in ways]
        for number, (way, place) in enumerate(zip(ways, places, strict=True)):
            _trace(sheet, way[drawn[number] : int(place) + 1], ink, colors[number])
            drawn[number] = int(place)
        frame[:] = sheet
        for way, turn, place, color in zip(ways, turns, places, colors, strict=True):
            steps = np.arange(len(way))
            x, y = (float(np.interp(place, steps, axis)) for axis in way.T)
            _car(frame, x, y, float(np.interp(place, steps, turn)), size, color)
        reached = [float(share[int(place)]) for share, place in zip(shares, places, strict=True)]
        _table(frame, drives, reached, colors, medal)
        yield frame


def _end(drives: Sequence[Drive]) -> float:
    """Seconds on the road that are shown."""
    whole = [drive.lap_time for drive in drives if drive.lap_time is not None]
    longest = CONTROL_DT * max(len(drive.poses) - 1 for drive in drives)
    return min(longest, LATEST * max(whole)) if whole else longest


def _shares(drive: Drive, track: Track) -> NDArray[np.float64]:
    """Share of the lap driven at every step; 1 only where a whole lap ends  (T,)."""
    along = track.project(drive.poses[:, :2] / 1000.0)[0]
    driven = (
        (np.unwrap(along, period=track.length) - along[0]) / track.length if track.is_closed else along / track.length
    )
    shares = np.maximum.accumulate(np.clip(driven, 0.0, 0.999))
    if drive.lap_time is not None:
        shares[-1] = 1.0
    return np.asarray(shares)


def _trace(sheet: NDArray[np.uint8], way: NDArray[np.float64], mask: Mask, color: Color) -> None:
    """A line through some places, in dots that touch."""
    for (x0, y0), (x1, y1) in zip(way[:-1].tolist(), way[1:].tolist(), strict=True):
        for share in np.linspace(0.0, 1.0, max(2, round(np.hypot(x1 - x0, y1 - y0) / 2)), endpoint=False).tolist():
            x, y = x0 + share * (x1 - x0), y0 + share * (y1 - y0)
            blend(sheet, round(x) - mask.shape[1] // 2, round(y) - mask.shape[0] // 2, mask, color)


def _car(frame: NDArray[np.uint8], x: float, y: float, heading: float, size: float, color: Color) -> None:
    for grown, paint in ((1.35, INK), (1.0, color)):
        mask = _body(round(4 * size * grown), round(np.degrees(heading)) % 360)
        blend(frame, round(x) - mask.shape[1] // 2, round(y) - mask.shape[0] // 2, mask, paint)


@cache
def _body(quarters: int, degrees: int) -> Mask:
    """A car from above, so many quarters of a pixel long."""
    length = quarters / 4
    half, breadth = length / 2, length * BREADTH / LENGTH / 2
    reach = int(np.ceil(half)) + 2
    grid = np.arange(-reach, reach + 1)
    cosine, sine = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    along = grid[None, :] * cosine - grid[:, None] * sine
    across = grid[None, :] * sine + grid[:, None] * cosine
    round_by = 0.6 * breadth
    outside = np.hypot(
        np.maximum(np.abs(along) - half + round_by, 0.0), np.maximum(np.abs(across) - breadth + round_by, 0.0)
    )
    return np.asarray((256 * np.clip(round_by + 0.5 - outside, 0.0, 1.0)).astype(np.uint16)[..., None])


def _table(
    frame: NDArray[np.uint8], drives: Sequence[Drive], reached: Sequence[float], colors: Sequence[Color], medal: str
) -> None:
    """Below the road: after how many steps of training each drove, and how far it has come."""
    left, top = 0.05 * WIDTH, frame.shape[0] - 0.075 * WIDTH
    wide = (WIDTH - 2 * left) / COLUMNS
    dot = disc_mask(6.0)
    for number, (drive, share, color) in enumerate(zip(drives, reached, colors, strict=True)):
        x, y = left + wide * (number % COLUMNS), top + 26 * (number // COLUMNS)
        blend(frame, round(x), round(y) - 12, dot, color)
        result = f"{drive.lap_time:.2f} s" if share == 1.0 else f"{100 * share:.0f} %"
        if medal and share == 1.0 and number == len(drives) - 1:
            result += f", {medal}"
        words = f"{drive.step:,} steps"
        _ROW.draw(frame, x + 20, y, words, SOFT_INK)
        _RESULT.draw(frame, x + 26 + _ROW.width(words), y, result, INK)
