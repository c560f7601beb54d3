"""The simulator on a GPU: the face of `Simulation`, the same bits, and arrays that stay on the device.

    Simulation (one car: settings, tracks, cameras) -> _native.DevicePlan -> memory of the GPU -> kernels of native/gpu

``torch.as_tensor(simulation.frames)`` is a tensor over the same memory.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Final, Protocol

import numpy as np
from numpy.typing import NDArray

from racecraft import _native
from racecraft.checks import check_whole
from racecraft.errors import ConfigError, ShapeError
from racecraft.gpu import Device, open_device
from racecraft.sim.columns import ROW_COLUMNS
from racecraft.sim.saved_state import seal
from racecraft.sim.simulation import VEHICLE_FIELDS, Simulation
from racecraft.track.track import Track

SOURCES: Final = Path(_native.__file__).with_name("cuda")
"""The kernels' source as it was installed."""
CAR_KERNELS: Final = ("step_cars", "reset_cars", "reset_finished", "restore_cars", "scan_lidar")
FRAME_KERNELS: Final = ("draw_frames", "expose_frames")
OBJECT_KERNELS: Final = ("draw_objects",)
PROGRAMS: Final = {"cars": CAR_KERNELS, "frames": FRAME_KERNELS, "objects": OBJECT_KERNELS}
SAVED: Final = (  # the order of Engine::visit_saved, so that states go from one simulation to the other
    "vehicles",
    "parameters",
    "state",
    "rows",
    "episodes",
    "track_choice",
    "seeds",
    "streams",
    "palettes",
    "objects",
    "earlier",
    "seen_from",
    "terminated",
    "truncated",
)


class OnDevice(Protocol):
    """An array that lies on the GPU: a torch tensor, a CuPy array, ...."""

    @property
    def __cuda_array_interface__(self) -> dict[str, Any]:
        """Where it lies, as Numba defined it."""


