"""The picture of a racing line: where a car drove, coloured by its speed, over the picture of the track."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from racecraft.checks import check_path, check_type
from racecraft.errors import ConfigError
from racecraft.race.recording import Recording
from racecraft.race.rules import RESET_STATUSES
from racecraft.track.canvas import Canvas, Color
from racecraft.track.picture import TrackPicture, describe

SPEED_COLORS: Final[tuple[Color, ...]] = (
    (88, 72, 226),
    (168, 62, 204),
    (236, 72, 132),
    (255, 140, 66),
    (255, 232, 92),
)
"""Slow to fast, evenly spaced; bright on the road, and growing brighter, so that nobody needs the hue."""
OUTLINE: Final[Color] = (20, 22, 27)
MISTAKE: Final[Color] = (224, 49, 49)
INK: Final[Color] = (34, 38, 46)
SOFT_INK: Final[Color] = (120, 120, 116)
BAR_ROOM: Final = 0.22
"""Of the bar of colours in the upper right corner, share of the picture's width."""
SMOOTHING: Final = 8
"""Pieces that each piece between two steps is drawn with."""


def draw_racing_line(
    recording: Recording,
    path: str | Path,
    *,
    title: str = "",
    subtitle: str = "",
    figures: Sequence[tuple[str, str]] = (),
    has_own_figures: bool = True,
    speed: str = "SPEED",
    point: str = ".",
    width_px: int = 1600,
) -> Path:
    """Write the picture of a trial's or lap's racing line.

    Args:
        recording: What was driven: a trial's recording, or one lap of it, ``recording.lap(1)``.
        path: Where to; the ending says how (.png, .jpg, .webp).
        title: Default: the track's name.
        subtitle: Whose line it is; default: the track's description.
        figures: (label, value) pairs beside what the line itself says.
        has_own_figures: Whether the line says its own: times, speeds, resets.
        speed: What the colours are called.
        point: What stands before decimals.
        width_px: Width of the picture, pixels.

    Raises:
        ConfigError: The recording is none or has fewer than two steps, or the path is none.
        TrackError: The width or the file's ending is not allowed.
    """
    check_type("recording", recording, Recording, "use a trial's recording, or one lap of it")
    check_path("path", path, "use a file's path")
    check_type("title", title, str, "use a text")
    if len(recording) < 2:
        raise ConfigError(f"A racing line needs at least two steps, this recording has {len(recording)}.")
    speeds = recording.column("actual_speed")
    # the standing start would spend half of the colours on its first metre
    driving = speeds[speeds > 0.5 * np.median(speeds)] if np.median(speeds) > 0 else speeds
    low, high = speed_range(driving)
    picture = TrackPicture(recording.track, width_px=width_px)
    unit = width_px / 100.0
    width = float(np.clip(0.09 * picture.canvas.scale, 0.3 * unit, 0.7 * unit))
    stretches = _stretches(recording)
    for stretch in stretches:
        if len(stretch) > 1:
            places = _smooth(recording.origins[stretch])
            picture.canvas.line(places, OUTLINE, width_px=width + 0.16 * unit)
    for stretch in stretches:
        if len(stretch) > 1:
            places = _smooth(recording.origins[stretch])
            fine = np.interp(np.arange(len(places) - 1) / SMOOTHING, np.arange(len(stretch)), speeds[stretch])
            colors = [speed_color((speed - low) / (high - low)) for speed in fine.tolist()]
            picture.canvas.line(places, OUTLINE, width_px=width, colors=colors)
    for step in _mistakes(recording):
        place = recording.origins[step]
        picture.canvas.disc(place, (255, 255, 255), radius_px=1.25 * width)
        picture.canvas.disc(place, MISTAKE, radius_px=0.95 * width)
    name, description = describe(recording.track)
    own = _figures(recording) if has_own_figures else []
    shown = [*own, *figures]
    picture.caption(title=title or name, subtitle=subtitle or description, figures=shown, beside=BAR_ROOM)
    color_bar(picture.canvas, unit, low, high, speed, point)
    return picture.save(path)


def speed_color(fraction: float) -> Color:
    """Colour of a speed, by its place between the slowest (0) and the fastest (1)."""
    place = min(max(fraction, 0.0), 1.0) * (len(SPEED_COLORS) - 1)
    index = min(int(place), len(SPEED_COLORS) - 2)
    low, high, weight = SPEED_COLORS[index], SPEED_COLORS[index + 1], place - index
    red, green, blue = (round(a + weight * (b - a)) for a, b in zip(low, high, strict=True))
    return red, green, blue


