"""The Python face of the native core: a batch of cars on one or several tracks.

    track -> *simulation* -> observation (frames, state)
    simulation -> rows -> reward, rules, logs

Every array is a view of the core's own memory: it changes with the next step, so copy what must last.
"""

from __future__ import annotations

import atexit
import functools
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from racecraft import _native
from racecraft.checks import check_choice, check_flag, check_number, check_type, check_whole, require, shown
from racecraft.errors import ConfigError, NonFiniteAction, ShapeError, did_you_mean
from racecraft.sim.camera import CameraSpec
from racecraft.sim.columns import OBJECT_COLUMNS, OBJECT_HEADER, ROW_COLUMNS
from racecraft.sim.objects import NO_OBJECTS, Objects, native_objects
from racecraft.sim.randomization import Randomization, load_randomization
from racecraft.sim.saved_state import seal, unseal
from racecraft.sim.vehicle import Vehicle, load_vehicle
from racecraft.track.track import Track

CONTROL_DT: Final = 1.0 / 15.0
"""Seconds per control step: one camera image at 15 Hz."""
MAX_STEERING: Final = np.pi / 6
"""rad, no command turns the wheels further."""
TABLE_SPACING: Final = 0.05
"""m between samples of width and curvature along the centre line."""

TRACK_ORDERS: Final = ("fixed", "random")
START_MODES: Final = ("fixed", "advance", "random")
DIRECTIONS: Final = ("forward", "reverse", "alternate")
VEHICLE_FIELDS: Final = ("x", "y", "heading", "speed", "lateral_speed", "yaw_rate", "steering")


@dataclass(frozen=True, kw_only=True)
class Start:
    """Where episodes start. An open track always starts at its beginning."""

    mode: str = "advance"
    """``fixed``; ``advance`` by 5 % of a lap with every episode, as AWS trains; or ``random`` along the lap."""
    offset: float = 0.0
    """Fraction of a lap from the first waypoint."""
    advance: float = 0.05
    """Fraction of a lap that a car's start moves on with every episode, in mode ``advance``."""
    spread: bool = False
    """Space the races of a batch evenly along the lap."""
    lateral_jitter: float = 0.0
    """m, uniform to either side."""
    heading_jitter: float = 0.0
    """rad, uniform to either side."""
    shuffle: bool = False
    """Draw for every race who starts where in its grid, instead of car 0 in front."""

    def __post_init__(self) -> None:
        check_choice("Start mode", self.mode, START_MODES)
        limits = {
            "offset": (-1.0, 1.0),
            "advance": (-1.0, 1.0),
            "lateral_jitter": (0.0, 1.0),
            "heading_jitter": (0.0, np.pi),
        }
        for name, (low, high) in limits.items():
            check_number(f"Start setting {name}", getattr(self, name), low, high)
        check_flag("Start setting spread", self.spread)
        check_flag("Start setting shuffle", self.shuffle)


