"""A world that shares nothing with the simulator but the routes: MuJoCo's physics and MuJoCo's renderer.

    make build/mujoco

    Track ──scene──▶ MJCF: floor, road, paint, barrier, hall, people, lamps ─┐
                     MJCF: a car of four sprung wheels ──────────────────────┴▶ *World*: step, picture, pose

Nothing of it is tuned to a policy. A seed draws the light, the colours, the floor's bumps and the people.
"""

from __future__ import annotations

import math
import os
import sys
from collections import deque
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from racecraft.track import Track

sys.path.append(str(Path(__file__).parents[1] / "build" / "mujoco"))  # where `make build/mujoco` puts it
os.environ.setdefault("MUJOCO_GL", "egl")
import mujoco

Floats = NDArray[np.float64]

CONTROL_DT: Final = 1 / 15  # s
SUBSTEPS: Final = 32  # of physics in it
WHEELBASE: Final = 0.164  # m
AXLE: Final = 0.082  # m, from the car's middle
HALF_TRACK: Final = 0.08  # m
WHEEL: Final = 0.031  # m, radius
MASS: Final = 2.2  # kg, battery and computer included
GRIP: Final = 0.8  # of tyres on the floor
MOTOR_LAG: Final = 0.12  # s
SERVO_LAG: Final = 0.04  # s
MOTOR_FORCE: Final = 9.0  # N, of all wheels together
BUMPS: Final = 0.004  # m, from the floor's lowest place to its highest
LENS: Final = (0.145, 0.1314)  # m, ahead of the car's middle and above the floor
PITCH: Final = 0.2618  # rad, of the car's drawing
FOV: Final = 1.13  # rad, across
EDGE_LINE: Final = 0.065  # m, width
DASH: Final = (0.06, 0.04, 0.045)  # m: length, width, gap
MARGIN: Final = 0.8  # m, from the road to the barrier

PIECE: Final = 0.04  # m along the road between vertices: lamps are computed at vertices


@dataclass(frozen=True)
class Pose:
    """Of the car's middle."""

    x: float
    y: float
    heading: float
    speed: float
    """m/s, forward."""
    wheels: Floats
    """Where they stand, m  (4, 2)."""
    is_upright: bool


class World:
    """One car on one route.

    Args:
        track: The route.
        seed: Of light, colours, bumps and people.
        latency: s from a command to when servo and motor are told.
        size: Of pictures, width and height; None where none is wanted.
    """

    def __init__(
        self, track: Track, *, seed: int = 0, latency: float = 0.04, size: tuple[int, int] | None = (640, 480)
    ) -> None:
        scene, assets = world_xml(track, seed=seed, size=size or (64, 64))
        self.model = mujoco.MjModel.from_xml_string(scene, assets)
        self.data = mujoco.MjData(self.model)
        _bumps(self.model, seed)
        self._delay = round(latency / CONTROL_DT * SUBSTEPS)
        self._waiting: deque[tuple[float, float]] = deque()
        self._renderer = None if size is None else mujoco.Renderer(self.model, size[1], size[0])
        self._wheels = [self.model.body(name).id for name in _WHEELS]
        self._car = self.model.body("car").id

    def place(self, x: float, y: float, heading: float) -> None:
        """Stand there, let the springs settle, and forget what was commanded."""
        mujoco.mj_resetData(self.model, self.data)
        self.data.qpos[:7] = x, y, WHEEL + BUMPS, math.cos(heading / 2), 0, 0, math.sin(heading / 2)
        self._waiting = deque([(0.0, 0.0)] * self._delay)
        for _ in range(5):
            self.step(0.0, 0.0)

    def step(self, angle: float, speed: float) -> None:
        """A fifteenth of a second: wheels are told to turn to `angle` rad, left positive, the motor to `speed` m/s."""
        for _ in range(SUBSTEPS):
            self._waiting.append((angle, speed))
            steering, pace = self._waiting.popleft()
            bend = math.tan(steering) / WHEELBASE  # each front wheel square to the bend's middle
            left = math.atan(WHEELBASE * bend / (1 - HALF_TRACK * bend))
            right = math.atan(WHEELBASE * bend / (1 + HALF_TRACK * bend))
            self.data.ctrl[:] = left, right, pace / WHEEL
            mujoco.mj_step(self.model, self.data)

    @property
    def pose(self) -> Pose:
        """Where the car is."""
        turned = self.data.xmat[self._car].reshape(3, 3)
        x, y = self.data.xpos[self._car, :2]
        return Pose(
            x=float(x),
            y=float(y),
            heading=math.atan2(turned[1, 0], turned[0, 0]),
            speed=float(self.data.qvel[:3] @ turned[:, 0]),
            wheels=self.data.xpos[self._wheels, :2].copy(),
            is_upright=bool(turned[2, 2] > 0.7),
        )

    def picture(self, camera: str = "lens") -> NDArray[np.uint8]:
        """What the car's camera sees, or ``chase``, one that follows the car  (H, W, 3)."""
        if self._renderer is None:
            raise RuntimeError("This world was made without pictures: give it a size.")
        self._renderer.update_scene(self.data, camera)
        return np.asarray(self._renderer.render())

    def close(self) -> None:
        """Give the renderer's memory back."""
        if self._renderer is not None:
            self._renderer.close()


