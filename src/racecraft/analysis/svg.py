"""Pictures for a report as SVG texts: line charts, a track with a line on it, a map of cells, an action space.

The one drawer of charts in Python; pictures in pixels (`track.canvas`, `film`) show roads and cars.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from html import escape
from typing import Final

import numpy as np
from numpy.typing import NDArray

from racecraft.film.racing_line import speed_color, speed_range
from racecraft.track import Track

Floats = NDArray[np.float64]

WIDTH: Final = 900
LEFT, RIGHT, TOP, BOTTOM = 62, 16, 14, 44  # px around a chart's field
MAX_POINTS: Final = 900  # of a curve; more cannot be seen
SCALE: Final = ((68, 1, 84), (59, 82, 139), (33, 145, 140), (94, 201, 98), (253, 231, 37))


@dataclass(frozen=True, kw_only=True)
class Curve:
    """One line of a chart."""

    label: str
    x: Floats
    y: Floats
    """NaN makes a gap."""
    kind: str = "first"
    """CSS class: ``first``, ``second`` or ``dots``."""


@dataclass(frozen=True, kw_only=True)
class Chart:
    """What a line chart shows."""

    curves: Sequence[Curve]
    x_label: str
    y_label: str
    y_text: Callable[[float], str] = field(default=lambda value: f"{value:g}")
    y_range: tuple[float, float] | None = None
    height: int = 260
    marks: Sequence[float] = ()
    """Places on the x axis for dashed lines."""
    bands: Sequence[tuple[float, float, str]] = ()
    """From, to and title of parts of the x axis that are told apart by their ground."""


def nice_ticks(low: float, high: float, count: int = 5) -> list[float]:
    """Round numbers from low to high, about so many."""
    if not high > low:
        return [low]
    rough = (high - low) / max(count, 1)
    power = 10.0 ** math.floor(math.log10(rough))
    step = next(power * factor for factor in (1, 2, 2.5, 5, 10) if power * factor >= rough * 0.999)
    first = math.ceil(low / step - 1e-9)
    return [round(index * step, 12) for index in range(first, math.floor(high / step + 1e-9) + 1)]


def line_chart(chart: Chart) -> str:
    """An SVG of a chart; empty text where nothing is known."""
    known = [curve for curve in chart.curves if np.isfinite(curve.y).any()]
    if not known:
        return ""
    xs = np.concatenate([curve.x for curve in known])
    ys = np.concatenate([curve.y[np.isfinite(curve.y)] for curve in known])
    x_low = float(xs.min())
    x_high = _above(x_low, float(xs.max()))
    y_low, y_high = chart.y_range or _padded(float(ys.min()), float(ys.max()))
    field_width, field_height = WIDTH - LEFT - RIGHT, chart.height - TOP - BOTTOM

    def px(x: float) -> float:
        return LEFT + field_width * (x - x_low) / (x_high - x_low)

    def py(y: float) -> float:
        return TOP + field_height * (1 - (y - y_low) / (y_high - y_low))

    parts = []
    for place, (start, end, words) in enumerate(chart.bands):
        parts.append(
            f'<rect class="band{place % 2}" x="{px(start):.1f}" y="{TOP}" width="{px(end) - px(start):.1f}" '
            f'height="{field_height}"><title>{escape(words)}</title></rect>'
            f'<text x="{px(start) + 6:.1f}" y="{TOP + 14}">{escape(words)}</text>'
        )
    for tick in nice_ticks(y_low, y_high):
        text = escape(chart.y_text(tick))
        parts.append(f'<path class="grid" d="M{LEFT} {py(tick):.1f}H{WIDTH - RIGHT}"/>')
        parts.append(f'<text x="{LEFT - 8}" y="{py(tick) + 4:.1f}" text-anchor="end">{text}</text>')
    below, bottom = chart.height - BOTTOM + 18, chart.height - BOTTOM
    parts += [
        f'<text x="{px(tick):.1f}" y="{below}" text-anchor="middle">{tick:g}</text>'
        for tick in nice_ticks(x_low, x_high, 8)
    ]
    parts += [f'<path class="mark" d="M{px(mark):.1f} {TOP}V{bottom}"/>' for mark in chart.marks]
    for curve in known:
        if curve.kind == "dots":
            for x, y in zip(curve.x.tolist(), curve.y.tolist(), strict=True):
                if math.isfinite(y):
                    parts.append(f'<circle class="dots" cx="{px(x):.1f}" cy="{py(y):.1f}" r="3.4"/>')
        else:
            parts.append(f'<path class="curve {curve.kind}" d="{_path(curve, px, py)}"/>')
    parts.append(f'<text x="{WIDTH - RIGHT}" y="{chart.height - 6}" text-anchor="end">{escape(chart.x_label)}</text>')
    legend = "".join(f'<span class="key {curve.kind}">{escape(curve.label)}</span>' for curve in known)
    title = f"{chart.y_label}: {', '.join(curve.label for curve in known)}"
    return (
        f'<figure><figcaption>{escape(chart.y_label)} <span class="keys">{legend}</span></figcaption>'
        f'<svg viewBox="0 0 {WIDTH} {chart.height}" role="img" aria-label="{escape(title, quote=True)}">'
        f"{''.join(parts)}</svg></figure>"
    )


def racing_line(
    track: Track,
    points: Floats,
    speeds: Floats,
    numbers: Sequence[tuple[float, str]] = (),
    puts: Sequence[int] = (),
    *,
    label: str = "Racing line, coloured by speed",
    point: str = ".",
) -> str:
    """A track with a line on it, coloured by speed, and labels beside places along the centre line.

    Args:
        track: What is drawn.
        points: x, y  (R, 2).
        speeds: m/s  (R,).
        numbers: Place in m, and what stands there.
        puts: Points that the car was put to, so that no line leads there.
        label: What is read to who does not see it.
        point: What stands before decimals.
    """
    view, unit = _frame(track)
    moving = speeds[speeds > 0.5 * np.median(speeds)] if len(speeds) and np.median(speeds) > 0 else speeds
    low, high = speed_range(moving) if len(moving) else (0.0, 1.0)
    parts = [_road(track, unit)]
    for index in range(len(points) - 1):
        if index + 1 in puts:
            continue
        red, green, blue = speed_color((speeds[index] - low) / (high - low))
        (x0, y0), (x1, y1) = points[index].tolist(), points[index + 1].tolist()
        parts.append(f'<path d="M{x0:.2f} {-y0:.2f}L{x1:.2f} {-y1:.2f}" stroke="rgb({red},{green},{blue})"/>')
    drawn = f'<g class="line" stroke-width="{unit * 0.008:.4f}">{"".join(parts[1:])}</g>'
    labels = []
    for place, text in numbers:
        center, heading = track.point_at(place), float(track.heading_at(place))
        side = -math.copysign(1.0, float(track.curvature_at(place)) or 1.0)
        away = side * (0.5 * float(track.width_at(place)) + 0.028 * unit)
        x, y = float(center[0]) - away * math.sin(heading), float(center[1]) + away * math.cos(heading)
        labels.append(
            f'<text class="corner" x="{x:.2f}" y="{-y + 0.008 * unit:.2f}" style="font-size:{0.022 * unit:.3f}px" '
            f'text-anchor="middle">{escape(text)}</text>'
        )
    bar = "".join(f'<i style="background:rgb{speed_color((piece + 0.5) / 24)}"></i>' for piece in range(24))
    slow, fast = (f"{speed:.1f}".replace(".", point) for speed in (low, high))
    return (
        f'<figure><svg class="track" viewBox="{view}" role="img" aria-label="{escape(label, quote=True)}">'
        f"{parts[0]}{drawn}{''.join(labels)}</svg>"
        f'<figcaption class="bar">{slow} m/s <span>{bar}</span> {fast} m/s</figcaption></figure>'
    )


def cell_map(track: Track, grid: Floats, values: Floats, label: str, exits: Floats) -> str:
    """Values of the cells of a grid, dark to light, with crosses at some places.

    Args:
        track: Drawn below.
        grid: Corners of the cells  (P + 1, O + 1, 2).
        values: NaN is left out  (P, O).
        label: What they are.
        exits: x, y of the crosses  (E, 2).
    """
    view, unit = _frame(track)
    known = values[np.isfinite(values)]
    if not len(known):
        return ""
    low, high = np.quantile(known, [0.02, 0.98]).tolist()
    high = _above(low, high)
    parts = []
    for place, across in np.argwhere(np.isfinite(values)).tolist():
        corners = [grid[place, across], grid[place, across + 1], grid[place + 1, across + 1], grid[place + 1, across]]
        d = "L".join(f"{corner[0]:.2f} {-corner[1]:.2f}" for corner in corners)
        parts.append(f'<path d="M{d}Z" fill="{shade((values[place, across] - low) / (high - low))}"/>')
    size = 0.006 * unit
    arm = 2 * size
    crosses = "".join(
        f"M{x - size:.2f} {-y - size:.2f}l{arm:.3f} {arm:.3f}m0 {-arm:.3f}l{-arm:.3f} {arm:.3f}"
        for x, y in exits[:400].tolist()
    )
    bar = "".join(f'<i style="background:{shade((piece + 0.5) / 24)}"></i>' for piece in range(24))
    return (
        f'<figure><svg class="track" viewBox="{view}" role="img" aria-label="{escape(label, quote=True)}">'
        f"{_road(track, unit)}{''.join(parts)}"
        f'<path class="exits" stroke-width="{0.002 * unit:.4f}" d="{crosses}"/></svg>'
        f'<figcaption class="bar">{low:.3g} <span>{bar}</span> {high:.3g}</figcaption></figure>'
    )


def shade(share: float) -> str:
    """CSS colour of a share from 0 to 1, dark violet over teal to yellow."""
    place = min(max(share, 0.0), 1.0) * (len(SCALE) - 1)
    index = min(int(place), len(SCALE) - 2)
    mixed = [round(a + (b - a) * (place - index)) for a, b in zip(SCALE[index], SCALE[index + 1], strict=True)]
    return f"#{mixed[0]:02x}{mixed[1]:02x}{mixed[2]:02x}"


def action_fan(actions: Sequence[tuple[float, float]], usage: Floats) -> str:
    """Discrete actions as arrows: direction the steering (drawn twice as wide), length the speed, weight the usage.

    Args:
        actions: Steering angle in degrees, left positive, and speed in m/s.
        usage: Share of each, or empty.
    """
    fastest = max((speed for _, speed in actions), default=1.0)
    most = float(usage.max()) if len(usage) else 1.0
    parts = []
    for index, (angle, speed) in enumerate(actions):
        turn, length = math.radians(2 * angle), 92 * speed / fastest
        x, y = 100 - math.sin(turn) * length, 108 - math.cos(turn) * length
        share = float(usage[index]) / most if index < len(usage) else (0.0 if len(usage) else 1.0)
        parts.append(
            f'<g opacity="{0.25 + 0.75 * share:.2f}"><path class="arrow" d="M100 108L{x:.1f} {y:.1f}"/>'
            f'<circle class="dots" cx="{x:.1f}" cy="{y:.1f}" r="{2 + 3.5 * share:.1f}"/></g>'
        )
    return (
        f'<svg class="fan" viewBox="0 0 200 124" role="img" aria-label="Actions">{"".join(parts)}'
        '<rect class="car" x="94" y="104" width="12" height="17" rx="3"/></svg>'
    )


def _path(curve: Curve, px: Callable[[float], float], py: Callable[[float], float]) -> str:
    stride = max(1, len(curve.x) // MAX_POINTS)
    points, pen = [], "M"
    for x, y in zip(curve.x[::stride].tolist(), curve.y[::stride].tolist(), strict=True):
        if not math.isfinite(y):
            pen = "M"
            continue
        points.append(f"{pen}{px(x):.1f} {py(y):.1f}")
        pen = "L"
    return "".join(points)


def _above(low: float, high: float) -> float:
    """The upper end of a scale, above the lower one however large that is."""
    return max(high, low + 1e-9 * max(1.0, abs(low)))


def _padded(low: float, high: float) -> tuple[float, float]:
    space = 0.06 * (high - low) or 0.5
    return low - space, high + space


def _frame(track: Track) -> tuple[str, float]:
    """The viewBox around a track, y down, and its larger side in m."""
    lines = np.concatenate([track.inner, track.outer])
    (left, bottom), (right, top) = lines.min(axis=0).tolist(), lines.max(axis=0).tolist()
    margin = 0.05 * max(right - left, top - bottom)
    width, height = right - left + 2 * margin, top - bottom + 2 * margin
    return f"{left - margin:.2f} {-top - margin:.2f} {width:.2f} {height:.2f}", max(width, height)


def _road(track: Track, unit: float) -> str:
    """The road between its borders, its centre line and the start."""

    def ring(line: Floats) -> str:
        return "L".join(f"{x:.2f} {-y:.2f}" for x, y in line.tolist())

    if track.is_closed:
        d = f"M{ring(track.inner)}ZM{ring(track.outer)}Z"
    else:
        d = f"M{ring(np.concatenate([track.inner, track.outer[::-1]]))}Z"
    start = track.point_at(0.0)
    across = float(track.heading_at(0.0)) + math.pi / 2
    half = 0.5 * float(track.width_at(0.0))
    x, y = half * math.cos(across), half * math.sin(across)
    line = f"M{start[0] - x:.2f} {-(start[1] - y):.2f}L{start[0] + x:.2f} {-(start[1] + y):.2f}"
    return (
        f'<path class="road" fill-rule="evenodd" stroke-width="{0.003 * unit:.4f}" d="{d}"/>'
        f'<path class="start" stroke-width="{0.006 * unit:.4f}" d="{line}"/>'
    )
