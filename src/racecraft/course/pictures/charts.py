"""Charts of a lesson: curves, bars and points, labelled where they are rather than in a legend."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from racecraft.analysis.svg import nice_ticks
from racecraft.course.pictures.sheet import (
    GRID,
    INK,
    SOFT_INK,
    WHITE,
    Box,
    Color,
    Floats,
    Sheet,
    color_of,
    mixed,
    width_of,
)
from racecraft.course.show import Picture

MAX_POINTS = 1200
"""Of a curve; more cannot be seen."""


@dataclass(frozen=True)
class Axes:
    """A field of a sheet with numbers along two sides."""

    box: Box
    x: tuple[float, float]
    y: tuple[float, float]

    def pixels(self, xs: ArrayLike, ys: ArrayLike) -> Floats:
        """Where points lie on the sheet (P, 2)."""
        left, top, right, bottom = self.box
        across = (np.asarray(xs, np.float64) - self.x[0]) / (self.x[1] - self.x[0])
        up = (np.asarray(ys, np.float64) - self.y[0]) / (self.y[1] - self.y[0])
        return np.stack([left + (right - left) * across, bottom - (bottom - top) * up], axis=-1)


def draw_axes(
    sheet: Sheet,
    axes: Axes,
    *,
    x_label: str = "",
    y_label: str = "",
    has_x_grid: bool = False,
    ticks: tuple[int, int] = (8, 5),
) -> None:
    """The field, its lines and its numbers, about so many to the right and upwards."""
    left, top, right, bottom = axes.box
    sheet.box(axes.box, WHITE)
    for tick in nice_ticks(*axes.y, ticks[1]):
        y = float(axes.pixels(axes.x[0], tick)[1])
        sheet.box((left, y - 0.7, right, y + 0.7), GRID)
        sheet.text((left - 12, y), _number(tick), color=SOFT_INK, size=16, anchor="rm")
    for tick in nice_ticks(*axes.x, ticks[0]):
        x = float(axes.pixels(tick, axes.y[0])[0])
        if has_x_grid:
            sheet.box((x - 0.7, top, x + 0.7, bottom), GRID)
        sheet.text((x, bottom + 24), _number(tick), color=SOFT_INK, size=16, anchor="ms")
    sheet.text((right, bottom + 50), x_label, size=17, anchor="rs")
    sheet.text((left, top - 12), y_label, size=17)


def line_chart(
    title: str,
    curves: Mapping[str, Any],
    *,
    subtitle: str = "",
    x_label: str = "",
    y_label: str = "",
    y_range: tuple[float, float] | None = None,
    marks: Mapping[str, float] | None = None,
    height: int = 680,
) -> Picture:
    """Curves over a common axis.

    Args:
        title: What is to be seen.
        curves: By name: values (P,), or places and values ((P,), (P,)).
        subtitle: How to read it.
        x_label: Of the axis to the right.
        y_label: Of the axis upwards.
        y_range: Lowest and highest value shown; by default all of them.
        marks: Values to draw a dashed line at, by name.
        height: Pixels.
    """
    series = {name: _points(curve) for name, curve in curves.items()}
    marks = marks or {}
    xs = np.concatenate([x for x, _ in series.values()])
    ys = np.concatenate([*[y for _, y in series.values()], list(marks.values())])
    sheet = Sheet(title, subtitle, height=height)
    left, top, right, bottom = sheet.content
    label_room = max(width_of(name, 17) for name in [*series, *marks]) + 24
    box = (left + 62, top + 24, right - label_room, bottom - 16)
    axes = Axes(box, (float(xs.min()), float(xs.max())), y_range or _padded(ys[np.isfinite(ys)]))
    draw_axes(sheet, axes, x_label=x_label, y_label=y_label)
    labels = []
    for name, value in marks.items():
        (x0, y0), (x1, _) = axes.pixels([axes.x[0], axes.x[1]], [value, value]).tolist()
        for start in np.arange(x0, x1, 18):
            sheet.line([(start, y0), (min(start + 8, x1), y0)], SOFT_INK, width=2)
        labels.append((y0, name, SOFT_INK))
    for index, (name, (x, y)) in enumerate(series.items()):
        stride = max(1, -(-len(x) // MAX_POINTS))
        points = axes.pixels(x[::stride], np.clip(y[::stride], *axes.y))
        for piece in np.split(points, np.flatnonzero(~np.isfinite(points[:, 1]))):
            piece = piece[np.isfinite(piece[:, 1])]
            if len(piece) > 1:
                sheet.line(piece, color_of(index), width=3.2)
        known = points[np.isfinite(points[:, 1])]
        if len(known):
            sheet.disc((float(known[-1, 0]), float(known[-1, 1])), color_of(index), radius=5)
            labels.append((float(known[-1, 1]), name, color_of(index)))
    for height_of, name, color in _apart(labels, 24, box):
        sheet.text((box[2] + 16, height_of), name, color=color, size=17, weight=0.02, anchor="lm")
    return sheet.picture()


def bar_chart(
    title: str,
    values: Mapping[str, float],
    *,
    subtitle: str = "",
    unit: str = "",
    digits: int = 1,
    highlighted: Sequence[str] = (),
) -> Picture:
    """Horizontal bars with their figures.

    Args:
        title: What is to be seen.
        values: By name, top to bottom.
        subtitle: How to read it.
        unit: Behind every figure.
        digits: Of the figures, behind the point.
        highlighted: Names whose bars stand out; by default all.
    """
    row, gap = 46, 14
    sheet = Sheet(title, subtitle, height=128 + 56 + len(values) * (row + gap))
    left, top, right, _ = sheet.content
    label_room = max(width_of(name, 19) for name in values) + 22
    low, high = min(0.0, *values.values()), max(0.0, *values.values())
    figure_room = 120
    field_left = left + label_room + (figure_room if low < 0 else 0)
    field_right = right - figure_room
    span = (high - low) or 1.0

    def place(value: float) -> float:
        return field_left + (field_right - field_left) * (value - low) / span

    for index, (name, value) in enumerate(values.items()):
        y = top + index * (row + gap)
        stands_out = not highlighted or name in highlighted
        color = color_of(0) if stands_out else mixed(color_of(6), WHITE, 0.45)
        sheet.text((left + label_room - 22, y + row / 2), name, size=19, anchor="rm", weight=0.012 * stands_out)
        start, end = sorted((place(0.0), place(value)))
        sheet.box((start, y, max(end, start + 2), y + row), color)
        figure = f"{value:,.{digits}f}{unit and ' ' + unit}"
        is_left = value < 0
        sheet.text(
            ((start - 12) if is_left else (end + 12), y + row / 2),
            figure,
            size=19,
            anchor="rm" if is_left else "lm",
            weight=0.02,
        )
    if low < 0:
        sheet.box((place(0.0) - 1, top - 6, place(0.0) + 1, top + len(values) * (row + gap) - gap + 6), INK)
    return sheet.picture()


def scatter(
    title: str,
    groups: Mapping[str, ArrayLike],
    *,
    subtitle: str = "",
    x_label: str = "",
    y_label: str = "",
    radius: float = 4.5,
    height: int = 760,
) -> Picture:
    """Points of several groups.

    Args:
        title: What is to be seen.
        groups: Points (P, 2) by name; later ones are drawn on top.
        subtitle: How to read it.
        x_label: Of the axis to the right.
        y_label: Of the axis upwards.
        radius: Of a point, pixels.
        height: Pixels.
    """
    clouds = {name: np.asarray(points, np.float64).reshape(-1, 2) for name, points in groups.items()}
    everything = np.concatenate(list(clouds.values()))
    sheet = Sheet(title, subtitle, height=height)
    left, top, right, bottom = sheet.content
    room = max(width_of(name, 17) for name in clouds) + 60
    box = (left + 62, top + 24, right - room, bottom - 16)
    axes = Axes(box, _padded(everything[:, 0]), _padded(everything[:, 1]))
    draw_axes(sheet, axes, x_label=x_label, y_label=y_label, has_x_grid=True)
    for index, (name, points) in enumerate(clouds.items()):
        color = color_of(index)
        for x, y in axes.pixels(points[:, 0], points[:, 1]).tolist():
            sheet.disc((x, y), WHITE, radius=radius + 1.2)
            sheet.disc((x, y), color, radius=radius)
        y = box[1] + 18 + 34 * index
        sheet.disc((box[2] + 26, y), color, radius=8)
        sheet.text((box[2] + 44, y), name, size=17, weight=0.015, anchor="lm")
    return sheet.picture()


def _points(curve: Any) -> tuple[Floats, Floats]:
    if isinstance(curve, tuple):
        return np.asarray(curve[0], np.float64), np.asarray(curve[1], np.float64)
    values = np.asarray(curve, np.float64)
    return np.arange(len(values), dtype=np.float64), values


def _padded(values: Floats) -> tuple[float, float]:
    low, high = float(values.min()), float(values.max())
    space = 0.06 * (high - low) or 0.5
    return low - space, high + space


def _apart(labels: list[tuple[float, str, Color]], gap: float, box: Box) -> list[tuple[float, str, Color]]:
    """Labels moved up and down until none lies on another."""
    placed: list[tuple[float, str, Color]] = []
    for y, name, color in sorted(labels, key=lambda label: label[0]):
        placed.append((max(y, placed[-1][0] + gap) if placed else y, name, color))
    over = placed[-1][0] - box[3] if placed else 0.0
    if over > 0:
        limit = box[3]
        for index in range(len(placed) - 1, -1, -1):
            y = min(placed[index][0], limit)
            placed[index] = (y, *placed[index][1:])
            limit = y - gap
    return placed


def _number(value: float) -> str:
    return f"{value:,.0f}" if abs(value) >= 1000 else f"{value:g}"