# --- the scene as MJCF


def world_xml(track: Track, *, seed: int, size: tuple[int, int]) -> tuple[str, dict[str, bytes]]:
    """The whole world: MJCF and the files that it names."""
    draw = np.random.default_rng([seed, 17])
    min_x, min_y, max_x, max_y = track.bounds
    middle = ((min_x + max_x) / 2, (min_y + max_y) / 2)
    reach = max(max_x - min_x, max_y - min_y) / 2 + 6
    meshes, geoms = [], []
    for name, mesh, material in _road(track, draw):
        meshes.append(_mesh(name, *mesh))
        geoms.append(f'<geom type="mesh" mesh="{name}" material="{material}" class="seen"/>')
    for name, margin, foot, top, material in (
        ("barrier", MARGIN, 0.0, draw.uniform(0.35, 0.6), "barrier"),
        ("hall", 5.0, 0.0, 4.0, "hall"),
    ):
        meshes.append(_mesh(name, *_wall(track.bounds, margin, foot, top)))
        geoms.append(f'<geom type="mesh" mesh="{name}" material="{material}" class="seen"/>')
    geoms += _people(track.bounds, draw)
    lamps = _lamps(middle, reach, draw)
    tint = draw.uniform(0.9, 1.1, 3)
    assets = {f"{name}.png": _png(picture * tint) for name, picture in _textures(draw).items()}
    shine = draw.uniform(0.1, 0.35)
    return (
        f"""<mujoco model="second world">
  <compiler angle="radian"/>
  <option timestep="{CONTROL_DT / SUBSTEPS}" integrator="implicitfast" cone="elliptic" impratio="5"/>
  <statistic center="{middle[0]} {middle[1]} 0" extent="{reach}"/>
  <visual>
    <global offwidth="{size[0]}" offheight="{size[1]}"/>
    <headlight ambient="0.5 0.5 0.5" diffuse="0 0 0" specular="0 0 0"/>
    <map znear="{0.03 / reach}" zfar="{60 / reach}" shadowclip="1.0"/>
    <quality shadowsize="2048" offsamples="0"/>
  </visual>
  <default>
    <default class="seen"><geom contype="0" conaffinity="0" group="1"/></default>
    <default class="wheel">
      <geom type="ellipsoid" size="{WHEEL} {WHEEL} 0.013" euler="1.5708 0 0" mass="0.05" rgba="0.08 0.08 0.08 1"
            friction="{GRIP} 0.003 0.0001" condim="3" solref="0.012 1"/>
    </default>
  </default>
  <asset>
    <texture name="sky" type="skybox" builtin="gradient" rgb1="0.7 0.7 0.75" rgb2="0.5 0.48 0.46" width="64"
             height="384"/>
    {"".join(f'<texture name="{name[:-4]}" type="2d" file="{name}"/>' for name in assets)}
    <material name="floor" texture="floor" texrepeat="1 1" texuniform="true" specular="0.1"/>
    <material name="road" texture="road" specular="{shine}" shininess="0.25"/>
    <material name="white" texture="paint" specular="0.2" shininess="0.2"/>
    <material name="yellow" texture="paint" rgba="1 {draw.uniform(0.7, 0.85)} {draw.uniform(0.15, 0.45)} 1"
              specular="0.2" shininess="0.2"/>
    <material name="barrier" texture="barrier" specular="0.1"/>
    <material name="hall" texture="hall" specular="0"/>
    <hfield name="bumps" nrow="{_cells(reach)}" ncol="{_cells(reach)}" size="{reach} {reach} {BUMPS} 0.1"/>
    {"".join(meshes)}
  </asset>
  <worldbody>
    <geom name="floor" type="plane" size="{reach} {reach} 0.1" pos="{middle[0]} {middle[1]} 0" material="floor"
          class="seen"/>
    <geom name="bumps" type="hfield" hfield="bumps" pos="{middle[0]} {middle[1]} {-BUMPS / 2}" group="4"
          friction="{GRIP} 0.003 0.0001"/>
    {"".join(geoms)}
    {lamps}
    {_CAR}
  </worldbody>
  {_DRIVE}
</mujoco>""",
        assets,
    )


