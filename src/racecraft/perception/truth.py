"""What a camera could know of the road, from the simulator's own state: what perception learns to say.

vehicles, conditions ──▶ where each lens is and looks ──▶ centre line ahead of it, road under its rays ──▶ targets
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from racecraft.perception.answers import (
    CURVATURE_AT,
    CURVATURES,
    HALF,
    HEADING_OVER,
    IN_SIGHT,
    MIDDLES,
    NUM_TARGETS,
    NUMBERS,
    ON_ROAD,
    PLACES,
    POSE,
    REGION_COLUMNS,
    REGION_ROWS,
    REGIONS,
    ROWS,
)
from racecraft.sim import CONDITIONS, STATE_COLUMNS, Simulation
from racecraft.sim.columns import CURVATURE_AHEAD
from racecraft.track import Track

Floats = NDArray[np.float64]

SPACING: Final = 0.025
"""m between the points of a centre line."""
COARSE: Final = 8
"""Points between two that are looked at first when the nearest one is sought."""
BEHIND, AHEAD = 8, 80
"""Points behind and ahead of the nearest one that are looked at: 2 m of road. Between as many to both sides, 0.4 m, the
direction of the road is told."""
_CURVATURE_COLUMNS: Final = [STATE_COLUMNS.index(f"curvature_{CURVATURE_AHEAD.index(ahead)}") for ahead in CURVATURE_AT]
CELL: Final = 0.02
"""m, side of a cell of the map of a road."""
MARGIN: Final = 0.5
"""m of that map around the track."""
SIGHT: Final = 6.0
"""m ahead from where on a region counts as no road: it would be a few pixels."""
MOST: Final = 4.0
"""In units of the network, to either side: a metre off the middle is as far as any offset is told."""
GRID: Final = 4096.0
"""Targets are multiples of one over this, so that the last bits of a machine's tangent decide nothing."""


