"""Pictures for people: the track and its cars in colour, from the driver's, the chase or the top-down camera."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from racecraft import _native
from racecraft.checks import check_choice
from racecraft.sim.camera import PALETTES, CameraSpec
from racecraft.sim.columns import OBJECT_COLUMNS, OBJECT_HEADER
from racecraft.sim.objects import OBJECT_KINDS
from racecraft.sim.simulation import ground_map, native_camera
from racecraft.track.track import Track

TEXEL: Final = 0.005
"""m of a ground texel in pictures for people; the driver's camera makes do with twice that."""


def driver_frames(track: Track, poses: ArrayLike, camera: CameraSpec = CameraSpec()) -> NDArray[np.uint8]:
    """What the driver's camera sees from many places, exactly as in a simulation: grey (N, height, width).

    Args:
        track: Where.
        poses: x [m], y [m] and heading [rad] of the car's origin, (N, 3).
        camera: Of the driver.
    """
    table = np.ascontiguousarray(poses, dtype=np.float32)
    out = np.empty((len(table), camera.height, camera.width), dtype=np.uint8)
    model = _native.CameraModel(native_camera(camera))
    _native.render_grey(model, ground_map(track), camera.palette, table, out)
    return out


class CarView(NamedTuple):
    """A car in a picture."""

    x: float
    """m, of the car's origin."""
    y: float
    """m"""
    heading: float
    """rad"""
    steering: float = 0.0
    """rad, of the front wheels, left positive."""
    color: tuple[int, int, int] = (196, 32, 38)
    """Of the body, RGB."""
    alpha: float = 1.0
    """1 is solid; a car that stands as a penalty blinks between 0.3 and 1."""


class BoxView(NamedTuple):
    """A cardboard box in a picture."""

    x: float
    """m, of its middle."""
    y: float
    """m"""
    heading: float
    """rad"""
    alpha: float = 1.0
    """1 is solid."""


ObjectView = CarView | BoxView


class ScanView(NamedTuple):
    """A LIDAR at work in a picture: its beams as they are without noise."""

    x: float
    """m, of the origin of the car that carries it."""
    y: float
    """m"""
    heading: float
    """rad"""
    objects: Sequence[ObjectView] = ()
    """What its beams can hit besides the walls."""


RACER_COLORS: Final[tuple[tuple[int, int, int], ...]] = _native.RACER_COLOURS
"""Bodies of the cars of a race by their number in it."""


def views_of_objects(columns: NDArray[np.float64], *, car: int = 0, alpha: float = 1.0) -> list[ObjectView]:
    """The objects of one judged row as a picture shows them; cars that have left the race are not there.

    Args:
        columns: What follows the row's own columns (`Simulation.judged`); empty where there are no objects.
        car: Number in its race of the car that the row is of; it is none of the objects.
        alpha: How solid the cars are now that stand as a penalty.
    """
    views: list[ObjectView] = []
    table = columns[len(OBJECT_HEADER) :].reshape(-1, len(OBJECT_COLUMNS))
    racers = 0
    for index, (code, x, y, heading, *_) in enumerate(table.tolist()):
        kind = OBJECT_KINDS[int(code)]
        color = _native.CAR_COLOURS[index % len(_native.CAR_COLOURS)]
        if kind.endswith("racer"):
            color = RACER_COLORS[(racers + (racers >= car)) % len(RACER_COLORS)]
            racers += 1
        if kind == "box":
            views.append(BoxView(x, y, heading))
        elif kind != "gone_racer":
            views.append(CarView(x, y, heading, color=color, alpha=alpha if kind == "frozen_racer" else 1.0))
    return views


def _table(views: Sequence[ObjectView]) -> NDArray[np.float32]:
    return np.array([_fields(view) for view in views], dtype=np.float32).reshape(-1, 9)


def _fields(view: ObjectView) -> tuple[float, ...]:
    """As the core takes it."""
    if isinstance(view, BoxView):
        return (view.x, view.y, view.heading, 0.0, 0.0, 0.0, 0.0, view.alpha, 1.0)
    return (*view[:4], *view.color, view.alpha, 0.0)


class Scene:
    """A track with its surroundings, ready to be looked at.

    Args:
        track: What is shown.
        palette: Colours of the world: ``2018``, ``2020`` or ``2026``.
    """

    def __init__(self, track: Track, *, palette: str = "2018") -> None:
        check_choice("Palette", palette, PALETTES)
        self.palette = palette
        self._track = track

    def chase_view(self, *, width: int = 640, height: int = 480) -> View:
        """The camera that follows a car from behind and above."""
        return View(self._fine_ground(), self.palette, _native.chase_camera(width, height))

    def driver_view(self, camera: CameraSpec = CameraSpec(), *, lit_walls: bool = True) -> View:
        """The driver's camera in colour, on the ground the driver sees; leave the own car out of its pictures.

        Args:
            camera: Of the driver.
            lit_walls: Show walls as people like them; without, they are as dark as the driver sees them.
        """
        return View(ground_map(self._track), self.palette, native_camera(camera), lit_walls=lit_walls)

    def top_view(self, *, width: int = 640, height: int = 480) -> View:
        """The whole track from above; its camera stands still, so the pose it is given does not matter."""
        ground = self._fine_ground()
        spec, x, y, heading = _native.top_down_camera(ground, width, height)
        return View(ground, self.palette, spec, fixed=(x, y, heading))

    def _fine_ground(self) -> _native.GroundMap:
        return ground_map(self._track, texel=TEXEL)


class View:
    """One camera in a scene; made by a `Scene`."""

    def __init__(
        self,
        ground: _native.GroundMap,
        palette: str,
        spec: _native.CameraSpec,
        *,
        fixed: tuple[float, float, float] | None = None,
        lit_walls: bool = True,
    ) -> None:
        self.width = spec.width
        self.height = spec.height
        self._ground = ground
        self._palette = palette
        self._camera = _native.CameraModel(spec)
        self._fixed = fixed
        self._lit_walls = lit_walls

    def draw(
        self,
        x: float = 0.0,
        y: float = 0.0,
        heading: float = 0.0,
        *,
        cars: Sequence[ObjectView] = (),
        scan: ScanView | None = None,
        out: NDArray[np.uint8] | None = None,
    ) -> NDArray[np.uint8]:
        """A picture, RGB uint8 (height, width, 3).

        Args:
            x: Origin of the car that carries the camera, m.
            y: The same.
            heading: Of that car, rad.
            cars: What is seen besides the track, boxes included.
            scan: A LIDAR whose beams are shown.
            out: Where to draw; a new array by default.
        """
        if out is None:
            out = np.empty((self.height, self.width, 3), dtype=np.uint8)
        scanned = () if scan is None else (CarView(*scan[:3]), *scan.objects)
        x, y, heading = self._fixed or (x, y, heading)
        _native.render_rgb(
            self._camera,
            self._ground,
            self._palette,
            x,
            y,
            heading,
            _table(cars),
            scan=_table(scanned),
            lit_walls=self._lit_walls,
            out=out,
        )
        return out
