"""Pictures of tracks to hang on a wall: `draw_track`, `draw_contact_sheet`, `TrackPicture` underneath.

`TrackPicture` draws the sheet and the road and keeps the way from metres to pixels, so that a racing line
can be laid over the road before the captions come on top:

    picture = TrackPicture(track, width_px=1600)
    picture.canvas.line(places, (230, 80, 60), width_px=3)      # places in metres, (P, 2)
    picture.caption(title="Lap 3", figures=[("LAP TIME", "8.412 s")])
    picture.save("lap.png")
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from racecraft.checks import check_path, check_type
from racecraft.errors import TrackError
from racecraft.track.canvas import Canvas, text_width
from racecraft.track.corners import TrackCorner, find_corners
from racecraft.track.library import course, track_names
from racecraft.track.polyline import Floats
from racecraft.track.road_art import (
    GRID,
    INK,
    KERB_WIDTH,
    PAPER,
    SOFT_INK,
    Ribbon,
    paint_arrow,
    paint_infield,
    paint_road,
)
from racecraft.track.track import Track

if TYPE_CHECKING:
    from PIL import Image

RULE = (205, 200, 188)  # colour of the hairline above the figures
MIN_WIDTH_PX, MAX_WIDTH_PX = 320, 6000
SCALE_BARS = (0.5, 1, 2, 5, 10, 20, 50, 100, 200, 500, 1000, 2000)  # metres
SMALL_ROAD = 9.0  # hundredths of a cell; on narrower roads the chevrons at the start cannot be read
SLIDES = np.array((0.0, 0.12, -0.12, 0.24, -0.24, 0.36, -0.36, 0.48, -0.48))  # of a number from apex, lengths of corner
SUFFIXES = (".png", ".jpg", ".jpeg", ".webp")


class TrackPicture:
    """A sheet with the road on it, ready for overlays and captions.

    Attributes:
        canvas: Draws in metres; `canvas.to_pixels` tells where a place lies in the finished picture.
        corners: The numbered corners, in driving order.

    Args:
        track: What to draw.
        width_px: Width of the picture, pixels; the height follows from the track.
        has_numbers: Whether corners are numbered.

    Raises:
        TrackError: The width is not allowed.
    """

    def __init__(self, track: Track, *, width_px: int = 1600, has_numbers: bool = True) -> None:
        _check_width(width_px)
        self.track = track
        self.corners = find_corners(track)
        self._unit = unit = width_px / 100.0  # everything that is not road is measured in hundredths of the width
        head, foot, side = 15.5 * unit, 14.0 * unit, 8.5 * unit
        size_x, size_y = _extent(track)
        scale = min((width_px - 2 * side) / size_x, 72.0 * unit / size_y, 12.0 * unit / track.mean_width)
        area = (side, head, width_px - side, head + max(size_y * scale, 14.0 * unit))
        self.canvas = _canvas_for(track, (width_px, round(area[3] + foot)), area, scale)
        self._area = (
            2.0 * unit,
            11.4 * unit,
            width_px - 2.0 * unit,
            area[3] + foot - 10.6 * unit,
        )  # for the numbers
        self._ribbon = Ribbon(track)
        borders = np.concatenate((self._ribbon.left, self._ribbon.right))
        self._borders = borders[borders[:, 0].argsort()]  # from left to right, as a long road has very many
        self.canvas.dots(1.0, GRID, radius_px=max(0.5, 0.09 * unit))
        paint_infield(self.canvas, self._ribbon)
        paint_road(self.canvas, track, self._ribbon, self.corners, shadow_px=0.75 * unit)
        if has_numbers:
            self._number_corners()

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of the picture, pixels."""
        return self.canvas.size

    def caption(
        self,
        *,
        title: str | None = None,
        subtitle: str | None = None,
        figures: Sequence[tuple[str, str]] | None = None,
        has_scale: bool = True,
        beside: float = 0.0,
    ) -> None:
        """Writes the title above the track, and figures and a scale bar below it.

        Args:
            title: Default: the track's display name.
            subtitle: Default: the track's description.
            figures: (label, value) pairs. Default: length, width, tightest radius, corners, direction.
            has_scale: Whether there is a scale bar.
            beside: Room for something else than the title in the upper right corner, share of the picture's width.
        """
        own_title, own_subtitle = describe(self.track)
        title = own_title if title is None else title
        subtitle = own_subtitle if subtitle is None else subtitle
        unit, canvas = self._unit, self.canvas
        left, right, top = 5.0 * unit, 95.0 * unit, self.size[1] - 7.6 * unit
        room = right - left - 100.0 * unit * beside
        _fitted(canvas, (left, 7.2 * unit), title, size=4.0 * unit, room=room, weight=0.03)
        _fitted(canvas, (left, 10.0 * unit), subtitle, size=1.55 * unit, room=right - left, is_soft=True)
        canvas.box((left, top - 2.4 * unit, right, top - 2.4 * unit + max(1.0, 0.1 * unit)), RULE)
        x = left
        for label, value in self._figures() if figures is None else figures:
            label_width = canvas.text(
                (x, top + 0.7 * unit), label, SOFT_INK, size=0.95 * unit, spacing=0.12, weight=0.01
            )
            value_width = canvas.text((x, top + 3.2 * unit), value, INK, size=1.9 * unit, weight=0.018)
            x += max(label_width, value_width) + 3.4 * unit
        if has_scale:
            self._scale_bar(right, top)

    def image(self) -> Image.Image:
        """The finished picture."""
        return self.canvas.finish()

    def save(self, path: str | Path) -> Path:
        """Writes the picture; the file's ending says how (.png, .jpg, .webp).

        Raises:
            TrackError: The ending is not one of an image, or the file cannot be written.
        """
        path = _image_path(path)
        _write(self.image(), path)
        return path

    def _number_corners(self) -> None:
        """A numbered disc beside each corner, on the outside of the bend where the road leaves room."""
        canvas, radius = self.canvas, 1.15 * self._unit
        reach = (radius + 0.5 * self._unit) / canvas.scale
        taken: list[Floats] = []
        for number, corner in enumerate(self.corners, start=1):
            place = self._free_place(corner, reach, taken)
            if place is None:
                continue
            taken.append(place)
            canvas.disc(place, INK, radius_px=radius)
            x, y = canvas.to_pixels(place).tolist()
            canvas.text((x, y), str(number), PAPER, size=1.25 * self._unit, weight=0.02, anchor="mm")

    def _free_place(self, corner: TrackCorner, reach: float, taken: list[Floats]) -> Floats | None:
        """A place for a disc of radius `reach`, metres, off the road and apart from the others."""
        outside = 1.0 if corner.turn > 0 else -1.0
        place: Floats
        slides = corner.apex + SLIDES * (corner.end - corner.start)
        for side, out in ((outside, 1.0), (-outside, 1.0), (outside, 1.6), (-outside, 1.6)):
            for place in self._ribbon.beside(slides, side, out * reach + (KERB_WIDTH if side != outside else 0.0)):
                if self._is_free(place, reach) and all(np.hypot(*(place - other)) > 1.7 * reach for other in taken):
                    return place
        return None

    def _is_free(self, place: Floats, reach: float) -> bool:
        x, y = self.canvas.to_pixels(place).tolist()
        margin = reach * self.canvas.scale
        x_min, y_min, x_max, y_max = self._area
        if not (x_min + margin < x < x_max - margin and y_min + margin < y < y_max - margin):
            return False
        near = 0.9 * reach
        begin, end = np.searchsorted(self._borders[:, 0], (place[0] - near, place[0] + near))
        if (np.hypot(*(self._borders[begin:end] - place).T) < near).any():
            return False
        s, offset = self.track.project(place)
        return abs(float(offset)) > float(self.track.width_at(s)) / 2

    def _figures(self) -> list[tuple[str, str]]:
        track = self.track
        narrow, wide = float(track.widths.min()), float(track.widths.max())
        is_even = wide - narrow < 0.02 * wide
        figures = [
            ("LENGTH", f"{track.length:.2f} m"),
            ("WIDTH", f"{track.mean_width:.2f} m" if is_even else f"{narrow:.2f} - {wide:.2f} m"),
        ]
        if math.isfinite(track.min_radius) and self.corners:
            figures.append(("TIGHTEST RADIUS", f"{track.min_radius:.2f} m"))
        figures.append(("CORNERS", str(len(self.corners) or "none")))
        figures.append(("DIRECTION", track.direction.capitalize() if track.is_closed else "Point to point"))
        return figures

    def _scale_bar(self, right: float, top: float) -> None:
        canvas, unit = self.canvas, self._unit
        metres = max((step for step in SCALE_BARS if step * canvas.scale <= 14.0 * unit), default=SCALE_BARS[0])
        quarter, thick = metres * canvas.scale / 4, max(1.0, 0.4 * unit)
        for index in range(4):
            start = right - (4 - index) * quarter
            color = INK if index % 2 else SOFT_INK
            canvas.box((start, top + 2.3 * unit, start + quarter, top + 2.3 * unit + thick), color)
        canvas.text((right, top + 0.7 * unit), f"{metres:g} m", INK, size=1.2 * unit, weight=0.01, anchor="rs")