_WHEELS: Final = ("front_left", "front_right", "rear_left", "rear_right")


def _car_xml() -> str:
    """Four sprung wheels, the front ones steered; heavy below, light above."""
    wheels = []
    for name in _WHEELS:
        x = AXLE if name.startswith("front") else -AXLE
        y = HALF_TRACK if name.endswith("left") else -HALF_TRACK
        steer = f'<joint name="steer_{name}" axis="0 0 1" range="-0.8 0.8" damping="0.01" armature="0.001"/>' * (x > 0)
        wheels.append(
            f'<body name="{name}" pos="{x} {y} 0">'
            f'<joint name="spring_{name}" type="slide" axis="0 0 1" stiffness="1800" damping="25" springref="-0.003"'
            f' range="-0.01 0.01" limited="true"/>{steer}'
            f'<joint name="spin_{name}" axis="0 1 0" damping="0.0003" armature="0.00002"/><geom class="wheel"/></body>'
        )
    ahead, above = LENS
    down = f"{math.sin(PITCH)} 0 {math.cos(PITCH)}"
    fovy = 2 * math.atan(math.tan(FOV / 2) * 0.75)
    return f"""<body name="car" pos="0 0 {WHEEL}">
      <freejoint/>
      <geom type="box" size="0.115 0.045 0.012" pos="0 0 0.012" mass="{MASS - 0.9}" rgba="0.12 0.12 0.14 1"
            contype="0" conaffinity="0"/>
      <geom type="box" size="0.1 0.06 0.03" pos="-0.01 0 0.055" mass="0.7" rgba="0.85 0.4 0.1 1" contype="0"
            conaffinity="0"/>
      <camera name="lens" pos="{ahead} 0 {above - WHEEL}" xyaxes="0 -1 0 {down}" fovy="{math.degrees(fovy)}"/>
      <camera name="chase" pos="-0.75 0 0.5" xyaxes="0 -1 0 0.45 0 1" fovy="55"/>
      {"".join(wheels)}
    </body>"""


def _drive_xml() -> str:
    """One motor over open differentials: it turns the mean of the wheels, and each gets the same moment."""
    strength = MOTOR_FORCE * WHEEL
    wheels = "".join(f'<joint joint="spin_{name}" coef="0.25"/>' for name in _WHEELS)
    servos = "".join(
        f'<general name="servo_{name}" joint="steer_{name}" dyntype="filterexact" dynprm="{SERVO_LAG}" gainprm="6"'
        f' biastype="affine" biasprm="0 -6 -0.12" forcerange="-0.6 0.6"/>'
        for name in _WHEELS[:2]
    )
    return f"""<tendon><fixed name="drive">{wheels}</fixed></tendon>
  <actuator>{servos}
    <general name="motor" tendon="drive" dyntype="filterexact" dynprm="{MOTOR_LAG}" gainprm="0.02" biastype="affine"
             biasprm="0 0 -0.02" forcerange="{-strength} {strength}"/>
  </actuator>"""


_CAR: Final = _car_xml()
_DRIVE: Final = _drive_xml()


def _cells(reach: float) -> int:
    return int(2 * reach / 0.1)


def _bumps(model: Any, seed: int) -> None:
    """Heights of the floor that wheels feel, smooth over a third of a metre; pictures do not show them."""
    rows, columns = int(model.hfield_nrow[0]), int(model.hfield_ncol[0])
    noise = _smooth(np.random.default_rng([seed, 23]).normal(size=(rows, columns)), 3)
    heights = (noise - noise.min()) / np.ptp(noise)
    model.hfield_data[: rows * columns] = heights.ravel()


def _lamps(middle: tuple[float, float], reach: float, draw: np.random.Generator) -> str:
    """The hall's even light from one side, which throws shadows, and lamps whose light lies on the road."""
    side, steep = draw.uniform(0, 2 * math.pi), draw.uniform(0.25, 0.8)
    light = draw.uniform(0.5, 0.9)
    x, y = middle
    lines = [
        f'<light directional="true" castshadow="true" pos="{x} {y} 6" diffuse="{light} {light} {0.97 * light}"'
        f' specular="0.3 0.3 0.3" dir="{steep * math.cos(side)} {steep * math.sin(side)} -1"/>'
    ]
    for _ in range(3):
        px, py = draw.uniform(-0.7, 0.7, 2) * (reach - 4)
        power = draw.uniform(0.15, 0.4)
        lines.append(
            f'<light castshadow="false" pos="{x + px} {y + py} {draw.uniform(2.5, 4)}" dir="0 0 -1" cutoff="75"'
            f' exponent="2" diffuse="{power} {power} {power}" specular="0.6 0.6 0.6"/>'
        )
    return "".join(lines)


