"""Letters and shapes on video frames: drawn once with Pillow, then blended from a cache in microseconds."""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray

from racecraft.track.canvas import Color

Mask = NDArray[np.uint16]
"""Coverage, 0 to 256  (height, width, 1)."""

PADDING = 2
"""Pixels kept free around a glyph, for what reaches beyond its advance."""


class Lettering:
    """One size and weight of Pillow's own font.

    Args:
        size: Height of the font, pixels.
        weight: How much bolder than regular, as a fraction of the size.
    """

    def __init__(self, size: float, *, weight: float = 0.0) -> None:
        self.size = size
        self.weight = weight

    def width(self, words: str) -> int:
        """Width of words, pixels."""
        return sum(_glyph(letter, self.size, self.weight)[1] for letter in words)

    def draw(
        self, frame: NDArray[np.uint8], x: float, y: float, words: str, color: Color, *, anchor: str = "l"
    ) -> None:
        """Write words on a frame.

        Args:
            frame: RGB  (height, width, 3); what falls outside is cut.
            x: Pixel of the words' left end, middle or right end.
            y: Pixel of the base line.
            words: One line.
            color: Colour of the letters.
            anchor: ``l``, ``m`` or ``r``.
        """
        left = round(x - {"l": 0.0, "m": 0.5, "r": 1.0}[anchor] * self.width(words))
        for letter in words:
            mask, advance, ascent = _glyph(letter, self.size, self.weight)
            blend(frame, left - PADDING, round(y) - ascent, mask, color)
            left += advance


def blend(frame: NDArray[np.uint8], x: int, y: int, mask: Mask, color: Color) -> None:
    """Lay a colour on a frame where a mask says, its upper left corner at pixel (x, y); what falls outside is cut."""
    height, width = frame.shape[:2]
    top, left = max(0, -y), max(0, -x)
    mask = mask[top : max(0, height - y), left : max(0, width - x)]
    if not mask.size:
        return
    y, x = y + top, x + left
    region = frame[y : y + mask.shape[0], x : x + mask.shape[1]]
    region[:] = (region * (256 - mask) + np.array(color, dtype=np.uint16) * mask) >> 8


@cache
def disc_mask(radius: float) -> Mask:
    """A smooth disc, its centre in the middle of the mask."""
    reach = int(np.ceil(radius)) + 1
    grid = np.arange(-reach, reach + 1)
    distance = np.hypot(grid[:, None], grid[None, :])
    return np.asarray((256 * np.clip(radius + 0.5 - distance, 0.0, 1.0)).astype(np.uint16)[..., None])


@cache
def pill_mask(width: int, height: int) -> Mask:
    """A smooth rectangle with round ends."""
    radius = height / 2
    x = np.abs(np.arange(width) + 0.5 - width / 2) - (width / 2 - radius)
    y = np.arange(height) + 0.5 - radius
    distance = np.hypot(np.maximum(x, 0.0)[None, :], y[:, None])
    return np.asarray((256 * np.clip(radius + 0.5 - distance, 0.0, 1.0)).astype(np.uint16)[..., None])


@cache
def _glyph(letter: str, size: float, weight: float) -> tuple[Mask, int, int]:
    """Coverage of one letter, its advance in pixels, and the rows above its base line."""
    from PIL import Image, ImageDraw, ImageFont

    font = ImageFont.load_default(size=size)
    assert isinstance(font, ImageFont.FreeTypeFont)  # Pillow gives a bitmap font only when built without FreeType
    advance = max(1, round(font.getlength(letter)))
    ascent, descent = font.getmetrics()
    image = Image.new("L", (advance + 2 * PADDING, ascent + descent), 0)
    draw = ImageDraw.Draw(image)
    draw.text((PADDING, ascent), letter, fill=255, font=font, anchor="ls", stroke_width=weight * size)
    coverage = np.asarray(image, dtype=np.uint16)[..., None]
    return coverage + (coverage >> 7), advance, ascent
