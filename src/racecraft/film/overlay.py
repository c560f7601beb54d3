"""What is written over a race video: who, where, lap and times, speed, steering, progress, mistakes, ghosts, a map.

name                                  LAP     TIME
track                                 2/3    12.47      what never changes lies in one layer that is blended
           ( OFF TRACK  3.2 s )         BEST 11.87      in two bands; the rest is a few letters and bars a
                                                        frame, so that all of it costs about a millisecond
                                       +--------+
 map     SPEED      STEERING           | driver |
         2.4 m/s    12° left           |        |
         -----      --===|----         +--------+
===== progress =============____________________
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from racecraft.film.ghost import LIVERY, Ghost, Rival
from racecraft.film.lettering import Lettering, Mask, blend, disc_mask, pill_mask
from racecraft.film.racing_line import SPEED_COLORS, speed_color
from racecraft.race.recording import Recording
from racecraft.race.rules import RESET_STATUSES
from racecraft.sim.simulation import CONTROL_DT, MAX_STEERING
from racecraft.sim.views import CarView
from racecraft.track.canvas import Color
from racecraft.track.picture import describe

Place = tuple[int, int]
"""Pixel of a frame, x and y."""

WIDTH, HEIGHT = 640, 480
"""Pixels of a frame."""
INSET: Final = (448, 330, 176, 132)
"""x, y, width, height of the driver's view, pixels."""

WHITE: Final[Color] = (250, 249, 245)
SOFT: Final[Color] = (188, 192, 199)
DARK: Final[Color] = (14, 16, 20)
ACCENT: Final[Color] = SPEED_COLORS[3]
TROUGH: Final[Color] = (74, 79, 89)
ALARM: Final[Color] = (214, 48, 49)
FINISHED: Final[Color] = (38, 148, 84)

TOP_BAND, BOTTOM_BAND = 132, 156  # pixels, of the shaded parts
MARGIN = 16
MAP: Final = (12, 350, 120, 116)  # x, y, width, height
SPEED_X, STEERING_X, GAUGE_WIDTH, GAUGE_Y = 150, 300, 128, 462
PROGRESS_HEIGHT = 5
NAMES_Y, NAMES_LINE, SHOWN_NAMES = 84, 18, 9  # pixels of the first name and from one to the next, names
MAX_SPEED = 4.0  # m/s, the end of the gauge

LABELS: Final = {
    "off_track": "OFF TRACK",
    "crashed": "CRASHED",
    "immobilized": "STUCK",
    "reversed": "WRONG WAY",
    "time_up": "TIME UP",
    "lap_complete": "FINISHED",
    "in_progress": "STOPPED",
}

_TITLE, _TINY, _SMALL = Lettering(22, weight=0.02), Lettering(10, weight=0.01), Lettering(13)
_LARGE, _PILL = Lettering(28, weight=0.02), Lettering(15, weight=0.02)