def draw_track(track: Track, path: str | Path, *, width_px: int = 1600) -> Path:
    """Writes a picture of a track with title, figures and scale.

    Args:
        track: What to draw.
        path: Where to; the ending says how (.png, .jpg, .webp).
        width_px: Width of the picture, pixels; the height follows from the track.

    Raises:
        TrackError: The width or the file's ending is not allowed.
        ConfigError: It is no track.
    """
    check_type("track", track, Track, "get one with load_track(name or path)")
    _image_path(path)
    picture = TrackPicture(track, width_px=width_px)
    picture.caption()
    return picture.save(path)


def draw_contact_sheet(
    tracks: Iterable[Track], path: str | Path, *, columns: int = 4, width_px: int = 2400, title: str = ""
) -> Path:
    """Writes one picture of many tracks, each filling its cell, with name, length and width below.

    Args:
        tracks: What to draw, row by row.
        path: Where to; the ending says how (.png, .jpg, .webp).
        columns: Cells in a row, 1 to 12.
        width_px: Width of the picture, pixels.
        title: Written above, if any.

    Raises:
        TrackError: No tracks, or a width, number of columns or file's ending that is not allowed.
    """
    from PIL import Image

    path, tracks = _image_path(path), list(tracks)
    if not tracks:
        raise TrackError("A contact sheet needs at least one track.")
    if not 1 <= columns <= 12:
        raise TrackError(f"columns is {columns!r}; allowed are 1 to 12.")
    _check_width(width_px)
    margin = round(width_px * 0.03)
    cell = (width_px - 2 * margin) // columns
    head = round(width_px * 0.07) if title else margin
    height = cell * 9 // 10
    sheet = Image.new("RGB", (width_px, head + margin + -(-len(tracks) // columns) * height), PAPER)
    if title:
        header = Canvas((width_px, head), scale=1.0, origin=(0.0, 0.0), background=PAPER)
        place, room = (margin + 0.06 * cell, 0.7 * head), width_px - 2 * margin - 0.12 * cell
        _fitted(header, place, title, size=0.025 * width_px, room=room, weight=0.03)
        sheet.paste(header.finish(), (0, 0))
    for index, track in enumerate(tracks):
        row, column = divmod(index, columns)
        sheet.paste(_cell(track, (cell, height)), (margin + column * cell, head + row * height))
    _write(sheet, path)
    return path


def _write(image: Image.Image, path: Path) -> None:
    try:
        image.save(path)
    except OSError as error:
        raise TrackError(f"{path} cannot be written: {error.strerror or error}.") from error


def describe(track: Track) -> tuple[str, str]:
    """Display name of a track, and one line about it."""
    if track.name in track_names():
        design = course(track.name)
        return design.display_name, design.description
    if track.name.startswith("generated:"):
        seed, *options = track.name.removeprefix("generated:").split(",")
        return f"Seed {seed}", ", ".join(["Drawn by the generator", *options]).replace("=", " ")
    kind = "Closed circuit" if track.is_closed else "Open road"
    title = track.name.replace("_", " ").strip() or "Track"
    return title[0].upper() + title[1:], f"{kind} of {len(track.centerline)} waypoints"


def _cell(track: Track, size: tuple[int, int]) -> Image.Image:
    unit = size[0] / 100.0
    area = (6.0 * unit, 6.0 * unit, 94.0 * unit, size[1] - 21.0 * unit)
    size_x, size_y = _extent(track)
    scale = min((area[2] - area[0]) / size_x, (area[3] - area[1]) / size_y, 20.0 * unit / track.mean_width)
    canvas, ribbon = _canvas_for(track, size, area, scale), Ribbon(track)
    paint_infield(canvas, ribbon)
    paint_road(canvas, track, ribbon, find_corners(track), shadow_px=1.2 * unit)
    if track.mean_width * scale < SMALL_ROAD * unit:
        paint_arrow(canvas, track, ribbon, length_px=0.75 * SMALL_ROAD * unit)
    name = describe(track)[0] if track.name in track_names() else track.name
    room = 88.0 * unit
    _fitted(canvas, (6.0 * unit, size[1] - 12.0 * unit), name, size=5.8 * unit, room=room, weight=0.022)
    figures = f"{track.length:.1f} m  ·  {track.mean_width:.2f} m wide"
    _fitted(canvas, (6.0 * unit, size[1] - 5.5 * unit), figures, size=4.6 * unit, room=room, is_soft=True)
    return canvas.finish()


def _extent(track: Track) -> tuple[float, float]:
    x_min, y_min, x_max, y_max = track.bounds
    return max(x_max - x_min, 1e-3), max(y_max - y_min, 1e-3)


def _canvas_for(track: Track, size: tuple[int, int], area: tuple[float, float, float, float], scale: float) -> Canvas:
    """A canvas with the track in the middle of an area, pixels."""
    x_min, y_min, x_max, y_max = track.bounds
    origin = (
        (area[0] + area[2]) / 2 - scale * (x_min + x_max) / 2,
        (area[1] + area[3]) / 2 + scale * (y_min + y_max) / 2,
    )
    return Canvas(size, scale=scale, origin=origin, background=PAPER)


def _fitted(
    canvas: Canvas, place: tuple[float, float], words: str, *,
    size: float, room: float, weight: float = 0.0, is_soft: bool = False,
) -> None:  # fmt: skip
    """Writes words no wider than `room`: smaller if need be, and cut if they would get too small to read."""
    shortest, kept = 0.6 * size, len(words)
    while kept > 1 and text_width(words, size=shortest) > room:
        kept = kept * 9 // 10
        words = words[:kept].rstrip() + "..."
    size = min(size, size * room / max(text_width(words, size=size), 1e-9))
    canvas.text(place, words, SOFT_INK if is_soft else INK, size=size, weight=weight)


def _check_width(width_px: int) -> None:
    if not isinstance(width_px, int | np.integer) or not MIN_WIDTH_PX <= width_px <= MAX_WIDTH_PX:
        raise TrackError(f"width_px is {width_px!r}; allowed are {MIN_WIDTH_PX} to {MAX_WIDTH_PX} pixels.")


def _image_path(path: str | Path) -> Path:
    check_path("path", path, "use a file's path")
    path = Path(path)
    if path.suffix.lower() not in SUFFIXES:
        raise TrackError(f"Cannot write a picture to {path.name!r}; the name must end in one of {', '.join(SUFFIXES)}.")
    return path
