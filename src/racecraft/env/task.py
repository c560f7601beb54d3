"""What both environments adapt: cars on tracks, with an action space, an observation and a reward."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final, TypedDict

import numpy as np
from numpy.typing import ArrayLike, NDArray

from racecraft.agent import (
    ActionSpace,
    ContinuousActionSpace,
    DiscreteActionSpace,
    LidarConfig,
    ModelMetadata,
    camera_of,
)
from racecraft.agent import action_space as preset_action_space
from racecraft.agent.sensors import LIDARS
from racecraft.checks import check_type, check_whole
from racecraft.env.info import LapClock
from racecraft.env.observation import ObservationKind, Observer, check_kind
from racecraft.env.registration import EPISODE_STEPS
from racecraft.env.rewards import RewardFunction, open_reward
from racecraft.env.sensor_observation import SensorObserver
from racecraft.errors import ConfigError, ResetNeeded, ShapeError, did_you_mean
from racecraft.sim import CameraSpec, Objects, Randomization, Simulation, Start, Vehicle
from racecraft.sim.columns import ROW_COLUMNS
from racecraft.sim.objects import NO_OBJECTS
from racecraft.track import Track, load_track

MOST_STEPS: Final = 2**31 - 2
"""The longest episode there is."""

_OF_OTHERS: Final = {
    "opponents": "One car has opponents: gymnasium.make('Racecraft-v0', opponents=[...]).",
    "num_envs": "Many cars are for gymnasium.make_vec('Racecraft-v0', num_envs=...).",
    "num_cars": "Several agents on one track are for RacecraftParallelEnv.",
}
_STEPS = ROW_COLUMNS.index("steps")


class TaskSettings(TypedDict, total=False):
    """Keyword arguments that both environments share; `DrivingTask` has their defaults and checks them."""

    reward: str | Path | RewardFunction
    """Preset, path of a ``reward_function.py``, its text, or a trusted callable of AWS's params dict."""
    action_space: str | Path | ActionSpace
    """Preset, path of a ``model_metadata.json``, or an action space."""
    observation: ObservationKind
    """``camera``, ``state`` or ``both``."""
    camera: CameraSpec
    """The driver's camera."""
    vehicle: str | Vehicle
    """Preset, vehicle file, or vehicle."""
    randomize: str | Path | Randomization
    """Preset, file, or ranges of what differs from episode to episode."""
    sensors: Sequence[str] | None
    """AWS's sensor names, for a dict of what each sees instead of `observation`: one camera, at most one LIDAR."""
    lidar: LidarConfig | None
    """Sizes of ``DISCRETIZED_SECTOR_LIDAR``."""
    objects: Objects | None
    """Boxes and bot cars on the track."""
    start: str | Start
    """Where episodes start: ``random`` along the lap, ``advance``, ``fixed``, or a `Start`."""
    direction: str
    """``forward``, ``reverse``, or ``alternate`` with every episode."""
    laps: int
    """Completed laps that end an episode."""
    max_episode_steps: int
    """Steps of 1/15 s that truncate an episode."""


def check_names(settings: Mapping[str, object], *, own: Sequence[str]) -> None:
    """Refuse settings that an environment does not have.

    Args:
        settings: Those that are not its own, by name.
        own: Its own, beside `TaskSettings`.

    Raises:
        ConfigError: One of them is not among `TaskSettings`.
    """
    known = (*own, *TaskSettings.__annotations__)
    for name, value in settings.items():
        if name not in TaskSettings.__annotations__:
            hint = _OF_OTHERS.get(name) or did_you_mean(name, known)
            raise ConfigError(
                f"The environment cannot be made with {name}={value!r}; its settings are {', '.join(known)}.", hint=hint
            )