class Simulation:
    """N cars, stepped together at 15 Hz by the native core.

    A step judges every car's pose *before* its action acts (filling `rows`), then moves the cars, then renders what
    their cameras see, as the original does. A terminated car stands until it is reset. `reset` includes the original's
    `prepare` step, so the first judged step of an episode has ``steps == 2``.

    **Races.** Every `cars_per_race` consecutive cars share one world: car ``i`` is number ``i % cars_per_race`` in race
    ``i // cars_per_race``, with one track, one set of obstacles and bots, and the other cars among its objects
    (kind ``racer``, behind obstacles and bots, in their order without itself). They see each other in cameras and
    LIDARs, and only the one behind is at fault in a collision. They start on a staggered grid: 0.75 m from car to car,
    car 0 in front in the outer lane, the next in the inner one, further back where something stands. A step does
    each thing for all cars before the next, so their order means nothing.

    A car whose episode is over leaves the race: the others neither see nor hit it until `reset` or `set_pose` puts it
    back. While `freeze` keeps it standing it is seen but cannot be hit. A `reset` of all cars of a race begins a new
    one with objects placed anew; a reset of some puts them into the race that goes on, where there is room.

    Args:
        tracks: One track, or several to be driven in one batch.
        num_envs: Cars, N.
        seed: Key of every random number; same seed, settings and actions give the same bits.
        vehicle: Preset name, vehicle file or `Vehicle`.
        camera: The driver's camera, or None to drive without (much faster).
        start: Where episodes start.
        direction: ``forward``, ``reverse``, or ``alternate`` with every episode.
        track_order: ``fixed``: car i drives track i modulo their number, or its `track_choice`; ``random``: one drawn
            for every episode.
        randomize: Preset name, file or `Randomization`: the ranges of what differs from episode to episode.
        laps: Completed laps that end an episode; laps flow without a stop. An open track has only one.
        time_limit: Seconds that truncate an episode; 0 for none.
        max_steps: Steps that truncate an episode.
        substeps: Physics steps to a control step.
        objects: Boxes and bot cars on the track of every race.
        cars_per_race: Agents' cars that share a track, 1 to 8; `num_envs` is a multiple of it.
        lidar: Whether the cars carry the original's LIDAR.
        num_threads: 0 takes one per core.

    Attributes:
        frames: What the cameras see now, uint8 (N, height, width); empty without a camera. Of a stereo camera,
            uint8 (N, 2, height, width), the left lens first.
        lidar: Distances of the LIDAR's rays now, m, counter-clockwise from 30° left of straight ahead over the
            car's back, float32 (N, 64); empty without one.
        rows: The last step as the rules judged it, float64 (N, len(ROW_COLUMNS)).
        judged: The same with the columns of objects behind, float64 (N, row_width(num_objects)).
        state: Privileged state now, scaled to about unit size, float32 (N, state_width(num_objects)).
        num_objects: Around every car: obstacles, bots, and the other cars of its race.
        terminated: The episode ended by its rules, bool (N,).
        truncated: The episode was cut by a limit, bool (N,).
        vehicles: x, y, heading, speed, lateral_speed, yaw_rate, steering (SI), float32 (7, N).
        parameters: Vehicle parameters per car, writeable, float32 (len(VEHICLE_PARAMETERS), N).
        track_choice: Track of each car from its next episode on, writeable, int32 (N,); a race takes its first car's.
        conditions: What randomisation drew for each car's episode, float32 (N, len(CONDITIONS)); (0, ...) without.

    Raises:
        ConfigError: A setting is outside its range.
        TrackError: A track cannot be driven.
    """

    def __init__(
        self,
        tracks: Track | Sequence[Track],
        *,
        num_envs: int = 1,
        seed: int = 0,
        vehicle: Vehicle | str | Path = "v5",
        camera: CameraSpec | None = CameraSpec(),
        start: Start = Start(),
        direction: str = "forward",
        track_order: str = "fixed",
        randomize: Randomization | str | Path = "none",
        laps: int = 1,
        time_limit: float = 0.0,
        max_steps: int = 100_000,
        substeps: int = 8,
        objects: Objects = NO_OBJECTS,
        lidar: bool = False,
        num_threads: int = 0,
        cars_per_race: int = 1,
    ) -> None:
        if isinstance(tracks, Track):
            tracks = (tracks,)
        check_type("tracks", tracks, (tuple, list), "give a Track, or several in a list; load_track(name) gets one")
        self.tracks = tuple(tracks)
        if not self.tracks:
            raise ConfigError("A simulation needs at least one track, got an empty list.")
        for track in self.tracks:
            check_type("track", track, Track, "get one with load_track(name or path)")
        check_type("start", start, Start, "use racecraft.Start(...)")
        if camera is not None:
            check_type("camera", camera, CameraSpec, "use racecraft.CameraSpec(...), or None")
        check_type("vehicle", vehicle, (Vehicle, str, Path), "use a preset's name, a file or racecraft.Vehicle(...)")
        check_flag("lidar", lidar)
        check_type("objects", objects, Objects, "use racecraft.sim.Objects(...)")
        check_choice("direction", direction, DIRECTIONS)
        check_choice("track_order", track_order, TRACK_ORDERS)
        check_type(
            "randomize", randomize, (Randomization, str, Path), "use a preset's name, a file or Randomization(...)"
        )
        check_whole("num_envs", num_envs, 1, 1_000_000)
        check_whole("seed", seed, 0, 2**64 - 1)
        check_whole("laps", laps, 1, 1_000_000)
        require("laps", laps, laps == 1 or all(track.is_closed for track in self.tracks), "1 on an open track")
        check_whole("max_steps", max_steps, 2, 2**31 - 1)
        check_whole("substeps", substeps, 4, 128)
        check_whole("num_threads", num_threads, 0, 1024)
        check_number("time_limit", time_limit, 0.0, 1e9)
        check_whole("cars_per_race", cars_per_race, 1, _native.MAX_CARS_PER_RACE)
        require("num_envs", num_envs, num_envs % cars_per_race == 0, f"a multiple of cars_per_race, {cars_per_race}")

        self.num_envs = int(num_envs)
        self.seed = int(seed)
        self.vehicle = vehicle if isinstance(vehicle, Vehicle) else load_vehicle(vehicle)
        self.camera = camera
        self.randomize = randomize if isinstance(randomize, Randomization) else load_randomization(randomize)
        self.randomize.check(self.vehicle, camera)
        self.start = start
        self.direction = direction
        self.laps = int(laps)
        self.objects = objects
        self.cars_per_race = int(cars_per_race)
        self.num_objects = objects.count + cars_per_race - 1
        self._everyone = np.ones(num_envs, dtype=np.bool_)
        self._engine = _native.Engine(
            tracks=[native_track(track) for track in self.tracks],
            grounds=[ground_map(track) for track in self.tracks] if camera else [],
            vehicle=self.vehicle.values(),
            camera=native_camera(camera) if camera else None,
            num_envs=num_envs,
            seed=seed,
            substeps=substeps,
            num_threads=num_threads,
            laps=laps,
            max_steps=max_steps,
            time_limit=time_limit,
            start_mode=START_MODES.index(start.mode),
            start_offset=start.offset,
            start_advance=start.advance,
            start_spread=start.spread,
            lateral_jitter=start.lateral_jitter,
            heading_jitter=start.heading_jitter,
            direction=DIRECTIONS.index(direction),
            objects=native_objects(objects),
            draws_tracks=track_order == "random",
            randomization=[] if self.randomize.is_off else self.randomize.values(),
            world=camera.palette if camera else "2018",
            has_lidar=lidar,
            baseline=camera.baseline if camera else 0.0,
            cars_per_race=cars_per_race,
            shuffle=start.shuffle,
            picture_age=round(camera.age / CONTROL_DT * substeps) if camera else 0,
        )
        frames: NDArray[np.uint8] = self._engine.frames  # (N, lenses, height, width)
        is_stereo = camera is not None and camera.baseline > 0.0
        self.frames: NDArray[np.uint8] = frames if is_stereo else frames.reshape(num_envs, *frames.shape[2:])
        self.judged: NDArray[np.float64] = self._engine.rows
        self.rows: NDArray[np.float64] = self.judged[:, : len(ROW_COLUMNS)]
        self.state: NDArray[np.float32] = self._engine.state
        self.lidar: NDArray[np.float32] = self._engine.lidar
        self.terminated: NDArray[np.bool_] = self._engine.terminated
        self.truncated: NDArray[np.bool_] = self._engine.truncated
        self.vehicles: NDArray[np.float32] = self._engine.vehicles
        self.parameters: NDArray[np.float32] = self._engine.parameters
        self.track_choice: NDArray[np.int32] = self._engine.track_choice
        self.conditions: NDArray[np.float32] = self._engine.conditions

    @property
    def num_threads(self) -> int:
        """Threads that step the batch, the caller's included."""
        return int(self._engine.num_threads)

    @property
    def num_bytes(self) -> int:
        """Memory of the batch, frames included; tracks and threads not."""
        return int(self._engine.num_bytes)

    def column(self, name: str) -> NDArray[np.float64]:
        """One column of `rows` by name, a view (N,).

        Raises:
            ConfigError: There is no such column.
        """
        if name not in ROW_COLUMNS:
            raise ConfigError(
                f"There is no column {name!r}; allowed are {', '.join(ROW_COLUMNS)}.",
                hint=did_you_mean(str(name), ROW_COLUMNS),
            )
        return self.rows[:, ROW_COLUMNS.index(name)]

    def object_column(self, name: str) -> NDArray[np.float64]:
        """One column of the objects, a view: (N, num_objects), or (N,) for those of `OBJECT_HEADER`.

        Raises:
            ConfigError: There are no objects, or no such column.
        """
        if not self.num_objects or name not in (*OBJECT_HEADER, *OBJECT_COLUMNS):
            allowed = ", ".join((*OBJECT_HEADER, *OBJECT_COLUMNS)) if self.num_objects else "none without objects"
            raise ConfigError(f"There is no object column {name!r}; allowed are {allowed}.")
        begin = len(ROW_COLUMNS)
        if name in OBJECT_HEADER:
            return self.judged[:, begin + OBJECT_HEADER.index(name)]
        return self.judged[:, begin + len(OBJECT_HEADER) + OBJECT_COLUMNS.index(name) :: len(OBJECT_COLUMNS)]

    def reset(self, mask: NDArray[np.bool_] | None = None, *, seeds: NDArray[np.uint64] | None = None) -> None:
        """Put the masked cars (all without a mask) at the start of their next episode.

        All cars of a race begin a new race; some of them come back into the one that goes on.

        Args:
            mask: The cars to reset, bool (N,).
            seeds: Begin anew: the masked races start their first episode and draw, from now on, as the only race
                of a simulation with this seed would, uint64 (N,), the same for all cars of a race.

        Raises:
            ShapeError: The mask is not bool, or the seeds are not uint64, of shape (N,).
            ConfigError: `track_choice` names a track that does not exist, or seeds are for a part of a race.
        """
        if mask is None:
            mask = self._everyone
        mask = np.array(mask)  # a copy: `terminated` itself may be the mask, and a reset clears it as it goes
        if mask.shape != (self.num_envs,) or mask.dtype != np.bool_:
            raise ShapeError(
                f"reset mask is {mask.dtype} of shape {mask.shape}, expected bool of shape ({self.num_envs},)."
            )
        if seeds is not None:
            seeds = np.ascontiguousarray(seeds)
            if seeds.shape != (self.num_envs,) or seeds.dtype != np.uint64:
                raise ShapeError(
                    f"seeds are {seeds.dtype} of shape {seeds.shape}, expected uint64 of shape ({self.num_envs},)."
                )
            races, keys = (array.reshape(-1, self.cars_per_race) for array in (mask, seeds))
            if (races != races[:, :1]).any() or (keys != keys[:, :1])[races].any():
                raise ConfigError("seeds begin whole races anew; mask all cars of a race, and give them the same seed.")
        if self.track_choice.min() < 0 or self.track_choice.max() >= len(self.tracks):
            raise ConfigError(f"track_choice must be 0 to {len(self.tracks) - 1}, got {self.track_choice.tolist()}.")
        self._engine.reset(mask, seeds)

    def step(self, actions: ArrayLike) -> None:
        """Judge, move and look: one control step of 1/15 s for every car.

        Args:
            actions: Steering angle in radians (left positive; the wheels stop at ±30°, rows tell up to ±45°) and speed
                in m/s (the car drives 0.1 to 4, rows tell up to 12; exactly 0 asks the car to stop), (N, 2).

        Raises:
            ShapeError: Wrong shape.
            NonFiniteAction: An action is NaN or infinite; nothing has moved.
        """
        try:
            given = np.asarray(actions)
            if given.dtype.kind == "c":
                raise TypeError("they are complex")  # NumPy would leave a part of them out
            with np.errstate(over="ignore"):  # infinity is refused below
                commands = np.ascontiguousarray(given, dtype=np.float32)
        except (TypeError, ValueError, OverflowError) as error:
            raise ShapeError(f"actions are not an array of numbers: {error}.") from error
        if commands.shape != (self.num_envs, 2):
            raise ShapeError(
                f"action has shape {commands.shape}, expected ({self.num_envs}, 2): "
                "one row per car, columns steering_angle [rad] and speed [m/s]."
            )
        finite = np.isfinite(commands)
        if not finite.all():
            car = int(np.flatnonzero(~finite.all(axis=1))[0])
            steering, speed = commands[car]
            raise NonFiniteAction(f"action[{car}] = ({steering}, {speed}); steering_angle and speed must be finite.")
        self._engine.step(commands)

    def set_pose(self, env: int, x: float, y: float, heading: float, *, speed: float = 0.0) -> None:
        """Put one car's origin somewhere within its episode, wheels straight; its frame and state follow at once.

        Raises:
            ConfigError: No such car, or a value out of range.
        """
        check_whole("env", env, 0, self.num_envs - 1)
        for name, value in {"x": x, "y": y, "heading": heading}.items():
            check_number(f"{name} of a pose", value, -1e5, 1e5)
        check_number("speed of a pose", speed, 0.0, 10.0)
        self._engine.set_pose(env, x, y, heading, speed)

    def place(self, env: int, arc_length: float, *, offset: float = 0.0, speed: float = 0.0) -> None:
        """Put one car on its track, `arc_length` metres along and `offset` metres left of the centre line."""
        check_whole("env", env, 0, self.num_envs - 1)
        check_number("arc_length", arc_length, -1e5, 1e5)
        check_number("offset", offset, -1e3, 1e3)
        track = self.driven_track(env)
        heading = float(track.heading_at(arc_length))
        x, y = track.point_at(arc_length)
        self.set_pose(env, x - offset * np.sin(heading), y + offset * np.cos(heading), heading, speed=speed)

    def driven_track(self, env: int) -> Track:
        """The track of a car's current episode, in its driving direction."""
        check_whole("env", env, 0, self.num_envs - 1)
        index = int(self.column("track_index")[env])
        track = self.tracks[index % len(self.tracks)]
        return track.reversed() if index >= len(self.tracks) else track

    def freeze(self, env: int, steps: int) -> None:
        """Keep one car standing for so many steps from now on, as a penalty; its status is then ``pause``."""
        check_whole("env", env, 0, self.num_envs - 1)
        check_whole("steps", steps, 0, 2**31 - 1)
        self._engine.freeze(env, steps)

    def save(self) -> NDArray[np.uint8]:
        """Everything the next step depends on, and which roads it is of, as bytes (B,), for `load` of an equal one."""
        return seal(self._engine.save(), self.tracks)

    def load(self, saved: NDArray[np.uint8]) -> None:
        """Continue from what `save` gave.

        Raises:
            ShapeError: The bytes are not from a simulation of this shape and of these tracks.
        """
        if not isinstance(saved, np.ndarray) or saved.ndim != 1 or saved.dtype != np.uint8:
            raise ShapeError(f"Saved simulation state is {shown(saved)}; allowed are the bytes of save(), uint8 (B,).")
        try:
            self._engine.load(unseal(np.ascontiguousarray(saved), self.tracks))
        except (TypeError, ValueError) as error:
            raise ShapeError(f"{error}") from error


