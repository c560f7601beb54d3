"""Cars on a track: the lines that they drove, and a film of them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Final

import numpy as np
from PIL import Image

from racecraft.course.driving import STEPS_PER_SECOND, Drives
from racecraft.course.pictures.sheet import (
    INK,
    MARGIN,
    PAPER,
    SOFT_INK,
    WHITE,
    WIDTH,
    Color,
    Floats,
    Sheet,
    color_of,
    scale_color,
    width_of,
)
from racecraft.course.show import Picture
from racecraft.track import Track, find_corners
from racecraft.track.canvas import Canvas
from racecraft.track.road_art import Ribbon, paint_infield, paint_road

CAR: Final = np.array([[0.24, 0.0], [0.12, 0.1], [-0.16, 0.11], [-0.16, -0.11], [0.12, -0.1]])
"""Outline of a car that can be seen from above the track, m, somewhat larger than it is."""
FINE: Final = 2
"""Supersampling of cars."""
FILM_SPEED: Final = 2
"""Steps of the simulation to a frame, at so many of which a second has half: faster than life."""


def drawn_lines(title: str, drives: Mapping[str, Drives], *, subtitle: str = "", cars: int = 3) -> Picture:
    """Lines of some cars, a panel for each driver, and how it went below.

    Args:
        title: What is to be seen.
        drives: What was driven, by the driver's name.
        subtitle: How to read it.
        cars: Of each, whose lines are drawn.
    """
    columns = min(len(drives), 3)
    rows = -(-len(drives) // columns)
    gap = 28
    cell = (WIDTH - 2 * MARGIN - (columns - 1) * gap) // columns
    panels = [_panel(one, cell, cars=cars) for one in drives.values()]
    tall = max(panel.height for panel in panels)
    sheet = Sheet(title, subtitle, height=128 + rows * (tall + 78) + 20)
    pastes = []
    for index, (name, panel) in enumerate(zip(drives, panels, strict=True)):
        row, column = divmod(index, columns)
        x, y = MARGIN + column * (cell + gap), 128 + row * (tall + 78)
        pastes.append((panel, (x, y)))
        sheet.text((x + 4, y + tall + 26), name, size=20, weight=0.025)
        sheet.text((x + 4, y + tall + 50), _story(drives[name]), size=16, color=SOFT_INK)
    return sheet.picture(pastes)


def film(
    title: str,
    drives: Mapping[str, Drives],
    *,
    subtitle: str = "",
    seconds: float = 8.0,
    width: int = 800,
) -> Picture:
    """Cars of several drivers on one track, as an animation.

    Args:
        title: What is to be seen.
        drives: What was driven, by the driver's name; each has its colour.
        subtitle: How to read it.
        seconds: Of the simulation that are shown.
        width: Pixels.
    """
    first = next(iter(drives.values()))
    sheet = Sheet(title, subtitle, height=round(0.16 * width) + 8, width=width)
    head = sheet.finish()
    canvas = road_canvas(first.track, width - 60)
    road = canvas.finish()
    fine_road = road.resize((road.width * FINE, road.height * FINE), Image.Resampling.BICUBIC)
    height = head.height + road.height + 56
    steps = min(round(seconds * STEPS_PER_SECOND), max(len(one.x) for one in drives.values()))
    frames = []
    for step in range(0, steps, FILM_SPEED):
        image = Image.new("RGB", (width, height), PAPER)
        image.paste(head, (0, 0))
        image.paste(_with_cars(fine_road, canvas.to_pixels, drives, step), (30, head.height))
        frames.append(image)
    legend = Sheet("", height=56, width=width)
    x = 40.0
    for index, name in enumerate(drives):
        legend.disc((x, 24), color_of(index), radius=8)
        legend.text((x + 16, 24), name, size=17, anchor="lm")
        x += 60 + width_of(name, 17)
    strip = legend.finish()
    for image in frames:
        image.paste(strip, (0, height - 56))
    words = [*sheet.words, *legend.words]
    return Picture(frames, seconds=FILM_SPEED / STEPS_PER_SECOND / 2, description=title, words=words)


def road_canvas(track: Track, width: int, *, margin: float = 22.0, tallest: float = 0.62) -> Canvas:
    """A canvas with the road of a track on it, to draw on in metres.

    Args:
        track: Whose road.
        width: Pixels.
        margin: Pixels around the road.
        tallest: Height over width that is not exceeded.
    """
    x_min, y_min, x_max, y_max = track.bounds
    room = width - 2 * margin
    scale = min(room / (x_max - x_min), (tallest * width - 2 * margin) / (y_max - y_min))
    height = round(scale * (y_max - y_min) + 2 * margin)
    origin = (width / 2 - scale * (x_min + x_max) / 2, height / 2 + scale * (y_min + y_max) / 2)
    canvas = Canvas((width, height), scale=scale, origin=origin, background=PAPER)
    ribbon = Ribbon(track)
    paint_infield(canvas, ribbon)
    paint_road(canvas, track, ribbon, find_corners(track), shadow_px=4.0)
    return canvas


def _panel(drives: Drives, width: int, *, cars: int) -> Image.Image:
    canvas = road_canvas(drives.track, width, margin=26.0)
    for car in range(min(cars, drives.x.shape[1])):
        points = np.stack([drives.x[:, car], drives.y[:, car]], axis=1)
        points = points[np.isfinite(points[:, 0])]
        if len(points) < 2:
            continue
        pace = np.clip(drives.speed[: len(points) - 1, car] / 4.0, 0.0, 1.0)
        colors: list[Color] = [scale_color(0.25 + 0.75 * share) for share in pace.tolist()]
        canvas.line(points, INK, width_px=2.6, colors=colors)
        if drives.endings[car] not in ("lap_complete", "in_progress"):
            canvas.disc(points[-1], WHITE, radius_px=6)
            canvas.disc(points[-1], (224, 49, 49), radius_px=4.5)
    return canvas.finish()


def _with_cars(
    road: Image.Image, to_pixels: Callable[[Floats], Floats], drives: Mapping[str, Drives], step: int
) -> Image.Image:
    """A road in FINE times its size, with every car where it is at a step; one that left the road lies there, pale."""
    from PIL import ImageDraw

    image = road.copy()
    draw = ImageDraw.Draw(image)
    for index, one in enumerate(drives.values()):
        for car in range(one.x.shape[1]):
            known = np.flatnonzero(np.isfinite(one.x[: step + 1, car]))
            if not len(known):
                continue
            now = known[-1]
            is_over = now < min(step, len(one.x) - 1)
            turn = one.heading[now, car]
            turned = CAR @ np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
            outline = to_pixels(turned + np.array([one.x[now, car], one.y[now, car]])) * FINE
            color: Color = (150, 150, 148) if is_over else color_of(index)
            draw.polygon(outline.reshape(-1).tolist(), fill=color, outline=WHITE, width=3)
    return image.reduce(FINE)


def _story(drives: Drives) -> str:
    """How it went, in a few words."""
    cars, laps = len(drives.endings), drives.laps
    off = sum(ending in ("off_track", "crashed") for ending in drives.endings)
    wrong_way = drives.endings.count("reversed")
    parts = [f"{laps} of {cars} laps"]
    if laps:
        parts.append(f"{drives.lap_seconds:.1f} s a lap")
    if off:
        parts.append(f"{off} off the track")
    if wrong_way:
        parts.append(f"{wrong_way} the wrong way")
    return ", ".join(parts)