class DrivingTask:
    """N cars with a reward; the environments only translate it into Gymnasium's words.

    Attributes:
        simulation: The cars.
        action_space: What a policy's actions mean.
        observer: What the cars see.
    """

    def __init__(
        self,
        track: str | Path | Track | Sequence[str | Path | Track],
        *,
        num_envs: int,
        num_threads: int,
        cars_per_race: int = 1,
        reward: str | Path | RewardFunction = "racing",
        action_space: str | Path | ActionSpace = "default",
        observation: ObservationKind = "camera",
        camera: CameraSpec = CameraSpec(),  # noqa: B008 (frozen)
        sensors: Sequence[str] | None = None,
        lidar: LidarConfig | None = None,
        objects: Objects | None = None,
        vehicle: str | Vehicle = "v5",
        randomize: str | Path | Randomization = "none",
        start: str | Start = "random",
        direction: str = "forward",
        laps: int = 1,
        max_episode_steps: int = EPISODE_STEPS,
    ) -> None:
        check_kind(observation)
        objects = NO_OBJECTS if objects is None else objects
        check_type("objects", objects, Objects, "use racecraft.sim.Objects(...)")
        check_type("camera", camera, CameraSpec, "use racecraft.CameraSpec(...)")
        check_type("sensors", sensors, (list, tuple, type(None)), "use a list of AWS's sensor names")
        check_type("lidar", lidar, (LidarConfig, type(None)), "use racecraft.agent.LidarConfig(...)")
        check_whole("max_episode_steps", max_episode_steps, 1, MOST_STEPS)
        check_type(
            "track", track, (str, Path, Track, list, tuple), "use a name, a file or a Track, or several in a list"
        )
        tracks = [track] if isinstance(track, str | Path | Track) else list(track)
        for item in tracks:
            check_type("track", item, (str, Path, Track), "use a name, a file or a Track")
        self.action_space = _action_space(action_space)
        self.simulation = Simulation(
            [item if isinstance(item, Track) else load_track(item) for item in tracks],
            num_envs=num_envs,
            vehicle=vehicle,
            randomize=randomize,
            camera=camera_of(sensors, camera=camera) if sensors else None if observation == "state" else camera,
            objects=objects,
            lidar=any(name in LIDARS for name in sensors or ()),
            start=start if isinstance(start, Start) else Start(mode=start),
            direction=direction,
            laps=laps,
            max_steps=int(max_episode_steps) + 1,  # the simulation counts the prepare step
            num_threads=num_threads,
            cars_per_race=cars_per_race,
        )
        self.observer: Observer | SensorObserver
        if sensors:
            self.observer = SensorObserver(self.simulation, sensors, lidar=lidar)
        else:
            self.observer = Observer(self.simulation, kind=observation)
        self._lap_clock = LapClock(num_envs)
        self._is_closed = False
        self._reward = open_reward(
            reward, tracks=self.simulation.tracks, num_envs=num_envs, num_objects=self.simulation.num_objects
        )

    @property
    def done(self) -> NDArray[np.bool_]:
        """The cars whose episode is over (N,)."""
        return self.simulation.terminated | self.simulation.truncated

    def reset(self, mask: NDArray[np.bool_], *, seeds: NDArray[np.uint64] | None = None) -> None:
        """Start the masked cars' next episode, or with seeds their first.

        Raises:
            ResetNeeded: It is closed.
        """
        self._check_open()
        self.simulation.reset(mask, seeds=seeds)
        self._lap_clock.restart(mask)
        if seeds is not None and mask.all():
            self._reward.restart(int(seeds[0]))

    def step(
        self,
        actions: ArrayLike,
        *,
        reset: NDArray[np.bool_] | None = None,
        paid: NDArray[np.bool_] | None = None,
    ) -> NDArray[np.float64]:
        """One step of every car, and its reward (N,).

        Args:
            actions: In the form of the action space.
            reset: Cars whose episode is over; they begin the next one instead of acting, with reward 0.
            paid: Cars that the reward function is called for; the others have reward 0. All without it.

        Raises:
            ResetNeeded: It is closed.
            ShapeError: The actions have another form, or are not one per car.
        """
        commands = self.action_space.to_commands(actions)
        if len(commands) != self.simulation.num_envs:
            raise ShapeError(
                f"actions have shape {np.shape(actions)}, expected {self.simulation.num_envs} rows: one per car."
            )
        return self.drive(commands, reset=reset, paid=paid)

    def drive(
        self,
        commands: NDArray[np.float32],
        *,
        reset: NDArray[np.bool_] | None = None,
        paid: NDArray[np.bool_] | None = None,
    ) -> NDArray[np.float64]:
        """The same by commands (N, 2): steering angle in rad and speed in m/s."""
        self._check_open()
        self.simulation.step(commands)
        if reset is not None and reset.any():
            self.reset(reset)
        rows = self.simulation.judged
        if paid is not None and not paid.all():
            rows = rows.copy()
            rows[~paid, _STEPS] = 1.0  # a prepare step, for which no source calls its function
        return self._reward(rows)

    def lap_times(self) -> tuple[NDArray[np.bool_], NDArray[np.float64]] | None:
        """Which cars completed a lap in this step and their times in s; to be asked once per step."""
        simulation = self.simulation
        return self._lap_clock.completed(simulation.column("status"), simulation.column("time"))

    def close(self) -> None:
        """End the reward's process; calling again does nothing."""
        self._is_closed = True
        self._reward.close()

    def _check_open(self) -> None:
        if self._is_closed:
            raise ResetNeeded("The environment is closed, and with it the reward's process; make a new one.")


def of_one_car(action: Any) -> NDArray[Any]:
    """The action of a single car as those of a batch of one (1, ...).

    Raises:
        ShapeError: It is no array.
    """
    try:
        return np.asarray(action)[None]
    except ValueError as error:  # lists of different lengths
        raise ShapeError(f"action is not an array of numbers: {error}.") from error


def seed_key(seed: Any) -> int:
    """A seed as the simulation takes it.

    Raises:
        ConfigError: It is not a whole number from 0 to 2**64 - 1.
    """
    check_whole("seed", seed, 0, 2**64 - 1)
    return int(seed)


def _action_space(value: str | Path | ActionSpace) -> ActionSpace:
    kinds = (str, Path, DiscreteActionSpace, ContinuousActionSpace)
    check_type("action_space", value, kinds, "use a preset's name, a model_metadata.json, or an action space")
    if isinstance(value, Path) or (isinstance(value, str) and value.endswith(".json")):
        return ModelMetadata.load(value).action_space
    return preset_action_space(value) if isinstance(value, str) else value
