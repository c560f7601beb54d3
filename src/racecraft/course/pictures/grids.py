"""Worlds of squares with values and arrows, values over two numbers, and rows of images."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray
from PIL import Image

from racecraft.course.pictures.charts import Axes, draw_axes
from racecraft.course.pictures.sheet import (
    HEAD,
    INK,
    MARGIN,
    SOFT_INK,
    WHITE,
    WIDTH,
    Color,
    Sheet,
    readable_on,
    scale_color,
    width_of,
)
from racecraft.course.show import Picture

UNKNOWN: Final[Color] = (226, 222, 212)
"""Of a square without a value."""
GAP: Final = 3
"""Pixels between squares."""


def value_grids(
    title: str,
    grids: Mapping[str, tuple[ArrayLike, ArrayLike]],
    *,
    subtitle: str = "",
    words: Mapping[tuple[int, int], str] | None = None,
    columns: int = 2,
    digits: int = 2,
    y_label: str = "",
    x_label: str = "",
) -> Picture:
    """Squares coloured by their value, with an arrow for what is done there.

    Args:
        title: What is to be seen.
        grids: By name: values (R, C), NaN where there is none, and arrows (R, C, 2), right and up at most 1 long;
            an arrow of no length is left out.
        subtitle: How to read it.
        words: Written on a square instead of its value, by row and column.
        columns: Grids side by side.
        digits: Of the values, behind the point; -1 leaves them out.
        y_label: What a row of every grid is.
        x_label: What a column is.
    """
    columns = min(columns, len(grids))
    shown = {name: (np.asarray(v, np.float64), np.asarray(a, np.float64)) for name, (v, a) in grids.items()}
    known = np.concatenate([values[np.isfinite(values)] for values, _ in shown.values()])
    low, high = float(known.min()), float(known.max())
    rows_of, columns_of = next(iter(shown.values()))[0].shape
    between = 44
    room = (WIDTH - 2 * MARGIN - (columns - 1) * between) / columns
    side = min(room / columns_of, 118.0)
    tall = rows_of * side + 62
    lines = -(-len(shown) // columns)
    sheet = Sheet(title, subtitle, height=round(HEAD + lines * tall + (30 if x_label else 6)))
    for index, (name, (values, arrows)) in enumerate(shown.items()):
        line, column = divmod(index, columns)
        left, top = MARGIN + column * (room + between), HEAD + line * tall + 32
        sheet.text((left, top - 12), name, size=19, weight=0.02)
        for row in range(rows_of):
            for place in range(columns_of):
                corner = (left + place * side, top + row * side)
                word = (words or {}).get((row, place))
                _square(sheet, corner, side, float(values[row, place]), (low, high), arrows[row, place], word, digits)
        if y_label and column == 0:
            sheet.text((left + columns_of * side, top - 12), y_label, size=15, color=SOFT_INK, anchor="rs")
        if x_label:
            sheet.text(
                (left + columns_of * side, top + rows_of * side + 22), x_label, size=15, color=SOFT_INK, anchor="rs"
            )
    return sheet.picture()


def heat_maps(
    title: str,
    maps: Mapping[str, ArrayLike],
    *,
    x_range: tuple[float, float],
    y_range: tuple[float, float],
    subtitle: str = "",
    x_label: str = "",
    y_label: str = "",
    paths: Mapping[str, ArrayLike] | None = None,
) -> Picture:
    """Values over two numbers, a panel for each map.

    Args:
        title: What is to be seen.
        maps: Values by name, the lowest row first (R, C); NaN where there is none.
        x_range: Of a map, from left to right.
        y_range: Of a map, from its bottom to its top.
        subtitle: How to read it.
        x_label: Of the axis to the right.
        y_label: Of the axis upwards.
        paths: Lines to lay over a map, by its name (P, 2).
    """
    shown = {name: np.asarray(values, np.float64) for name, values in maps.items()}
    known = np.concatenate([values[np.isfinite(values)] for values in shown.values()])
    low, high = np.quantile(known, [0.01, 0.99]).tolist()
    columns, between = min(len(shown), 3), 74
    lines = -(-len(shown) // columns)
    room = (WIDTH - 2 * MARGIN - (columns - 1) * between - 50) / columns
    tall = min(room, 420.0)
    sheet = Sheet(title, subtitle, height=round(HEAD + lines * (tall + 112) + 10))
    pastes = []
    for index, (name, values) in enumerate(shown.items()):
        line, column = divmod(index, columns)
        left, top = MARGIN + 50 + column * (room + between), HEAD + 44 + line * (tall + 112)
        axes = Axes((left, top, left + room, top + tall), x_range, y_range)
        draw_axes(sheet, axes, x_label=x_label, y_label=y_label if column == 0 else "", ticks=(4, 4))
        sheet.text((left + room, top - 12), name, size=18, weight=0.02, anchor="rs")
        pixels = np.array([[_shade(value, low, high) for value in row] for row in values[::-1].tolist()], np.uint8)
        size = (round(room), round(tall))
        image = Image.fromarray(pixels).resize(size, Image.Resampling.NEAREST)
        if paths and name in paths:
            image = _with_path(image, axes, np.asarray(paths[name], np.float64))
        pastes.append((image, (round(left), round(top))))
    return sheet.picture(pastes)


def image_rows(
    title: str,
    rows: Mapping[str, Sequence[NDArray[Any]]],
    *,
    subtitle: str = "",
    framed: Mapping[str, int] | None = None,
) -> Picture:
    """Images beside each other, a row for each name.

    Args:
        title: What is to be seen.
        rows: Grey images by name, 0 to 255  (H, W).
        subtitle: How to read it.
        framed: Which image of a row stands out.
    """
    count = max(len(images) for images in rows.values())
    label = max(width_of(name, 19) for name in rows) + 26
    width = int((WIDTH - 2 * MARGIN - label - (count - 1) * 10) / count)
    first = next(iter(rows.values()))[0]
    height = round(width * first.shape[0] / first.shape[1])
    sheet = Sheet(title, subtitle, height=HEAD + len(rows) * (height + 22) + 20)
    pastes = []
    for line, (name, images) in enumerate(rows.items()):
        top = HEAD + line * (height + 22)
        sheet.text((MARGIN, top + height / 2), name, size=19, weight=0.02, anchor="lm")
        for place, pixels in enumerate(images):
            left = round(MARGIN + label + place * (width + 10))
            image = Image.fromarray(np.asarray(pixels, np.uint8)).convert("RGB")
            pastes.append((image.resize((width, height), Image.Resampling.BICUBIC), (left, top)))
            if (framed or {}).get(name) == place:
                sheet.box((left - 5, top - 5, left + width + 5, top + height + 5), (224, 49, 49))
    return sheet.picture(pastes)


def _square(
    sheet: Sheet,
    corner: tuple[float, float],
    side: float,
    value: float,
    bounds: tuple[float, float],
    arrow: NDArray[np.float64],
    word: str | None,
    digits: int,
) -> None:
    left, top = corner
    is_known = bool(np.isfinite(value))
    share = (value - bounds[0]) / max(bounds[1] - bounds[0], 1e-12)
    color = scale_color(share) if is_known else UNKNOWN
    ink = readable_on(color)
    sheet.box((left + GAP / 2, top + GAP / 2, left + side - GAP / 2, top + side - GAP / 2), color)
    middle = np.array([left + side / 2, top + side / 2])
    has_arrow = float(np.hypot(*arrow)) > 0.05
    if word is not None:
        sheet.text((float(middle[0]), float(middle[1])), word, color=ink, size=0.2 * side, weight=0.03, anchor="mm")
        return
    if has_arrow:
        lift = np.array([0.0, -0.12 * side if digits >= 0 else 0.0])
        half = 0.3 * side * np.array([arrow[0], -arrow[1]])
        sheet.arrow(middle + lift - half, middle + lift + half, ink, width=max(0.035 * side, 1.6))
    if is_known and digits >= 0:
        place = (float(middle[0]), top + side * (0.8 if has_arrow else 0.5))
        sheet.text(place, f"{value:.{digits}f}", color=ink, size=min(0.19 * side, 17), anchor="mm")


def _shade(value: float, low: float, high: float) -> Color:
    if not np.isfinite(value):
        return UNKNOWN
    return scale_color((value - low) / max(high - low, 1e-12))


def _with_path(image: Image.Image, axes: Axes, path: NDArray[np.float64]) -> Image.Image:
    from PIL import ImageDraw

    fine = 3
    large = image.resize((image.width * fine, image.height * fine), Image.Resampling.NEAREST)
    draw = ImageDraw.Draw(large)
    points = (axes.pixels(path[:, 0], path[:, 1]) - np.array(axes.box[:2])) * fine
    flat = [tuple(point) for point in points.tolist()]
    draw.line(flat, fill=INK, width=6 * fine // 2, joint="curve")
    draw.line(flat, fill=WHITE, width=3 * fine // 2, joint="curve")
    x, y = flat[-1]
    draw.ellipse((x - 15, y - 15, x + 15, y + 15), fill=WHITE, outline=INK, width=4)
    return large.resize(image.size, Image.Resampling.LANCZOS)
