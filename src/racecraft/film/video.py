"""`film`: the video of a trial, seen from behind the car, with the driver's view and the race's figures.

640 x 480 at 15 frames a second, one frame for every step: H.264, yuv420p, playable while it loads.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from racecraft.agent.sensor_suite import FRONT_CAMERA, SensorSuite
from racecraft.checks import check_path, check_type
from racecraft.errors import ConfigError
from racecraft.film.encoding import FRAME_RATE, write_video
from racecraft.film.ghost import LIVERY, Ghost, Rival
from racecraft.film.overlay import HEIGHT, INSET, WIDTH, Overlay
from racecraft.race.recording import Recording
from racecraft.race.rules import RESET_STATUSES
from racecraft.sim.camera import LUMA, CameraSpec
from racecraft.sim.simulation import CONTROL_DT
from racecraft.sim.views import CarView, ObjectView, ScanView, Scene
from racecraft.track.canvas import Color

END_SECONDS: Final = 2.0
"""How long the last frame stays, with the result."""
CAMERA_LAG: Final = 0.25
"""s by which the chase camera's heading lags behind the car's."""
BLINK_PERIOD: Final = 0.5
"""s in which a car that stands as a penalty fades and returns once."""
BLINK_ALPHA: Final = 0.3
"""How solid it is when faded most."""


def film(
    recording: Recording,
    path: str | Path,
    *,
    name: str = "",
    laps: int = 0,
    color: Color = LIVERY[0],
    camera: CameraSpec | None = None,
    ghosts: Sequence[Ghost] = (),
    rivals: Sequence[Rival] = (),
    sensors: SensorSuite = FRONT_CAMERA,
) -> Path:
    """Write the video of a trial.

    Args:
        recording: Of the trial, or of one of its laps.
        path: Where to, ending in ``.mp4``.
        name: The racer's, or the run's.
        laps: Laps that the race has; 0 if that is not known.
        color: Of the car.
        camera: What the driver sees through, and in which colours; by default the usual one of the sensors.
        ghosts: Translucent cars that drove at another time; the driver does not see them.
        rivals: The other cars of the race, for the table of who is ahead and for the map.
        sensors: Of the car: its driver's view, of a stereo camera an anaglyph, the left lens in red; its LIDAR's beams.

    Raises:
        ConfigError: Nothing was recorded, or the path does not end in .mp4.
        RunError: The file cannot be written.
    """
    check_path("path", path, "use a file's path")
    check_type("name", name, str, "use a text")
    path = Path(path)
    if path.suffix.lower() != ".mp4":
        raise ConfigError(f"Cannot write a video to {path.name!r}; the name must end in .mp4.")
    pictures = frames(
        recording,
        name=name,
        laps=laps,
        color=color,
        camera=camera,
        ghosts=ghosts,
        rivals=rivals,
        sensors=sensors,
    )
    write_video(pictures, path)
    return path


class DriverView:
    """What the driver sees, in colour: of a stereo camera an anaglyph, the left lens in red, the right one in cyan.

    Args:
        scene: The track.
        camera: Of the car.
        width: Pixels.
        height: Pixels.
    """

    def __init__(self, scene: Scene, camera: CameraSpec, *, width: int, height: int) -> None:
        camera = replace(camera, width=width, height=height)
        sides = (0.5, -0.5) if camera.baseline > 0.0 else (0.0,)
        lenses = [replace(camera, left=camera.left + side * camera.baseline, baseline=0.0) for side in sides]
        self._views = [scene.driver_view(lens) for lens in lenses]
        self._pictures = [np.empty((height, width, 3), dtype=np.uint8) for _ in lenses]

    def draw(self, pose: Sequence[float], objects: Sequence[ObjectView]) -> NDArray[np.uint8]:
        """The picture of a car with its origin at a pose, RGB (height, width, 3); the next call overwrites it."""
        for view, picture in zip(self._views, self._pictures, strict=True):
            view.draw(*pose, cars=objects, out=picture)
        seen = self._pictures[-1]
        if len(self._views) == 2:
            left, right = (np.asarray(picture @ np.array(LUMA), np.uint8) for picture in self._pictures)
            seen[..., 0], seen[..., 1], seen[..., 2] = left, right, right
        return seen


def frames(
    recording: Recording,
    *,
    name: str = "",
    laps: int = 0,
    color: Color = LIVERY[0],
    camera: CameraSpec | None = None,
    ghosts: Sequence[Ghost] = (),
    rivals: Sequence[Rival] = (),
    sensors: SensorSuite = FRONT_CAMERA,
) -> Iterator[NDArray[np.uint8]]:
    """The frames of `film`, RGB (480, 640, 3), each in the same array: copy what must last.

    Raises:
        ConfigError: Nothing was recorded.
    """
    check_type("recording", recording, Recording, "use a trial's recording, or one lap of it")
    if not len(recording):
        raise ConfigError("Nothing was recorded, so there is nothing to film.")
    left, top, width, height = INSET
    camera = camera or sensors.camera()
    scene = Scene(recording.track, palette=camera.palette)
    chase = scene.chase_view(width=WIDTH, height=HEIGHT)
    driver = DriverView(scene, camera, width=width, height=height)
    overlay = Overlay(recording, name=name, laps=laps, color=color, ghosts=ghosts, rivals=rivals)
    poses, lens_poses = recording.poses.tolist(), recording.seen_from(camera.age).tolist()
    steering = recording.column("actual_steering_angle")
    directions, alphas, waves = follow(recording), blink(recording), wave(recording)
    frame = np.empty((HEIGHT, WIDTH, 3), dtype=np.uint8)
    step = 0
    for step in range(len(recording)):
        x, y, heading = poses[step]
        car = CarView(x, y, heading, float(steering[step]), color, float(alphas[step]))
        objects = recording.objects(step, alpha=float(waves[step]))
        around = [view for view in overlay.ghosts_at(step) if view is not None]
        scan = ScanView(x, y, heading, objects) if sensors.lidar_name else None
        chase.draw(x, y, float(directions[step]), cars=[car, *objects, *around], scan=scan, out=frame)
        frame[top : top + height, left : left + width] = driver.draw(lens_poses[step], objects)
        if step == len(recording) - 1:
            break
        overlay.draw(frame, step)
        yield frame
    overlay.draw(frame, step, is_over=True)
    for _ in range(1 + round(END_SECONDS * FRAME_RATE)):
        yield frame


def follow(recording: Recording) -> NDArray[np.float64]:
    """Heading of the chase camera at every step, rad: it lags behind the car's, and jumps where the car is put (T,)."""
    headings = np.unwrap(recording.column("heading"))
    statuses = recording.statuses
    is_put = [
        now == "prepare" or before in RESET_STATUSES for before, now in zip(["", *statuses], statuses, strict=False)
    ]
    share = 1.0 - math.exp(-CONTROL_DT / CAMERA_LAG)
    directions = np.empty(len(headings))
    direction = float(headings[0]) if len(headings) else 0.0
    for step, (heading, put) in enumerate(zip(headings.tolist(), is_put, strict=True)):
        direction = heading if put else direction + share * (heading - direction)
        directions[step] = direction
    return directions


def blink(recording: Recording) -> NDArray[np.float64]:
    """How solid the car is at every step: 1, or fading to and fro while it stands as a penalty (T,)."""
    stands = np.array([status == "pause" for status in recording.statuses])
    return np.where(stands, wave(recording), 1.0)


def wave(recording: Recording) -> NDArray[np.float64]:
    """How solid any car would be at every step that stands as a penalty (T,)."""
    share = 0.5 + 0.5 * np.cos(2.0 * np.pi * recording.clock / BLINK_PERIOD)
    return np.asarray(BLINK_ALPHA + (1.0 - BLINK_ALPHA) * share)
