"""The sheet that every picture of a lesson is drawn on: one paper, one ink, one set of colours, a title.

Pixels here run right and down, as in images.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray
from PIL import Image

from racecraft.course.phrases import label_in, learner_language
from racecraft.course.show import Picture
from racecraft.track.canvas import Canvas, Color, text_width
from racecraft.track.road_art import GRID, INK, PAPER, SOFT_INK

Floats = NDArray[np.float64]
Box = tuple[float, float, float, float]
"""Left, top, right, bottom, in pixels."""

WIDTH: Final = 1200
MARGIN: Final = 56
HEAD: Final = 128
"""Pixels above the content, for the title and the sentence below it."""
WHITE: Final[Color] = (255, 254, 250)
COLORS: Final[tuple[Color, ...]] = (
    (46, 94, 214),
    (232, 104, 42),
    (20, 146, 120),
    (198, 44, 120),
    (222, 166, 34),
    (110, 84, 196),
    (120, 120, 116),
)
"""Of curves and groups, told apart also without red or green."""
SCALE: Final[tuple[Color, ...]] = ((49, 44, 108), (43, 96, 156), (38, 152, 148), (128, 196, 106), (250, 228, 92))
"""Low to high; it also grows brighter."""
_SPELLED: Final = str.maketrans(
    dict(zip("–−×→", ["-", "-", "x", "->"], strict=True))
    | dict(zip("²≥≤", ["^2", ">=", "<="], strict=True))
    | dict(zip("εγαλπ", ["epsilon", "gamma", "alpha", "lambda", "pi"], strict=True))
    | {"ß": "ss"}
    | dict.fromkeys("„“”", '"')
)
"""What Pillow's own font has no letters for."""


class Sheet:
    """A picture in the making.

    Attributes:
        content: What is left for the content, pixels.
        words: What is written so far, in English.

    Args:
        title: What is to be seen.
        subtitle: How to read it, or what follows.
        height: Pixels of the whole sheet.
        width: Pixels.
    """

    def __init__(self, title: str, subtitle: str = "", *, height: int = 680, width: int = WIDTH) -> None:
        self.size = (width, height)
        self.title = title
        self.words: list[str] = []
        self.canvas = Canvas((width, height), scale=1.0, origin=(0.0, 0.0), background=PAPER)
        unit = min(width / WIDTH, 1.0)
        self.unit = unit
        room = width - 2 * MARGIN * unit
        size = _fitting(title, 34 * unit, room)
        self.text((MARGIN * unit, 62 * unit), title, size=size, weight=0.03)
        if subtitle:
            size = _fitting(subtitle, 19 * unit, room)
            self.text((MARGIN * unit, 95 * unit), subtitle, color=SOFT_INK, size=size)
        self.content: Box = (MARGIN * unit, HEAD * unit, width - MARGIN * unit, height - MARGIN * unit)

    def text(
        self,
        place: tuple[float, float],
        words: str,
        *,
        color: Color = INK,
        size: float = 17.0,
        weight: float = 0.0,
        anchor: str = "ls",
    ) -> None:
        """Write an English line in the learner's language; `anchor` as Pillow's, such as ``mm`` for its middle."""
        if words:
            self.words.append(words)
        self.canvas.text(place, spelled(words), color, size=size, weight=weight, anchor=anchor)

    def line(
        self, points: ArrayLike, color: Color = INK, *, width: float = 3.0, colors: list[Color] | None = None
    ) -> None:
        """Draw through places (P, 2)."""
        self.canvas.line(down(points), color, width_px=width, colors=colors)

    def polygon(self, points: ArrayLike, color: Color) -> None:
        """Fill between places (P, 2)."""
        self.canvas.polygon(down(points), color)

    def disc(self, place: tuple[float, float], color: Color, *, radius: float) -> None:
        """Fill a circle."""
        self.canvas.disc(down([place])[0], color, radius_px=radius)

    def box(self, box: Box, color: Color) -> None:
        """Fill a rectangle."""
        self.canvas.box(box, color)

    def arrow(self, start: ArrayLike, end: ArrayLike, color: Color = INK, *, width: float = 3.0) -> None:
        """Draw a line with a head at its end."""
        tail, tip = np.asarray(start, np.float64), np.asarray(end, np.float64)
        along = (tip - tail) / max(float(np.hypot(*(tip - tail))), 1e-9)
        across, head = np.array([-along[1], along[0]]), 3.4 * width
        neck = tip - head * along
        self.line([tail, neck], color, width=width)
        self.polygon([tip, neck + 0.62 * head * across, neck - 0.62 * head * across], color)

    def finish(self, pastes: Sequence[tuple[Image.Image, tuple[int, int]]] = ()) -> Image.Image:
        """The finished image, with other images laid on it."""
        image = self.canvas.finish()
        for other, place in pastes:
            image.paste(other, place)
        return image

    def picture(self, pastes: Sequence[tuple[Image.Image, tuple[int, int]]] = ()) -> Picture:
        """The finished picture."""
        return Picture([self.finish(pastes)], description=self.title, words=self.words)


def down(points: ArrayLike) -> Floats:
    """Places of an image for a canvas, whose y axis runs up."""
    return np.asarray(np.asarray(points, np.float64) * np.array([1.0, -1.0]))


def spelled(words: str) -> str:
    """English words in the learner's language and in the letters that there are."""
    return label_in(learner_language(), words).translate(_SPELLED)


def width_of(words: str, size: float) -> float:
    """Of a line that is given in English, pixels."""
    return text_width(spelled(words), size=size)


def color_of(index: int) -> Color:
    """Of the so-manieth curve or group."""
    return COLORS[index % len(COLORS)]


def scale_color(share: float) -> Color:
    """Colour of a share from 0 to 1, dark to bright."""
    place = min(max(share, 0.0), 1.0) * (len(SCALE) - 1)
    index = min(int(place), len(SCALE) - 2)
    return mixed(SCALE[index], SCALE[index + 1], place - index)


def mixed(first: Color, second: Color, share: float) -> Color:
    """A colour between two: 0 is the first, 1 the second."""
    red, green, blue = (round(a + share * (b - a)) for a, b in zip(first, second, strict=True))
    return red, green, blue


def readable_on(color: Color) -> Color:
    """Ink or paper, whichever is read better on a colour."""
    return INK if 0.299 * color[0] + 0.587 * color[1] + 0.114 * color[2] > 130 else WHITE


def _fitting(words: str, size: float, room: float) -> float:
    return min(size, size * room / max(width_of(words, size), 1e-9))


__all__ = [
    "COLORS", "GRID", "HEAD", "INK", "MARGIN", "PAPER", "SOFT_INK", "WHITE", "WIDTH",
    "Box", "Color", "Floats", "Sheet", "color_of", "mixed", "readable_on", "scale_color", "width_of",
]  # fmt: skip
