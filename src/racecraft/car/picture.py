"""The picture of `racecraft evaluate --as car`: what was commanded against what a car made of it, and how often.

Two panels, steering and speed. A dot is a command and what came of it; its size says how often it was driven. On the
dashed line the car does what the model meant.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from racecraft.agent.action_space import ActionSpace
from racecraft.car.command import Floats, listed_choices
from racecraft.track.canvas import Color

if TYPE_CHECKING:
    from PIL import ImageDraw

SIZE: Final = (1200, 640)
PANEL: Final = 440  # pixels, side of a panel's square
TOP: Final = 100
LEFTS: Final = (110, 700)
FINE: Final = 2  # drawn so many times larger, then reduced
SHEET: Final[Color] = (250, 250, 247)
INK: Final[Color] = (34, 38, 46)
SOFT: Final[Color] = (205, 206, 202)
DOT: Final[Color] = (226, 88, 34)
DOTS_ACROSS: Final = 220  # places of dots along a side: those of one place are one dot


def draw_commands(chosen: Floats, resulting: Floats, space: ActionSpace, path: Path, *, note: str = "") -> Path:
    """Write the picture.

    Args:
        chosen: Angles in rad and speeds in m/s, a row for each step of each car  (S, 2).
        resulting: Angles of the wheels in rad and speeds in m/s  (S, 2).
        space: The model's action space: its ends are on the axes, driven or not.
        path: Where to.
        note: On what speeds came of it, beside the words on the axis.
    """
    from PIL import Image, ImageDraw

    image = Image.new("RGB", (SIZE[0] * FINE, SIZE[1] * FINE), SHEET)
    draw = ImageDraw.Draw(image)
    degrees = np.array([180 / np.pi, 1.0])
    listed = listed_choices(space) * degrees
    panels = (("steering angle, degrees, left positive", True), ("speed, m/s", False))
    for column, (title, is_signed) in enumerate(panels):
        pairs = np.column_stack([chosen[:, column], resulting[:, column]]) * degrees[column]
        low, high, ticks = _axis(max(np.abs(listed[:, column]).max(), np.abs(pairs[:, 1]).max()), is_signed=is_signed)
        shares = (pairs - low) / (high - low)
        cells, counts = np.unique(np.round(shares * DOTS_ACROSS), axis=0, return_counts=True)
        _panel(draw, LEFTS[column], title, low, high, ticks)
        _axis_words(draw, LEFTS[column], "" if is_signed else note)
        for (x, y), share in zip(cells / DOTS_ACROSS, counts / len(pairs), strict=True):
            _dot(draw, LEFTS[column], x, y, 3 + 20 * share**0.5)
    image.reduce(FINE).save(path)
    return path


def _axis(most: float, *, is_signed: bool) -> tuple[float, float, Sequence[float]]:
    """Ends of an axis and its ticks."""
    step = next(step for step in (0.1, 0.25, 0.5, 1, 2.5, 5, 10, 20, 50) if most / step <= 6)
    high = step * np.ceil(most / step - 1e-9)
    low = -high if is_signed else 0.0
    return low, high, np.arange(low, high + step / 2, step).tolist()


def _panel(draw: ImageDraw.ImageDraw, left: int, title: str, low: float, high: float, ticks: Sequence[float]) -> None:
    from PIL import ImageFont

    large, small = (ImageFont.load_default(size * FINE) for size in (20, 15))
    _text(draw, left, 30, title, large, anchor="ls")
    for tick in ticks:
        place = PANEL * (tick - low) / (high - low)
        _line(draw, [(left + place, TOP), (left + place, TOP + PANEL)], SOFT, 1)
        _line(draw, [(left, TOP + PANEL - place), (left + PANEL, TOP + PANEL - place)], SOFT, 1)
        _text(draw, left + place, TOP + PANEL + 26, f"{tick:g}", small, anchor="ms")
        _text(draw, left - 12, TOP + PANEL - place, f"{tick:g}", small, anchor="rm")
    for piece in range(0, PANEL, 16):
        _line(draw, [(left + piece, TOP + PANEL - piece), (left + piece + 8, TOP + PANEL - piece - 8)], INK, 2)


def _axis_words(draw: ImageDraw.ImageDraw, left: int, note: str) -> None:
    from PIL import ImageFont

    small = ImageFont.load_default(15 * FINE)
    words = "up: what the car makes of it" + (f"; {note}" if note else "")
    _text(draw, left, 62, words, small, anchor="ls")
    _text(draw, left + PANEL, TOP + PANEL + 62, "commanded", small, anchor="rs")


def _dot(draw: ImageDraw.ImageDraw, left: int, x: float, y: float, radius: float) -> None:
    across, down = (left + PANEL * x) * FINE, (TOP + PANEL * (1 - y)) * FINE
    r = radius * FINE
    draw.ellipse((across - r, down - r, across + r, down + r), fill=DOT, outline=SHEET, width=FINE)


def _line(draw: ImageDraw.ImageDraw, points: Sequence[tuple[float, float]], color: Color, width: int) -> None:
    draw.line([(x * FINE, y * FINE) for x, y in points], fill=color, width=width * FINE)


def _text(draw: ImageDraw.ImageDraw, x: float, y: float, text: str, font: object, *, anchor: str) -> None:
    draw.text((x * FINE, y * FINE), text, fill=INK, font=font, anchor=anchor)  # type: ignore[arg-type]