class CudaSimulation:
    """N cars on a GPU, stepped together at 15 Hz.

    A step queues its kernels and returns; whoever reads an array by the same stream, as torch does, sees its result.
    Actions are not checked: a NaN drives like the largest number. There is no `set_pose`, `place` or `freeze`.

    Args:
        tracks: One track, or several to be driven in one batch.
        num_envs: Cars, N.
        device: ``cuda``, ``cuda:1``, or a device that is open already.
        **settings: As for `Simulation`.

    Attributes:
        frames, lidar, rows, judged, state, terminated, truncated, vehicles, parameters, track_choice, conditions:
            As those of `Simulation`, on the GPU: each has ``__cuda_array_interface__``, and ``numpy()`` copies it.
        stream: The CUDA stream of all calls, as a number; 0 is the default one, which torch uses as well.

    Raises:
        ConfigError: There is no GPU, it has too little memory, or a setting is outside its range.
        TrackError: A track cannot be driven.
    """

    def __init__(
        self, tracks: Track | Sequence[Track], *, num_envs: int, device: Device | str = "cuda", **settings: Any
    ) -> None:
        check_whole("num_envs", num_envs, 1, 1_000_000)
        if settings.get("cars_per_race", 1) != 1:
            raise ConfigError(f"cars_per_race is {settings['cars_per_race']!r}; allowed on a GPU is 1.")
        self.device = open_device(device) if isinstance(device, str) else device
        self.settings = settings
        self.template = Simulation(tracks, num_envs=1, **{**settings, "num_threads": 1})
        """One car on the CPU with the same settings."""
        if seen := self.template.randomize.of_lenses():
            raise ConfigError(
                f"The randomization draws {', '.join(seen)}, which a GPU cannot show yet.",
                hint="Take the presets light, strong or aws, or --device cpu.",
            )
        self.tracks = self.template.tracks
        self.camera = self.template.camera
        self.objects = self.template.objects
        self.num_envs = num_envs
        self.stream = 0
        self._plan = _native.DevicePlan(self.template._engine, num_envs)
        self._load_programs()
        world = self.device.allocate(self._plan.world_bytes)
        self.device.write(world, self._plan.world(world))
        self._sizes = dict(self._plan.arrays)
        self._addresses = {name: self.device.allocate(size) for name, size in self._sizes.items()}
        for name, address in self._addresses.items():
            self.device.write(address, self._plan.initial(name))
        self._batch: NDArray[np.uint8] = self._plan.batch(world, list(self._addresses.values()))
        self._actions = self.device.allocate(8 * num_envs)
        self._mask = self.device.allocate(num_envs)
        self._seeds = self.device.allocate(8 * num_envs)

        template = self.template
        width = template.judged.shape[1]
        self.frames = self._array("frames", (num_envs, *template.frames.shape[1:]), np.uint8)
        self.lidar = self._array("lidar", (num_envs, *template.lidar.shape[1:]), np.float32)
        self.judged = self._array("rows", (num_envs, width), np.float64)
        self.state = self._array("state", (num_envs, template.state.shape[1]), np.float32)
        self.terminated = self._array("terminated", (num_envs,), np.bool_)
        self.truncated = self._array("truncated", (num_envs,), np.bool_)
        self.vehicles = self._array("vehicles", (len(VEHICLE_FIELDS), num_envs), np.float32)
        self.parameters = self._array("parameters", (template.parameters.shape[0], num_envs), np.float32)
        self.track_choice = self._array("track_choice", (num_envs,), np.int32)
        has_conditions = bool(template.conditions.size)
        self.conditions = self._array(
            "conditions", (num_envs * has_conditions, template.conditions.shape[1]), np.float32
        )
        self.reset()

    @property
    def rows(self) -> Any:
        """The last step as the rules judged it; with objects, read the first columns of `judged` instead.

        Raises:
            ConfigError: There are objects, so that rows have further columns.
        """
        if self.objects.count:
            raise ConfigError("With objects a row has more columns; read judged[:, :len(ROW_COLUMNS)].")
        assert self.judged.shape[1] == len(ROW_COLUMNS)
        return self.judged

    @property
    def num_bytes(self) -> int:
        """Memory of the batch on the device, frames included; tracks not."""
        return sum(self._sizes.values())

    def step(self, actions: OnDevice | NDArray[np.float32]) -> None:
        """Judge, move and look: one control step of 1/15 s for every car.

        Args:
            actions: Steering angle in rad and speed in m/s, float32 (N, 2), C-contiguous; on the GPU, or copied there.

        Raises:
            ShapeError: Wrong shape or type.
        """
        self.move(actions)
        self.draw()

    def reset(
        self, mask: OnDevice | NDArray[np.bool_] | None = None, *, seeds: NDArray[np.uint64] | None = None
    ) -> None:
        """Put the masked cars (all without a mask) at the start of their next episode; see `Simulation.reset`.

        Raises:
            ShapeError: The mask is not bool, or the seeds are not uint64, of shape (N,).
        """
        if mask is None:
            mask = np.ones(self.num_envs, np.bool_)
        address = self._address_of(mask, "reset mask", (self.num_envs,), np.bool_, self._mask)
        keys = 0
        if seeds is not None:
            keys = self._address_of(seeds, "seeds", (self.num_envs,), np.uint64, self._seeds)
        self._launch("reset_cars", self._car_blocks, _native.CAR_THREADS, address, keys)
        self.draw()

    def address(self, name: str) -> int:
        """Where an array of the batch (native/include/racecraft/batch.hpp) lies on the device."""
        return self._addresses[name]

    # ---- the parts of a step, for who needs what lies between

    def move(self, actions: OnDevice | NDArray[np.float32]) -> None:
        """Judge and move; frames and LIDAR are those of before until `draw`."""
        address = self._address_of(actions, "action", (self.num_envs, 2), np.float32, self._actions)
        self._launch("step_cars", self._car_blocks, _native.CAR_THREADS, address)

    def restart_finished(self) -> None:
        """Put cars whose episode is over at the start of the next; frames and LIDAR follow with `draw`."""
        self._launch("reset_finished", self._car_blocks, _native.CAR_THREADS)

    def draw(self) -> None:
        """What cameras and LIDAR of the cars see that moved since the last `draw`."""
        if self.lidar.shape[1:] != (0,) and all(self.lidar.shape):
            self._launch("scan_lidar", self.num_envs, _native.LIDAR_RAYS)
        if self.camera is not None:
            frames = self.num_envs * (2 if self.camera.baseline > 0.0 else 1)
            self._launch("draw_frames", frames, _native.IMAGE_THREADS)
            if self.objects.count:
                self._launch("draw_objects", frames, _native.ROW_THREADS)
            if self._sizes["blurred"]:
                self._launch("expose_frames", frames, _native.IMAGE_THREADS)
        self.device.fill(self._addresses["is_changed"], 0, self.num_envs, stream=self.stream)

    # ---- from and to the CPU

    def save(self) -> NDArray[np.uint8]:
        """Everything the next step depends on, the bytes that a `Simulation` of the same settings gives and takes."""
        parts = [self.device.read(self._addresses[name], self._sizes[name]) for name in SAVED]
        return seal(np.concatenate(parts), self.tracks)

    def load(self, saved: NDArray[np.uint8]) -> None:
        """Continue from what `save` gave, here or on the CPU.

        Raises:
            ShapeError: The bytes are not from a simulation of this shape and of these tracks, or damaged.
        """
        camera = self.camera  # its pictures' age is part of what is saved, its pictures are not
        small = None if camera is None or camera.age == 0.0 else replace(camera, width=8, height=8)
        settings = {**self.settings, "camera": small, "lidar": False, "num_threads": 0}
        Simulation(self.tracks, num_envs=self.num_envs, **settings).load(saved)  # refuses what a kernel must not read
        begin = 0
        for name in SAVED:
            end = begin + self._sizes[name]
            self.device.write(self._addresses[name], saved[begin:end])
            begin = end
        self._launch("restore_cars", self._car_blocks, _native.CAR_THREADS)
        self.draw()

    # ---- inside

    @property
    def _car_blocks(self) -> int:
        return -(-self.num_envs // int(_native.CAR_THREADS))

    def _array(self, name: str, shape: tuple[int, ...], dtype: Any) -> Any:
        return self.device.array(self._addresses[name], shape, dtype)

    def _load_programs(self) -> None:
        wanted = ["cars"] + ["frames"] * (self.camera is not None)
        wanted += ["objects"] * (self.camera is not None and self.objects.count > 0)
        for name in wanted:
            # Only the program that keeps whole rows is made for one width; the others serve every camera.
            width = {"RC_IMAGE_WIDTH": self.camera.width} if self.camera is not None and name == "objects" else {}
            self.device.load(
                (SOURCES / f"{name}.cu").read_text(encoding="utf-8"),
                name=f"{name}.cu",
                kernels=PROGRAMS[name],
                include=SOURCES,
                defines={"RC_BATCH_BYTES": _native.BATCH_BYTES, **width},
            )

    def _launch(self, kernel: str, blocks: int, threads: int, input: int = 0, extra: int = 0) -> None:
        self.device.launch(
            kernel, blocks=blocks, threads=int(threads), batch=self._batch, input=input, extra=extra, stream=self.stream
        )

    def _address_of(self, values: Any, name: str, shape: tuple[int, ...], dtype: Any, copy: int) -> int:
        """Where an array lies on the device; one of the host is copied to `copy` first."""
        interface = getattr(values, "__cuda_array_interface__", None)
        if interface is None:
            values = np.ascontiguousarray(values)
            found = values.shape, values.dtype
        else:
            found = tuple(interface["shape"]), np.dtype(interface["typestr"])
            if interface.get("strides") is not None and found[0] == shape:
                expected = tuple(np.empty(shape, dtype).strides)
                if tuple(interface["strides"]) != expected:
                    raise ShapeError(f"{name} is not C-contiguous; give values.contiguous().")
        if found != (shape, np.dtype(dtype)):
            raise ShapeError(f"{name} is {found[1]} of shape {found[0]}, expected {np.dtype(dtype)} of shape {shape}.")
        if interface is not None:
            return int(interface["data"][0])
        self.device.write(copy, values)
        return copy