# --- shapes


def _road(track: Track, draw: np.random.Generator) -> list[tuple[str, tuple[Floats, ...], str]]:
    """Surface, border lines and dashes: name, mesh, material."""
    count = int(track.length / PIECE) + 1
    s = np.linspace(0, track.length, count)
    left, right, middle = (
        np.column_stack([np.interp(s, track.arc_length, line[:, k]) for k in (0, 1)])
        for line in (track.left, track.right, track.centerline)
    )
    across = left - right
    across /= np.hypot(*across.T)[:, None]
    folds = draw.uniform(0.01, 0.05)
    surface = _strip(left, right, 0.001, 12, draw, folds)
    parts = [("road", surface, "road")]
    for name, outer, inwards in (("left_line", left, -across), ("right_line", right, across)):
        edges = (outer, outer + EDGE_LINE * inwards)
        parts.append((name, _strip(*(edges if name == "left_line" else edges[::-1]), 0.002, 3, draw, folds), "white"))
    length, width, gap = DASH
    corners = []
    for begin in np.arange(0, track.length - length, length + gap):
        at = begin + np.array([0, length])
        place = np.column_stack([np.interp(at, s, middle[:, k]) for k in (0, 1)])
        along = place[1] - place[0]
        square = np.array([-along[1], along[0]]) / np.hypot(*along) * width / 2
        corners.append((place[0] + square, place[1] + square, place[1] - square, place[0] - square))
    points = np.array(corners).reshape(-1, 2)
    first = 4 * np.arange(len(corners))[:, None]
    faces = np.concatenate([first + np.array(turn) for turn in ([0, 2, 1], [0, 3, 2])])
    dashes = (
        np.column_stack([points, np.full(len(points), 0.003)]),
        np.tile([0.0, 0.0, 1.0], (len(points), 1)),
        points / 0.5,
        faces,
    )
    return [*parts, ("dashes", dashes, "yellow")]


def _strip(
    left: Floats, right: Floats, height: float, columns: int, draw: np.random.Generator, folds: float
) -> tuple[Floats, ...]:
    """A lying strip that leans here and there, as folds make it: vertices, normals, places in the texture, faces."""
    share = np.linspace(0, 1, columns)[None, :, None]
    grid = left[:, None] * (1 - share) + right[:, None] * share
    rows = len(left)
    lean = _smooth(draw.normal(size=(rows, columns, 2)), 3) * 6 * folds
    normals = np.dstack([lean, np.ones((rows, columns))])
    normals /= np.linalg.norm(normals, axis=2, keepdims=True)
    points = np.dstack([grid, np.full((rows, columns), height)]).reshape(-1, 3)
    return points, normals.reshape(-1, 3), points[:, :2] / 1.5, _faces(rows, columns)


def _faces(rows: int, columns: int) -> NDArray[np.int64]:
    """Triangles of a grid whose rows lead ahead and whose columns lead right, seen from above."""
    corner = (np.arange(rows - 1)[:, None] * columns + np.arange(columns - 1)).reshape(-1, 1)
    return np.concatenate([corner + np.array(turn) for turn in ([0, 1, columns], [1, columns + 1, columns])])


def _wall(bounds: tuple[float, ...], margin: float, foot: float, top: float) -> tuple[Floats, ...]:
    """A wall with round corners around everything, seen from inside."""
    min_x, min_y, max_x, max_y = bounds
    radius = min(margin + 0.6, 2.0)
    corners = [
        (max_x + margin - radius, max_y + margin - radius, 0),
        (min_x - margin + radius, max_y + margin - radius, 1),
        (min_x - margin + radius, min_y - margin + radius, 2),
        (max_x + margin - radius, min_y - margin + radius, 3),
    ]
    angle = np.linspace(0, math.pi / 2, 12)
    line = np.concatenate(
        [
            [x, y]
            + radius * np.column_stack([np.cos(angle + quarter * math.pi / 2), np.sin(angle + quarter * math.pi / 2)])
            for x, y, quarter in corners
        ]
    )
    line = np.concatenate([line, line[:1]])
    arc = np.concatenate([[0], np.cumsum(np.hypot(*np.diff(line, axis=0).T))])
    s = np.linspace(0, arc[-1], int(arc[-1] / 0.15))
    line = np.column_stack([np.interp(s, arc, line[:, k]) for k in (0, 1)])
    heading = np.gradient(line, axis=0)
    inward = np.column_stack([-heading[:, 1], heading[:, 0]]) / np.hypot(*heading.T)[:, None]
    rows, columns = len(line), 5
    height = np.linspace(foot, top, columns)
    points = np.dstack([*(np.repeat(line[:, k : k + 1], columns, 1) for k in (0, 1)), np.tile(height, (rows, 1))])
    normals = np.repeat(np.column_stack([inward, np.zeros(rows)])[:, None], columns, 1)
    places = np.dstack(
        [np.repeat(s[:, None], columns, 1) / (4 * (top - foot)), np.tile(1 - np.linspace(0, 1, columns), (rows, 1))]
    )
    return points.reshape(-1, 3), normals.reshape(-1, 3), places.reshape(-1, 2), _faces(rows, columns)