def speed_range(speeds: NDArray[np.float64]) -> tuple[float, float]:
    """Ends of the colour bar, m/s: whole tenths around the speeds, at least half a metre per second apart."""
    low, high = np.floor(10 * speeds.min()) / 10, np.ceil(10 * speeds.max()) / 10
    return float(low), float(max(high, low + 0.5))


def _stretches(recording: Recording) -> list[NDArray[np.intp]]:
    """Steps driven without being put elsewhere in between: by a reset, or by the start of another lap."""
    statuses = recording.statuses
    cuts = [i + 1 for i, status in enumerate(statuses) if status in RESET_STATUSES]
    cuts += [i for i, status in enumerate(statuses) if status == "prepare" and i > 0]
    return np.split(np.arange(len(recording)), sorted(set(cuts)))


def _mistakes(recording: Recording) -> list[int]:
    return [i for i, status in enumerate(recording.statuses) if status in RESET_STATUSES]


def _smooth(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """A Catmull-Rom curve through the points (P, 2), as ``SMOOTHING * (P - 1) + 1`` points."""
    padded = np.concatenate((2 * points[:1] - points[1:2], points, 2 * points[-1:] - points[-2:-1]))
    slope = (padded[2:] - padded[:-2]) / 2
    t = np.linspace(0.0, 1.0, SMOOTHING, endpoint=False)[:, None, None]
    pieces = (
        (2 * t**3 - 3 * t**2 + 1) * points[:-1]
        + (t**3 - 2 * t**2 + t) * slope[:-1]
        + (3 * t**2 - 2 * t**3) * points[1:]
        + (t**3 - t**2) * slope[1:]
    )
    return np.concatenate((pieces.transpose(1, 0, 2).reshape(-1, 2), points[-1:]))


def _figures(recording: Recording) -> list[tuple[str, str]]:
    times = list(recording.lap_times.values())
    speeds = recording.column("actual_speed")
    figures = []
    if len(times) == 1:
        figures.append(("LAP TIME", f"{times[0]:.3f} s"))
    elif times:
        figures.append(("BEST LAP", f"{min(times):.3f} s"))
        figures.append(("LAPS", str(len(times))))
    else:
        reached = float(recording.column("progress")[-1].clip(0.0, 1.0))  # a car may end behind its start
        figures.append(("COMPLETION", f"{100 * reached:.1f} %"))
    figures.append(("TOP SPEED", f"{speeds.max():.2f} m/s"))
    moving = speeds[recording.column("status") == 1]
    figures.append(("MEAN SPEED", f"{moving.mean() if len(moving) else 0.0:.2f} m/s"))
    resets = sum(step < len(recording) - 1 for step in _mistakes(recording))  # after the last one nothing follows
    if resets:
        figures.append(("RESETS", str(resets)))
    return figures


def color_bar(canvas: Canvas, unit: float, low: float, high: float, speed: str = "SPEED", point: str = ".") -> None:
    """The colours from slow to fast in the upper right corner, with their speeds."""
    right, top, width, height, pieces = 95.0 * unit, 5.0 * unit, 20.0 * unit, 1.0 * unit, 100
    left = right - width
    canvas.text((left, top - 0.8 * unit), speed, SOFT_INK, size=0.95 * unit, spacing=0.12, weight=0.01)
    canvas.text((right, top - 0.8 * unit), "m/s", SOFT_INK, size=1.1 * unit, anchor="rs")
    for piece in range(pieces):
        x = left + width * piece / pieces
        color = speed_color((piece + 0.5) / pieces)
        canvas.box((x, top, x + width / pieces + 0.5, top + height), color)
    for fraction, anchor in ((0.0, "ls"), (0.5, "ms"), (1.0, "rs")):
        value = low + fraction * (high - low)
        words = f"{value:.2f}".rstrip("0").rstrip(".") if fraction == 0.5 else f"{value:.1f}"
        canvas.text(
            (left + fraction * width, top + height + 1.9 * unit),
            words.replace(".", point),
            INK,
            size=1.3 * unit,
            anchor=anchor,
        )
