"""A picture of two windows of a log, the median and the worst: where the car went and where ours would have gone."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from racecraft.errors import ConfigError
from racecraft.fidelity.dynamics import FREE_STEPS, REFERENCE_AHEAD
from racecraft.sim.simulation import CONTROL_DT
from racecraft.track.canvas import Canvas, Color

if TYPE_CHECKING:
    from PIL import Image

    from racecraft.fidelity.comparison import Comparison, Example
    from racecraft.track.track import Track

PANEL: Final = 800  # pixels, square
HEAD: Final = 84  # pixels above a panel for its words
PAPER: Final[Color] = (250, 249, 246)
ROAD: Final[Color] = (226, 226, 222)
EDGE: Final[Color] = (150, 150, 146)
INK: Final[Color] = (34, 38, 46)
SOFT_INK: Final[Color] = (120, 120, 116)
LOGGED: Final[Color] = (34, 38, 46)
PREDICTED: Final[Color] = (224, 73, 49)
ENDINGS: Final = (".png", ".jpg", ".jpeg", ".webp")


def draw_comparison(comparison: Comparison, path: str | Path) -> Path:
    """Write the picture of a comparison's example windows.

    Args:
        comparison: What `replay` returned.
        path: Where to; the ending says how (.png, .jpg, .webp).

    Raises:
        ConfigError: The log has no window to draw, or the ending is none of these.
    """
    from PIL import Image

    path = check_ending(path)
    if not comparison.examples:
        raise ConfigError("The log holds no 21 steps in a row: there is nothing to draw.")
    names = ("Median window", "Worst window")
    panels = [_panel(comparison.track, example, name) for name, example in zip(names, comparison.examples, strict=True)]
    sheet = Image.new("RGB", (PANEL * len(panels), PANEL + HEAD), PAPER)
    for number, panel in enumerate(panels):
        sheet.paste(panel.finish(), (PANEL * number, 0))
    return save_picture(sheet, path)


def check_ending(path: str | Path) -> Path:
    """The path of a picture, refused with a ConfigError where its ending is unknown."""
    path = Path(path)
    if path.suffix.lower() not in ENDINGS:
        raise ConfigError(f"{path} ends in {path.suffix!r}; a picture's name ends in {', '.join(ENDINGS)}.")
    return path


def save_picture(picture: Image.Image, path: Path) -> Path:
    """Write a picture, and its folder; a ConfigError where that fails."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        picture.save(path)
    except OSError as error:
        raise ConfigError(f"{path} cannot be written: {error.strerror or error}.") from error
    return path


def _panel(track: Track, example: Example, name: str) -> Canvas:
    known, truth, predicted = map(front, (example.known, example.truth, example.prediction))
    everything = np.concatenate([known, truth, predicted])
    low, high = everything.min(axis=0), everything.max(axis=0)
    middle, span = (low + high) / 2, max(float((high - low).max()) * 1.25, 0.8)
    scale = PANEL / span
    canvas = Canvas(
        (PANEL, PANEL + HEAD),
        scale=scale,
        origin=(PANEL / 2 - scale * middle[0], HEAD + PANEL / 2 + scale * middle[1]),
        background=PAPER,
    )
    for index in range(len(track.centerline) - 1):
        piece = [track.inner[index], track.inner[index + 1], track.outer[index + 1], track.outer[index]]
        if np.abs(np.array(piece) - middle).min() < 2 * span:
            canvas.polygon(piece, ROAD)
    for border in (track.inner, track.outer):
        canvas.line(border, EDGE, width_px=2)
    start = known[-1:]
    for points, color in ((np.concatenate([known, truth]), LOGGED), (np.concatenate([start, predicted]), PREDICTED)):
        canvas.line(points, color, width_px=4)
        for point in points:
            canvas.disc(point, color, radius_px=6)
    canvas.disc(start[0], PAPER, radius_px=4)
    canvas.box((0, 0, PANEL, HEAD), PAPER)
    canvas.text((28, 38), name, INK, size=26, weight=0.04)
    seconds = FREE_STEPS * CONTROL_DT
    canvas.text(
        (28, 66),
        f"{100 * example.error:.1f} cm apart after {seconds:g} s · {example.source}, line {example.line}",
        SOFT_INK,
        size=18,
    )
    canvas.text((PANEL - 28, 38), "logged", LOGGED, size=20, weight=0.04, anchor="rs")
    canvas.text((PANEL - 28, 66), "predicted", PREDICTED, size=20, weight=0.04, anchor="rs")
    return canvas


def front(poses: NDArray[np.float64]) -> NDArray[np.float64]:
    """The logged point of poses of the car's origin   (P, 2)."""
    ahead = REFERENCE_AHEAD * np.stack([np.cos(poses[:, 2]), np.sin(poses[:, 2])], axis=1)
    return np.asarray(poses[:, :2] + ahead)
