"""What is believed, painted over the picture that it is believed of.

green            road, the surer the stronger
yellow           the road's middle, a bar as wide as it may be off on either side
scale below      where the lens is across the road, seen from above; the bar says how far off that may be
words            offset, heading, bend ahead, what is in the way
"""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from racecraft.perceiving.reading import SHOWN
from racecraft.perception.answers import CURVATURE_AT, REGION_COLUMNS, REGION_ROWS, ROWS
from racecraft.perception.belief import Belief
from racecraft.perception.telling import DISTANT, distance_of, sees_middle
from racecraft.track.canvas import Color

if TYPE_CHECKING:
    from PIL import ImageDraw

ZOOM: Final = SHOWN[0] / 160
ROAD: Final[Color] = (40, 220, 120)
MIDDLE: Final[Color] = (255, 214, 40)
INK: Final[Color] = (255, 255, 255)
SHADE: Final[Color] = (16, 20, 26)
MOST_ROAD: Final = 110
"""Opacity, of 255, where there is road for sure."""


def paint(picture: NDArray[np.uint8], belief: Belief, index: int) -> NDArray[np.uint8]:
    """A picture with what is believed of it.

    Args:
        picture: RGB (480, 640, 3).
        belief: Of several pictures.
        index: Which of them this is.

    Returns:
        RGB, as large.
    """
    from PIL import Image, ImageDraw

    image = Image.fromarray(picture).convert("RGBA")
    layer = Image.new("RGBA", SHOWN, (0, 0, 0, 0))
    draw = ImageDraw.Draw(layer)
    _regions(draw, belief.regions[index])
    _middle(draw, belief, index)
    _scale(draw, belief, index)
    _words(draw, belief, index)
    return np.asarray(Image.alpha_composite(image, layer).convert("RGB"))


def _regions(draw: ImageDraw.ImageDraw, regions: NDArray[np.float32]) -> None:
    rows = np.array(REGION_ROWS, float)
    edges = [*(1.5 * rows[:1] - 0.5 * rows[1:2]), *(0.5 * (rows[:-1] + rows[1:])), 120.0]
    half = 0.5 * (REGION_COLUMNS[1] - REGION_COLUMNS[0])
    for line, (top, bottom) in enumerate(pairwise(edges)):
        for place, column in enumerate(REGION_COLUMNS):
            opacity = round(MOST_ROAD * float(regions[line, place]))
            box = (column - half, top, column + half, bottom)
            draw.rectangle([ZOOM * side for side in box], fill=(*ROAD, opacity))


def _middle(draw: ImageDraw.ImageDraw, belief: Belief, index: int) -> None:
    seen = [place for place in range(len(ROWS)) if sees_middle(belief, index, place)]
    points = [(ZOOM * (float(belief.middle[index, i]) + 0.5), ZOOM * (ROWS[i] + 0.5)) for i in seen]
    if len(points) > 1:
        draw.line(points, fill=(*MIDDLE, 160), width=3)
    for place, (x, y) in zip(seen, points, strict=True):
        off = ZOOM * float(belief.middle_error[index, place])
        draw.line([(x - off, y), (x + off, y)], fill=(*MIDDLE, 200), width=3)
        draw.ellipse((x - 5, y - 5, x + 5, y + 5), fill=(*MIDDLE, 255), outline=SHADE)


def _scale(draw: ImageDraw.ImageDraw, belief: Belief, index: int) -> None:
    """The road from above: its width is 0.4 of the picture's."""
    width, height = SHOWN
    middle, reach, y = 0.5 * width, 0.2 * width, height - 22
    half = max(float(belief.half_width[index]), 0.1)
    draw.rectangle((middle - reach, y - 6, middle + reach, y + 6), fill=(*SHADE, 200))
    draw.line([(middle, y - 6), (middle, y + 6)], fill=(*MIDDLE, 255), width=2)
    x = middle - reach * float(belief.offset[index]) / half  # left of the road's middle is left here
    x = min(max(x, middle - 2 * reach), middle + 2 * reach)
    off = reach * float(belief.offset_error[index]) / half
    draw.rectangle((x - off, y - 3, x + off, y + 3), fill=(*INK, 150))
    turn = float(belief.heading[index])
    tip = (x - 16 * np.sin(turn), y - 16 * np.cos(turn))
    draw.line([(x, y), tip], fill=(*INK, 255), width=4)
    draw.ellipse((x - 5, y - 5, x + 5, y + 5), fill=(*INK, 255), outline=SHADE)


def _words(draw: ImageDraw.ImageDraw, belief: Belief, index: int) -> None:
    from PIL import ImageFont

    font = ImageFont.load_default(17)
    offset, heading = 100 * float(belief.offset[index]), float(np.degrees(belief.heading[index]))
    ahead = CURVATURE_AT.index(1.0)
    bend = float(belief.curvature[index, ahead])
    words = [
        "on the road" if belief.on_road[index] > 0.5 else "off the road",
        f"{abs(offset):.0f} cm {_side(offset)} ±{100 * float(belief.offset_error[index]):.0f}",
        f"{abs(heading):.0f}° {_side(heading)} ±{float(np.degrees(belief.heading_error[index])):.0f}",
        f"bends {_side(bend)}, {1 / abs(bend):.1f} m" if abs(bend) > 0.2 else "straight ahead",
    ]
    distance = distance_of(float(belief.closeness[index]))
    if distance < DISTANT:
        words.append(f"in the way at {distance:.1f} m")
    text = "   ".join(words)
    draw.rectangle((0, 0, SHOWN[0], 26), fill=(*SHADE, 190))
    draw.text((10, 4), text, fill=(*INK, 255), font=font)


def _side(number: float) -> str:
    return "left" if number >= 0.0 else "right"