class Truth:
    """The targets of a simulation's cars.

    Args:
        simulation: Of 160 x 120 pixels and with one lens; what it is randomised by is taken into account.
    """

    def __init__(self, simulation: Simulation) -> None:
        camera = simulation.camera
        assert camera is not None
        assert (camera.width, camera.height, camera.baseline) == (160, 120, 0.0)
        self._simulation, self._camera = simulation, camera
        roads = [_Road(track) for track in simulation.tracks]
        self._roads = [*roads, *(road.reversed() for road in roads)]
        self._counts = np.array([len(road.line) for road in self._roads])
        most = -(-int(self._counts.max()) // COARSE) * COARSE
        # beyond its last point a line goes on with its first one where it is closed, else it stands still
        self._lines = np.stack(
            [road.line[_within(np.arange(most), len(road.line), road.is_closed)] for road in self._roads]
        )
        self._is_closed = np.array([road.is_closed for road in self._roads])
        self._map = np.concatenate([road.is_road.ravel() for road in roads])
        shapes = np.array([road.is_road.shape for road in roads])
        begins = np.cumsum([0, *shapes.prod(axis=1)[:-1]])
        origins = np.array([road.origin for road in roads])
        self._shapes, self._begins, self._origins = (np.concatenate([part] * 2) for part in (shapes, begins, origins))

    def targets(self) -> NDArray[np.float32]:
        """In units of the network  (N, NUM_TARGETS); a column that is not in the picture is 0."""
        simulation = self._simulation
        found = np.zeros((simulation.num_envs, NUM_TARGETS))
        state = simulation.state.astype(np.float64)
        found[:, PLACES["half_width"]] = state[:, STATE_COLUMNS.index("half_width")]
        found[:, CURVATURES] = state[:, _CURVATURE_COLUMNS]
        if simulation.objects.count:
            found[:, PLACES["closeness"]] = state[:, len(STATE_COLUMNS)]
        roads = simulation.column("track_index").astype(int)
        lenses = self._lenses()
        found[:, POSE], columns, is_there = self._along(roads, lenses)
        found[:, : len(NUMBERS)] /= np.array(list(NUMBERS.values()))
        found[:, MIDDLES] = np.where(is_there, columns / HALF, 0.0)
        found[:, IN_SIGHT] = is_there
        found[:, REGIONS] = self._regions(roads, lenses)
        found[:, ON_ROAD] = self._is_road(roads, lenses[:, 0, None], lenses[:, 1, None])[:, 0]
        return (np.round(found.clip(-MOST, MOST) * GRID) / GRID).astype(np.float32)

    def _lenses(self) -> Floats:
        """x, y, cosine and sine of where each looks, height, pitch, focal length in pixels  (N, 7)."""
        simulation, camera = self._simulation, self._camera
        x, y, heading = (simulation.vehicles[i].astype(np.float64) for i in range(3))
        drawn = dict.fromkeys(CONDITIONS, np.zeros(len(x)))
        if len(simulation.conditions):
            drawn |= dict(zip(CONDITIONS, simulation.conditions.T.astype(np.float64), strict=True))
        forward, left = camera.forward + drawn["camera_forward"], camera.left + drawn["camera_left"]
        cosine, sine = np.cos(heading), np.sin(heading)
        looks = heading + drawn["camera_yaw"]
        focal = HALF / np.tan(0.5 * (camera.horizontal_fov + drawn["camera_fov"]))
        lens_x, lens_y = x + forward * cosine - left * sine, y + forward * sine + left * cosine
        above, pitch = camera.above_ground + drawn["camera_height"], camera.pitch + drawn["camera_pitch"]
        return np.stack([lens_x, lens_y, np.cos(looks), np.sin(looks), above, pitch, focal], axis=1)

    def _nearest(self, roads: NDArray[np.intp], x: Floats, y: Floats) -> NDArray[np.intp]:
        """Index of the line's point nearest to (x, y), each (N,)."""
        coarse = self._lines[roads, ::COARSE]
        around = ((coarse - np.stack([x, y], axis=1)[:, None]) ** 2).sum(axis=2).argmin(axis=1) * COARSE
        near = self._index(roads, around[:, None] + np.arange(-COARSE, COARSE + 1))
        points = self._lines[roads[:, None], near]
        best = ((points - np.stack([x, y], axis=1)[:, None]) ** 2).sum(axis=2).argmin(axis=1)
        return np.asarray(near[np.arange(len(roads)), best])

    def _index(self, roads: NDArray[np.intp], index: NDArray[np.intp]) -> NDArray[np.intp]:
        return _within(index, self._counts[roads][:, None], self._is_closed[roads][:, None])

    def _along(self, roads: NDArray[np.intp], lenses: Floats) -> tuple[Floats, Floats, NDArray[np.bool_]]:
        """`POSE` (N, 3); pixels from the picture's middle to the road's (N, R), and where it is in view."""
        x, y, cosine, sine, above, pitch, focal = lenses.T[:, :, None]
        nearest = self._nearest(roads, x[:, 0], y[:, 0])
        ahead_of = self._index(roads, nearest[:, None] + np.arange(-BEHIND, AHEAD))
        line = self._lines[roads[:, None], ahead_of]
        # a track's lines are chords of a curve: the direction of one of them tells less of the road than their mean
        tangent = line[:, 2 * BEHIND] - line[:, 0]
        tangent /= np.sqrt((tangent**2).sum(axis=1, keepdims=True))
        leads = line[:, BEHIND + round(HEADING_OVER / SPACING)] - line[:, BEHIND]
        leads = np.where((leads**2).sum(axis=1, keepdims=True) > 0.0, leads, tangent)  # no road ahead of its end
        off_x, off_y = x[:, 0] - line[:, BEHIND, 0], y[:, 0] - line[:, BEHIND, 1]
        offset = tangent[:, 0] * off_y - tangent[:, 1] * off_x
        headings = [
            np.arctan2(
                way[:, 0] * sine[:, 0] - way[:, 1] * cosine[:, 0], way[:, 0] * cosine[:, 0] + way[:, 1] * sine[:, 0]
            )
            for way in (tangent, leads)
        ]

        dx, dy = line[..., 0] - x, line[..., 1] - y
        ahead, right = dx * cosine + dy * sine, dx * sine - dy * cosine
        columns = np.zeros((len(roads), len(ROWS)))
        is_there = np.zeros(columns.shape, bool)
        cars = np.arange(len(roads))
        for place, row in enumerate(ROWS):
            distance, depth = _on_ground(row, above, pitch, focal)
            is_past = ahead > distance
            later = is_past.argmax(axis=1)
            before = (later - 1).clip(0)
            share = (distance[:, 0] - ahead[cars, before]) / (ahead[cars, later] - ahead[cars, before] + 1e-12)
            aside = right[cars, before] + share * (right[cars, later] - right[cars, before])
            columns[:, place] = focal[:, 0] * aside / depth[:, 0]
            is_there[:, place] = (later > 0) & (np.abs(columns[:, place]) < HALF)
        return np.stack([offset, *headings], axis=1), columns, is_there

    def _regions(self, roads: NDArray[np.intp], lenses: Floats) -> NDArray[np.bool_]:
        """Whether there is road in the middle of each region  (N, NUM_REGIONS)."""
        x, y, cosine, sine, above, pitch, focal = lenses.T[:, :, None]
        found = []
        for row in REGION_ROWS:
            distance, depth = _on_ground(row, above, pitch, focal)
            is_seen = distance < SIGHT
            reach = np.where(is_seen, distance, 0.0)
            right = (np.array(REGION_COLUMNS) + 0.5 - HALF) * depth / focal
            is_road = self._is_road(roads, x + reach * cosine + right * sine, y + reach * sine - right * cosine)
            found.append(is_road & is_seen)
        return np.concatenate(found, axis=1)

    def _is_road(self, roads: NDArray[np.intp], x: Floats, y: Floats) -> NDArray[np.bool_]:
        """Whether there is road at points of each car's track  (N, K)."""
        origin, shape = self._origins[roads], self._shapes[roads]
        column = np.floor((x - origin[:, 0, None]) / CELL).astype(np.intp)
        line = np.floor((y - origin[:, 1, None]) / CELL).astype(np.intp)
        height, width = shape[:, 0, None], shape[:, 1, None]
        is_inside = (column >= 0) & (column < width) & (line >= 0) & (line < height)
        cell = self._begins[roads][:, None] + line * width + column
        return np.asarray(self._map[np.where(is_inside, cell, 0)] & is_inside)


class _Road:
    """A track, driven one way: dense points of its centre line and a map of where there is road."""

    def __init__(self, track: Track) -> None:
        from PIL import Image, ImageDraw

        count = max(int(track.length / SPACING), 8)
        self.line: Floats = np.asarray(track.point_at(np.arange(count) * (track.length / count)))
        self.is_closed = track.is_closed
        sides = np.concatenate([track.left, track.right])
        self.origin: Floats = sides.min(axis=0) - MARGIN
        width, height = (int(side) + 1 for side in (sides.max(axis=0) + MARGIN - self.origin) / CELL)
        picture = Image.new("1", (width, height))
        draw = ImageDraw.Draw(picture)
        # a picture's whole numbers are the middles of its cells
        cells = [(line - self.origin) / CELL - 0.5 for line in (track.left, track.right)]
        rings = [[(float(x), float(y)) for x, y in line] for line in cells]
        if track.is_closed:
            within, around = sorted(rings, key=_area)
            draw.polygon(around, fill=1)
            draw.polygon(within, fill=0)
        else:
            draw.polygon([*rings[0], *reversed(rings[1])], fill=1)
        self.is_road: NDArray[np.bool_] = np.asarray(picture, bool)

    def reversed(self) -> _Road:
        """Driven the other way."""
        other = object.__new__(_Road)
        other.line, other.is_closed = self.line[::-1], self.is_closed
        other.origin, other.is_road = self.origin, self.is_road
        return other


def _within(
    index: NDArray[np.intp], count: int | NDArray[np.intp], is_closed: bool | NDArray[np.bool_]
) -> NDArray[np.intp]:
    """Of a line's points: behind the last comes the first where it is closed, else the last itself."""
    return np.where(is_closed, index % count, np.clip(index, 0, count - 1))


def _area(ring: list[tuple[float, float]]) -> float:
    x, y = np.array(ring).T
    return abs(float(x @ np.roll(y, 1) - y @ np.roll(x, 1)))


def _on_ground(row: int, above: Floats, pitch: Floats, focal: Floats) -> tuple[Floats, Floats]:
    """What a row of a picture shows of the ground: m ahead, infinite above the horizon, and depth in the lens."""
    below = (row + 0.5 - 60.0) / focal
    sine, cosine = np.sin(pitch), np.cos(pitch)
    fall = np.maximum(sine + below * cosine, 1e-3)
    distance = np.where(fall > 1e-3, above * (cosine - below * sine) / fall, math.inf)
    return distance, above / fall
