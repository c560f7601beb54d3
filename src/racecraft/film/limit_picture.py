"""The picture of a track's limit: the ideal line coloured by speed, the medals below."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from racecraft.errors import ConfigError
from racecraft.film.racing_line import BAR_ROOM, OUTLINE, color_bar, speed_color, speed_range
from racecraft.limits import TrackLimit
from racecraft.track.picture import TrackPicture, describe
from racecraft.track.track import Track


def draw_limit(track: Track, limit: TrackLimit, path: str | Path, *, width_px: int = 1600) -> Path:
    """Write the picture of a computed limit.

    Args:
        track: In driving direction.
        limit: From `compute_limit`.
        path: Where to; the ending says how (.png, .jpg, .webp).
        width_px: Width of the picture, pixels.

    Raises:
        ConfigError: The limit is one from the table, which holds no lines.
        TrackError: The width or the file's ending is not allowed.
    """
    if limit.line is None:
        raise ConfigError("This limit has no line to draw.", hint="Compute it with racecraft.limits.compute_limit.")
    picture = TrackPicture(track, width_px=width_px)
    unit, line = width_px / 100.0, limit.line
    low, high = speed_range(line.speeds)
    fine = np.linspace(0.0, line.nodes[-1], 6 * len(line.nodes))
    places = np.stack([np.interp(fine, line.nodes, column) for column in line.places.T], axis=1)
    speeds = np.interp(fine, line.nodes, line.speeds)
    colors = [speed_color((speed - low) / (high - low)) for speed in speeds[:-1].tolist()]
    width = float(np.clip(0.09 * picture.canvas.scale, 0.3 * unit, 0.7 * unit))
    picture.canvas.line(places, OUTLINE, width_px=width + 0.16 * unit)
    picture.canvas.line(places, OUTLINE, width_px=width, colors=colors)
    medals = limit.medals
    figures = [
        ("LIMIT", f"{limit.ideal:.2f} s"),
        ("AUTHOR", f"{medals.author:.2f} s"),
        ("GOLD", f"{medals.gold:.2f} s"),
    ]
    figures += [("SILVER", f"{medals.silver:.2f} s"), ("BRONZE", f"{medals.bronze:.2f} s")]
    picture.caption(
        title=describe(track)[0], subtitle="The fastest lap that the car can do", figures=figures, beside=BAR_ROOM
    )
    color_bar(picture.canvas, unit, low, high)
    return picture.save(path)