def _people(bounds: tuple[float, ...], draw: np.random.Generator) -> list[str]:
    """Some who look on from behind the barrier."""
    min_x, min_y, max_x, max_y = bounds
    lines = []
    for _ in range(24):
        out = MARGIN + draw.uniform(0.5, 2.5)
        share, side = draw.uniform(), draw.integers(4)
        x = (min_x - out, max_x + out)[side] if side < 2 else min_x + share * (max_x - min_x)
        y = (min_y - out, max_y + out)[side - 2] if side > 1 else min_y + share * (max_y - min_y)
        red, green, blue = draw.uniform(0.05, 0.5) * draw.uniform(0.6, 1.2, 3)
        lines.append(
            f'<geom type="capsule" size="0.2" fromto="{x} {y} 0.2 {x} {y} 1.35" rgba="{red} {green} {blue} 1"'
            f' class="seen"/>'
            f'<geom type="sphere" size="0.12" pos="{x} {y} 1.65" rgba="0.6 0.45 0.36 1" class="seen"/>'
        )
    return lines


def _mesh(name: str, points: Floats, normals: Floats, places: Floats, faces: NDArray[np.int64]) -> str:
    def text(values: NDArray[Any], form: str) -> str:
        return " ".join(form % value for value in values.ravel())

    return (
        f'<mesh name="{name}" inertia="shell" vertex="{text(points, "%.4f")}" normal="{text(normals, "%.4f")}"'
        f' texcoord="{text(places, "%.4f")}" face="{text(faces, "%d")}"/>'
    )


# --- textures


def _textures(draw: np.random.Generator) -> dict[str, Floats]:
    """Colours 0 to 1  (H, W, 3)."""
    noise = draw.normal(size=(256, 256))
    fine, coarse = _smooth(noise, 1), _smooth(draw.normal(size=(256, 256)), 12)
    floor = np.array([0.33, 0.68, 0.45]) * (1 + 0.12 * fine + 0.5 * coarse)[..., None]
    road = np.array([0.2, 0.2, 0.23]) * (1 + 0.15 * fine + 0.8 * coarse)[..., None]
    paint = np.ones(3) * (0.97 + 0.03 * fine + 0.15 * coarse)[..., None]
    barrier = (
        np.ones((128, 512, 3)) * [0.38, 0.62, 0.6] * (1 + 0.3 * _smooth(draw.normal(size=(128, 512)), 8))[..., None]
    )
    barrier[:, ::170] *= 0.6  # seams between panels
    for column in range(60, 440, 128):  # faint prints
        barrier[40:52, column : column + 60] += 0.08
        barrier[60:84, column + 10 : column + 45] += 0.05
    hall = np.ones((128, 512, 3)) * [0.42, 0.34, 0.28] * (1 + 0.4 * _smooth(draw.normal(size=(128, 512)), 6))[..., None]
    for column in draw.integers(0, 480, 9):
        hall[:, column : column + 14] *= 0.4
    for column in draw.integers(0, 440, 7):
        row = draw.integers(20, 90)
        hall[row : row + 5, column : column + 50] = [0.75, 0.8, 1.0]
    return {"floor": floor, "road": road, "paint": paint, "barrier": barrier, "hall": hall}


def _smooth(noise: Floats, radius: int) -> Floats:
    """Means of neighbours along the first two axes, round the edges."""
    for axis in (0, 1):
        noise = np.mean([np.roll(noise, shift, axis) for shift in range(-radius, radius + 1)], axis=0)
    return noise


def _png(picture: Floats) -> bytes:
    out = BytesIO()
    Image.fromarray((picture.clip(0, 1) * 255).astype(np.uint8)).save(out, "PNG")
    return out.getvalue()