def instruction_set() -> str:
    """What the core's kernels run on: ``avx512``, ``avx2`` or ``portable``; results are the same.

    The best that this build and this machine have, unless the variable ``RACECRAFT_ISA`` names another.
    """
    return str(_native.isa())


def core_build() -> dict[str, Any]:
    """Of the native core: a wheel's commit (else empty), compiler, and the instruction sets it has for this machine."""
    return {
        "commit": _native.commit(),
        "compiler": _native.compiler(),
        "instruction_set": instruction_set(),
        "instruction_sets": _native.available_isas(),
    }


def slower_than_could_be() -> str:
    """Why the core does not run on the best instruction set of this machine, in a sentence; empty where it does."""
    isa, best = _native.isa(), _native.best_isa()
    if isa == best:
        return ""
    chosen = isa != _native.available_isas()[-1]
    why = "RACECRAFT_ISA says so" if chosen else "this build of the core leaves the rest out"
    return f"The native core runs on the instruction set {isa} and not on this machine's {best}: {why}."


@functools.lru_cache(maxsize=32)  # a training and its evaluations share them; some 8 MB each
def ground_map(track: Track, *, texel: float = 0.01) -> _native.GroundMap:
    """The ground of a track as the cameras see it, with texels of about `texel` metres."""
    return _native.GroundMap(track.centerline, track.inner, track.outer, track.is_closed, texel)