class Overlay:
    """Draws everything but the pictures themselves, for the steps of one recording.

    Args:
        recording: What is shown.
        name: The racer's.
        laps: Laps that the race has; 0 if that is not known.
        color: Of the car.
        ghosts: Named beside their colour, and shown on the map.
        rivals: The same, in a table with the car itself, whoever is ahead on top.
    """

    def __init__(
        self,
        recording: Recording,
        *,
        name: str,
        laps: int = 0,
        color: Color = LIVERY[0],
        ghosts: Sequence[Ghost] = (),
        rivals: Sequence[Rival] = (),
    ) -> None:
        self._recording = recording
        self._laps = laps
        self._lap = recording.lap_numbers.tolist()
        self._lap_time = recording.lap_clock.tolist()
        self._best = _best_so_far(recording)
        self._speed = np.abs(recording.column("actual_speed")).tolist()
        self._steering = recording.column("actual_steering_angle").tolist()
        self._progress = recording.column("progress").clip(0.0, 1.0).tolist()
        self._mistake, self._remaining = _penalties(recording)
        self._ghosts = ghosts
        self._beside = [ghost.beside(recording) for ghost in ghosts]
        self._map, self._pixels = _map(recording)
        self._places = self._pixels(recording.origins)
        field = [Rival(name, color, recording), *rivals] if rivals else []
        self._field = [
            (rival, self._pixels(rival.recording.origins[steps]), rival.recording.distances[steps])
            for rival in field
            for steps in [rival.recording.steps_at(recording.clock)]
        ]
        self._static = _Layer(self._drawn_once(name))

    def ghosts_at(self, step: int) -> list[CarView | None]:
        """Where every ghost is when the car is in a step; None for one that is no longer there."""
        return [views[step] for views in self._beside]

    def draw(self, frame: NDArray[np.uint8], step: int, *, is_over: bool = False) -> None:
        """Draw over the frame of a step.

        Args:
            frame: The chase view with the driver's view in place, RGB (480, 640, 3).
            step: Which step of the recording.
            is_over: Show how the race ended.
        """
        self._static.blend(frame)
        self._draw_laps(frame, step)
        self._draw_gauges(frame, step)
        self._draw_others(frame, step)
        disc = disc_mask(5.0)
        x, y = self._places[step]
        blend(frame, x - disc.shape[1] // 2, y - disc.shape[0] // 2, disc, DARK)
        disc = disc_mask(3.6)
        blend(frame, x - disc.shape[1] // 2, y - disc.shape[0] // 2, disc, ACCENT)
        if is_over:
            status = self._recording.statuses[step]
            is_finished = status == "lap_complete"
            figure = f"{self._recording.clock[step]:.2f} s" if is_finished else f"{100 * self._progress[step]:.0f} %"
            _draw_pill(frame, LABELS.get(status, "STOPPED"), figure, FINISHED if is_finished else ALARM)
        elif self._mistake[step]:
            _draw_pill(frame, LABELS[self._mistake[step]], f"{self._remaining[step]:.1f} s", ALARM)

    def _draw_others(self, frame: NDArray[np.uint8], step: int) -> None:
        """Dots on the map; names: of a race the table as it stands, then those of ghosts."""
        disc = disc_mask(3.2)
        shown: list[tuple[str, Color, Color]] = []
        ahead = sorted(self._field, key=lambda entry: -float(entry[2][step]))
        for place, (rival, places, _) in enumerate(ahead, start=1):
            is_own = rival.recording is self._recording
            shown.append((f"{place}  {rival.name}", rival.color, WHITE if is_own else SOFT))
            x, y = places[step]
            if not is_own:
                blend(frame, x - disc.shape[1] // 2, y - disc.shape[0] // 2, disc, rival.color)
        for ghost, view in zip(self._ghosts, self.ghosts_at(step), strict=True):
            shown.append((ghost.name, ghost.color, SOFT if view is None else WHITE))
            if view is not None:
                ((x, y),) = self._pixels(np.array([[view.x, view.y]]))
                blend(frame, x - disc.shape[1] // 2, y - disc.shape[0] // 2, disc, ghost.color)
        disc = disc_mask(4.5)
        for line, (words, color, ink) in enumerate(shown[:SHOWN_NAMES]):
            y = NAMES_Y + line * NAMES_LINE
            blend(frame, MARGIN, y - disc.shape[0] + 1, disc, color)
            words = _fitted(words, _SMALL, 240)
            _SMALL.draw(frame, MARGIN + 17, y + 1, words, DARK)
            _SMALL.draw(frame, MARGIN + 16, y, words, ink)

    def _draw_laps(self, frame: NDArray[np.uint8], step: int) -> None:
        right = WIDTH - MARGIN
        _LARGE.draw(frame, right, 45, f"{self._lap_time[step]:.2f}", WHITE, anchor="r")
        lap = f"{self._lap[step]}/{self._laps}" if self._laps else str(self._lap[step])
        _LARGE.draw(frame, right - 118, 45, lap, WHITE, anchor="r")
        best = self._best[step]
        if best:
            _SMALL.draw(frame, right, 65, f"BEST {best:.2f}", SOFT, anchor="r")

    def _draw_gauges(self, frame: NDArray[np.uint8], step: int) -> None:
        speed, steering = self._speed[step], self._steering[step]
        _LARGE.draw(frame, SPEED_X, GAUGE_Y - 8, f"{speed:.1f}", WHITE)
        share = min(speed / MAX_SPEED, 1.0)
        _bar(frame, SPEED_X, GAUGE_Y, share * GAUGE_WIDTH, speed_color(share))

        degrees = round(float(np.degrees(steering)))
        _LARGE.draw(frame, STEERING_X, GAUGE_Y - 8, f"{abs(degrees)}°", WHITE)
        if degrees:
            side = "left" if degrees > 0 else "right"
            x = STEERING_X + _LARGE.width(f"{abs(degrees)}°") + 5
            _SMALL.draw(frame, x, GAUGE_Y - 8, side, SOFT)
        middle = STEERING_X + GAUGE_WIDTH // 2
        length = min(abs(steering) / MAX_STEERING, 1.0) * GAUGE_WIDTH / 2
        _bar(frame, middle - (length if steering > 0 else 0.0), GAUGE_Y, length, ACCENT)
        frame[GAUGE_Y - 3 : GAUGE_Y + 7, middle - 1 : middle + 1] = WHITE

        frame[HEIGHT - PROGRESS_HEIGHT :, : round(self._progress[step] * WIDTH)] = ACCENT

    def _drawn_once(self, name: str) -> NDArray[np.uint16]:
        """Colours times coverage, and coverage from 0 to 256, of all that does not change  (480, 640, 4)."""
        frames = []
        for background in (0, 255):  # what is drawn over black and over white tells colour and coverage
            frame = np.full((HEIGHT, WIDTH, 3), background, dtype=np.uint8)
            _shade(frame)
            title, subtitle = name or describe(self._recording.track)[0], describe(self._recording.track)[0]
            _TITLE.draw(frame, MARGIN, 40, _fitted(title, _TITLE, 330), WHITE)
            if name:
                _SMALL.draw(frame, MARGIN, 61, _fitted(subtitle, _SMALL, 330), SOFT)
            _TINY.draw(frame, WIDTH - MARGIN, 18, "LAP TIME", SOFT, anchor="r")
            _TINY.draw(frame, WIDTH - MARGIN - 118, 18, "LAP", SOFT, anchor="r")
            _TINY.draw(frame, SPEED_X, GAUGE_Y - 33, "SPEED", SOFT)
            _SMALL.draw(frame, SPEED_X + _LARGE.width("0.0") + 5, GAUGE_Y - 8, "m/s", SOFT)
            _TINY.draw(frame, STEERING_X, GAUGE_Y - 33, "STEERING", SOFT)
            _bar(frame, SPEED_X, GAUGE_Y, GAUGE_WIDTH, TROUGH)
            _bar(frame, STEERING_X, GAUGE_Y, GAUGE_WIDTH, TROUGH)
            frame[HEIGHT - PROGRESS_HEIGHT :] = TROUGH
            for mask, color in self._map:
                blend(frame, MAP[0], MAP[1], mask, color)
            x, y, width, height = INSET
            frame[y - 2 : y + height + 2, x - 2 : x + width + 2] = WHITE
            frame[y : y + height, x : x + width] = background  # the driver's view stays as it is
            frames.append(frame.astype(np.int32))
        over_black, over_white = frames
        coverage = 256 - (over_white - over_black).mean(axis=2, keepdims=True) * (256 / 255)
        layer = np.concatenate((256 * over_black, coverage.round().clip(0, 256)), axis=2)
        return np.asarray(layer.astype(np.uint16))


class _Layer:
    """A picture with coverage, blended only in the bands at the top and at the bottom."""

    def __init__(self, layer: NDArray[np.uint16]) -> None:
        bands = (slice(0, TOP_BAND), slice(HEIGHT - BOTTOM_BAND, HEIGHT))
        self._bands = []
        for rows in bands:
            color = layer[rows, :, :3].copy()
            # one number for each channel and a place for the sum, for speed
            self._bands.append((rows, color, np.repeat(256 - layer[rows, :, 3:], 3, axis=2), np.empty_like(color)))

    def blend(self, frame: NDArray[np.uint8]) -> None:
        for rows, color, clearness, mixed in self._bands:
            np.multiply(frame[rows], clearness, out=mixed)
            np.add(mixed, color, out=mixed)
            np.right_shift(mixed, 8, out=mixed)
            frame[rows] = mixed


def _shade(frame: NDArray[np.uint8]) -> None:
    """Darken towards the upper and the lower edge, so that letters are readable on any ground."""
    strength = np.zeros(HEIGHT)
    strength[:TOP_BAND] = np.minimum(np.linspace(1.7, 0.0, TOP_BAND), 0.82)
    strength[HEIGHT - BOTTOM_BAND :] = np.linspace(0.0, 0.9, BOTTOM_BAND) ** 2
    mask = np.broadcast_to((256 * strength).astype(np.uint16)[:, None, None], (HEIGHT, WIDTH, 1))
    blend(frame, 0, 0, mask, DARK)


def _bar(frame: NDArray[np.uint8], x: float, y: int, width: float, color: Color) -> None:
    left, right = round(x), round(x + width)
    if right > left:
        frame[y : y + 4, left:right] = color


def _draw_pill(frame: NDArray[np.uint8], label: str, figure: str, color: Color) -> None:
    gap = 10
    inner = _PILL.width(label) + gap + _PILL.width(figure)
    mask = pill_mask(inner + 36, 32)
    left = (WIDTH - mask.shape[1]) // 2
    blend(frame, left, 96, (mask * 15 >> 4).astype(np.uint16), color)
    _PILL.draw(frame, left + 18, 117, label, WHITE)
    _PILL.draw(frame, left + 18 + inner, 117, figure, WHITE, anchor="r")


def _best_so_far(recording: Recording) -> list[float]:
    """Best lap completed up to every step, s; 0 while there is none."""
    best, times = 0.0, recording.lap_times
    found = []
    for number, status in zip(recording.lap_numbers.tolist(), recording.statuses, strict=True):
        if status == "lap_complete":
            best = min(best or np.inf, times[number])
        found.append(best)
    return found


def _penalties(recording: Recording) -> tuple[list[str], list[float]]:
    """The mistake that a car pays for in every step, or nothing, and the seconds that are left of it."""
    mistakes, remaining, mistake, left = [], [], "", 0.0
    for status in reversed(recording.statuses):
        left = left + CONTROL_DT if status == "pause" else 0.0
        remaining.append(left)
    remaining.reverse()
    for step, status in enumerate(recording.statuses):
        if status in RESET_STATUSES:
            mistake = status
            following = remaining[step + 1] if step + 1 < len(remaining) else 0.0
            remaining[step] = following
        mistakes.append(mistake if status in RESET_STATUSES or status == "pause" else "")
    return mistakes, remaining


def _map(recording: Recording) -> tuple[list[tuple[Mask, Color]], Callable[[NDArray[np.float64]], list[Place]]]:
    """Layers of the small map, and what says where on the frame points in metres are (T, 2)."""
    from PIL import Image, ImageDraw

    x, y, width, height = MAP
    track, fine = recording.track, 4
    x_min, y_min, x_max, y_max = track.bounds
    scale = min((width - 12) / max(x_max - x_min, 1e-6), (height - 12) / max(y_max - y_min, 1e-6))
    center = np.array([(x_min + x_max) / 2, (y_min + y_max) / 2])

    def pixels(points: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.asarray((points - center) * [scale, -scale] + [width / 2, height / 2])

    layers = []
    line = [(px * fine, py * fine) for px, py in pixels(track.centerline).tolist()]
    start = np.stack([track.left[0], track.right[0]])
    across = (pixels(start) - pixels(start).mean(axis=0)) * max(1.0, 9.0 / (scale * track.widths[0]))
    ends = [tuple((pixels(start).mean(axis=0) + end) * fine) for end in across]
    for points, thickness, color in ((line, 7.0, DARK), (line, 4.0, SOFT), (ends, 2.0, WHITE)):
        image = Image.new("L", (width * fine, height * fine), 0)
        draw = ImageDraw.Draw(image)
        draw.line(points, fill=255, width=round(thickness * fine), joint="curve")
        mask = np.asarray(image.reduce(fine), dtype=np.uint16)[..., None]
        layers.append((mask + (mask >> 7), color))

    def places(points: NDArray[np.float64]) -> list[Place]:
        return [(px, py) for px, py in (pixels(points) + np.array([x, y])).round().astype(int).tolist()]

    return layers, places


def _fitted(words: str, lettering: Lettering, room: int) -> str:
    while len(words) > 1 and lettering.width(words) > room:
        words = words[:-2].rstrip() + "…"
    return words
