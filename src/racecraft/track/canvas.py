"""A sheet to draw a track on, in metres: supersampled, so every edge is smooth. Pillow only."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from racecraft.track.polyline import Floats, as_points

if TYPE_CHECKING:
    from PIL import Image, ImageFont

Color = tuple[int, int, int]

OVERSAMPLING = 3
_WITHOUT_DOTS = str.maketrans("äöüÄÖÜ", "aouAOU")


class Canvas:
    """An image with a metric frame.

    Args:
        size: Width and height of the finished picture, pixels.
        scale: Pixels for a metre.
        origin: Pixel of the world's origin; x runs right, y up.
        background: Colour of the sheet.
    """

    def __init__(self, size: tuple[int, int], *, scale: float, origin: tuple[float, float], background: Color) -> None:
        from PIL import Image, ImageDraw

        self.size = size
        self.scale = scale
        self.origin = origin
        self._image = Image.new("RGB", (size[0] * OVERSAMPLING, size[1] * OVERSAMPLING), background)
        self._draw = ImageDraw.Draw(self._image)

    def to_pixels(self, points: ArrayLike) -> Floats:
        """Where places in metres (..., 2) lie in the finished picture, pixels (..., 2)."""
        pixels = as_points(points) * np.array([self.scale, -self.scale]) + np.array(self.origin)
        return np.asarray(pixels)

    def finish(self) -> Image.Image:
        """The finished picture, at its final size."""
        return self._image.reduce(OVERSAMPLING)

    # --- in metres

    def polygon(self, points: ArrayLike, color: Color) -> None:
        """Fills a polygon of places in metres, (P, 2)."""
        self._draw.polygon(self._fine(points), fill=color)

    def polygons(self, shapes: Floats, color: Color) -> None:
        """Fills many polygons of equally many places in metres, (K, P, 2)."""
        for shape in (self.to_pixels(shapes) * OVERSAMPLING).reshape(len(shapes), -1).tolist():
            self._draw.polygon(shape, fill=color)

    def line(
        self,
        points: ArrayLike,
        color: Color,
        *,
        width_px: float,
        colors: list[Color] | None = None,
        is_round: bool = True,
    ) -> None:
        """Draws a line through places in metres (P, 2).

        Args:
            points: Metres, (P, 2).
            color: Colour of the line.
            width_px: Width in finished pixels.
            colors: A colour for each of the P - 1 pieces instead, as for a racing line coloured by speed.
            is_round: Whether joints and ends are round.
        """
        fine, width = self._fine(points), max(1, round(width_px * OVERSAMPLING))
        radius = width / 2
        for index, (start, end) in enumerate(pairwise(fine)):
            piece = colors[index] if colors else color
            self._draw.line([start, end], fill=piece, width=width)
            for x, y in (start, end) if is_round else ():
                self._draw.ellipse((x - radius, y - radius, x + radius, y + radius), fill=piece)

    def disc(self, center: ArrayLike, color: Color, *, radius_px: float) -> None:
        """Fills a circle round a place in metres, of a radius in finished pixels."""
        ((x, y),), radius = self._fine(as_points(center)[None]), radius_px * OVERSAMPLING
        self._draw.ellipse((x - radius, y - radius, x + radius, y + radius), fill=color)

    def shade(self, polygons: list[Floats], color: Color, *, blur_px: float, strength: float, shift_px: float) -> None:
        """Lays the soft shadow of polygons in metres on the sheet, shifted downwards."""
        from PIL import Image, ImageDraw, ImageFilter

        mask = Image.new("L", self.size, 0)
        draw = ImageDraw.Draw(mask)
        for polygon in polygons:
            draw.polygon([(x, y + shift_px) for x, y in self.to_pixels(polygon).tolist()], fill=round(255 * strength))
        mask = mask.filter(ImageFilter.GaussianBlur(blur_px)).resize(self._image.size, Image.Resampling.BILINEAR)
        self._image.paste(color, (0, 0), mask)

    # --- in pixels of the finished picture

    def text(
        self, place: tuple[float, float], words: str, color: Color, *, size: float, weight: float = 0.0,
        anchor: str = "ls", spacing: float = 0.0,
    ) -> float:  # fmt: skip
        """Writes words.

        Args:
            place: Pixel of the anchor.
            words: One line.
            color: Colour of the letters.
            size: Height of the font, pixels.
            weight: How much bolder than regular, as a fraction of the size.
            anchor: Pillow's two letters for what of the words lies at `place`.
            spacing: Extra space between letters, as a fraction of the size.

        Returns:
            Width of the words, pixels.
        """
        font, stroke = _font(size), weight * size * OVERSAMPLING
        plain, width = words.translate(_WITHOUT_DOTS), text_width(words, size=size, spacing=spacing)
        x, y = place[0] * OVERSAMPLING, place[1] * OVERSAMPLING
        left = x - {"l": 0.0, "m": 0.5, "r": 1.0}[anchor[0]] * width * OVERSAMPLING

        def start(index: int) -> float:  # of a letter
            before = plain[:index]
            if not spacing:
                return left + font.getlength(before)
            return left + sum(font.getlength(letter) + spacing * size * OVERSAMPLING for letter in before)

        if spacing:
            for index, letter in enumerate(plain):
                at = (start(index), y)
                self._draw.text(at, letter, fill=color, font=font, anchor="l" + anchor[1], stroke_width=stroke)
        else:
            self._draw.text((x, y), plain, fill=color, font=font, anchor=anchor, stroke_width=stroke, stroke_fill=color)
        for index, (wanted, letter) in enumerate(zip(words, plain, strict=True)):
            if wanted != letter:
                self._dots_above((start(index), y), letter, color, font, stroke, anchor[1])
        return width

    def _dots_above(
        self, place: tuple[float, float], letter: str, color: Color, font: ImageFont.FreeTypeFont, stroke: float,
        anchor: str,
    ) -> None:  # fmt: skip
        """The two dots of ä, ö and ü, which Pillow's own font has no letters for."""
        top = place[1] + font.getbbox(letter, anchor="l" + anchor)[1]
        middle, radius = place[0] + font.getlength(letter) / 2, 0.055 * font.size + stroke / 2
        for side in (-0.125, 0.125):
            x, y = middle + side * font.size, top - 0.13 * font.size
            self._draw.ellipse((x - radius, y - radius, x + radius, y + radius), fill=color)

    def box(self, corners: tuple[float, float, float, float], color: Color) -> None:
        """Fills the rectangle x0, y0, x1, y1, in pixels."""
        x0, y0, x1, y1 = (round(value * OVERSAMPLING) for value in corners)
        self._draw.rectangle((x0, y0, max(x0, x1 - 1), max(y0, y1 - 1)), fill=color)

    def dots(self, spacing_m: float, color: Color, *, radius_px: float) -> None:
        """A grid of dots over the whole sheet, `spacing_m` apart in the world."""
        width, height = self.size
        step = spacing_m * self.scale
        for x in np.arange(self.origin[0] % step, width, step):
            for y in np.arange(self.origin[1] % step, height, step):
                self.box((x - radius_px, y - radius_px, x + radius_px, y + radius_px), color)

    def _fine(self, points: ArrayLike) -> list[tuple[float, float]]:
        return list(map(tuple, (self.to_pixels(points) * OVERSAMPLING).tolist()))


def text_width(words: str, *, size: float, spacing: float = 0.0) -> float:
    """Width of words in Pillow's own font, pixels."""
    font, words = _font(size), words.translate(_WITHOUT_DOTS)
    if not spacing:
        return font.getlength(words) / OVERSAMPLING
    return sum(font.getlength(letter) for letter in words) / OVERSAMPLING + spacing * size * max(0, len(words) - 1)


def _font(size: float) -> ImageFont.FreeTypeFont:
    from PIL import ImageFont

    font = ImageFont.load_default(size=size * OVERSAMPLING)
    assert isinstance(font, ImageFont.FreeTypeFont)  # Pillow gives a bitmap font only when built without FreeType
    return font