def native_camera(camera: CameraSpec) -> _native.CameraSpec:
    """The core's form of a camera."""
    return _native.CameraSpec(
        camera.width,
        camera.height,
        camera.horizontal_fov,
        camera.forward,
        camera.left,
        camera.above_ground,
        camera.pitch,
    )


@functools.lru_cache(maxsize=32)
def native_track(track: Track) -> _native.NativeTrack:
    """The core's form of a track: both directions, with tables of width and curvature."""
    return _native.NativeTrack(**track_arrays(track))


for _kept in (ground_map, native_track):
    atexit.register(_kept.cache_clear)  # native objects must go before the module that made them


def track_arrays(track: Track) -> dict[str, Any]:
    """What the core is told of a track, by the names of its arguments; a browser's tab gets the same."""
    twin = track.reversed()
    count = max(2, int(np.ceil(track.length / TABLE_SPACING)))
    # On a closed track the sample after the last is the first again; an open one needs both ends.
    steps = count if track.is_closed else count - 1
    s = np.arange(count) * (track.length / steps)
    widths = track.width_at(s).astype(np.float32)
    return {
        "centerline": track.centerline,
        "inner": track.inner,
        "outer": track.outer,
        "reversed_centerline": twin.centerline,
        "reversed_inner": twin.inner,
        "reversed_outer": twin.outer,
        "widths": widths,
        "curvatures": track.curvature_at(s).astype(np.float32),
        "reversed_widths": np.roll(widths[::-1], 1 if track.is_closed else 0),
        "reversed_curvatures": twin.curvature_at(s).astype(np.float32),
        "samples_per_metre": steps / track.length,
        "is_closed": track.is_closed,
        "waypoints": track.waypoint_indices,
        "reversed_waypoints": twin.waypoint_indices,
    }
