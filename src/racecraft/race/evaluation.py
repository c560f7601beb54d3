"""`evaluate`: how good a policy is, by the rules of a race, from several starts driven side by side.

    frames -> *policy* -> commands -> simulation -> judged rows -> marshal -> laps, resets, penalties
                                          ^------- put back, freeze -------'

`completion` is the small form for use during training: one lap, nobody put back, one simulation reused.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Final, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from racecraft.agent.sensor_suite import FRONT_CAMERA, SensorSuite
from racecraft.checks import check_choice, check_whole, require
from racecraft.errors import ConfigError, ShapeError
from racecraft.race.conditions import Conditions
from racecraft.race.default_reward import centerline_rewards
from racecraft.race.marshal import Marshal
from racecraft.race.placement import line_up
from racecraft.race.results import Evaluation
from racecraft.race.rules import RULE_SETS, RaceRules
from racecraft.sim.camera import CameraSpec
from racecraft.sim.columns import ROW_COLUMNS, STATUS_NAMES
from racecraft.sim.objects import NO_OBJECTS, Objects
from racecraft.sim.randomization import Randomization, load_randomization
from racecraft.sim.simulation import CONTROL_DT, Simulation, Start
from racecraft.sim.vehicle import Vehicle, load_vehicle
from racecraft.track.track import Track

MAX_STEPS: Final = 100_000
"""Steps to a lap after which a car that neither arrives nor errs is stopped, as in the original."""
SIGHTS: Final = ("frames", "state")

_STATUS, _PROGRESS, _TIME = (ROW_COLUMNS.index(name) for name in ("status", "progress", "time"))
_LAP_COMPLETE = STATUS_NAMES.index("lap_complete")

Driver = Callable[[NDArray[Any]], NDArray[np.float32]]
"""From what N cars see to commands (N, 2), without chance: a `racecraft.race.policy.NetworkPolicy`, or a state's."""


@runtime_checkable
class RememberingDriver(Protocol):
    """A `Driver` that remembers what each car saw, and so is told which cars it is asked for."""

    def __call__(self, sight: NDArray[Any], cars: NDArray[np.intp] | None = None, /) -> NDArray[np.float32]:
        """Commands (N, 2) for what N cars see; by default the first N."""

    def forget(self) -> None:
        """Begin anew with every car."""


def begin_anew(driver: Driver) -> None:
    """Let a driver that remembers forget whatever it drove before: equal starts are to mean equal commands."""
    if isinstance(driver, RememberingDriver):
        driver.forget()


def evaluate(
    policy: Driver,
    track: Track,
    *,
    rules: RaceRules = RULE_SETS["drfc"],
    num_trials: int = 5,
    seed: int = 0,
    vehicle: Vehicle | str = "v5",
    camera: CameraSpec = CameraSpec(),
    objects: Objects = NO_OBJECTS,
    sees: str = "",
    sensors: SensorSuite | None = None,
    randomize: Randomization | str = "none",
    num_threads: int = 0,
) -> Evaluation:
    """Race a policy against the clock, several times side by side.

    Trials differ by their starts only: from the line trial 0 is exact and the others are off by the rules' jitter;
    from anywhere on the lap all are. Both are drawn from the seed and the trial's number. So a trial does not depend
    on how many others there are, and a seed repeats it exactly, as far as the policy gives one car the same commands
    in any batch.

    Args:
        policy: What drives: called with what its sensors read, of the front camera alone a view of all frames uint8
            (N, 120, 160), or with the state.
        track: Where.
        rules: Laps, resets, penalties, starts.
        num_trials: Cars side by side, 1 to 1000.
        seed: Of the starts.
        vehicle: Preset name, vehicle file or `Vehicle`.
        camera: What the cars see with.
        objects: Boxes and bot cars on the track, around every car of its own; random places differ by trial.
        sees: ``frames``, or ``state`` for a policy that drives by the privileged state, without a camera; by default
            what the policy's attribute ``sees`` says, and ``frames`` for one that has none.
        sensors: What ``frames`` are read from; by default what the policy was trained with, and the front camera for
            one that does not say.
        randomize: Preset, file or ranges of what differs between the trials.
        num_threads: Of the simulation; 0 takes one per core.

    Raises:
        ConfigError: A setting is outside its range, or the policy cannot be called.
        ShapeError: The policy's commands do not have the shape (N, 2).
        NonFiniteAction: A command is NaN or infinite.
    """
    require("policy", policy, callable(policy), "a driver, called with what its sensors read")
    sensors, sees = _sensors_of(policy, sensors), sight_of(policy, sees)
    conditions = Conditions(
        track=track,
        rules=rules,
        seed=seed,
        vehicle=vehicle if isinstance(vehicle, Vehicle) else load_vehicle(vehicle),
        camera=_needed(sensors.camera(camera), sees),
        objects=objects,
        randomize=randomize if isinstance(randomize, Randomization) else load_randomization(randomize),
    )
    has_lidar = bool(sensors.lidar_name) and sees == "frames"
    simulation = race_simulation(conditions, num_cars=num_trials, has_lidar=has_lidar, num_threads=num_threads)
    marshal = Marshal(simulation, rules, seed=seed)
    begin_anew(policy)
    while marshal.is_racing:
        marshal.step(_checked(policy(_sight(simulation, sees, sensors)), num_trials))
    return Evaluation(conditions=conditions, trials=marshal.trials())


def race_simulation(
    conditions: Conditions, *, num_cars: int, has_lidar: bool = False, num_threads: int = 0
) -> Simulation:
    """The simulation of a race against the clock: what `evaluate` drives and what verifying a replay drives again."""
    return trial_simulation(
        conditions.track,
        rules=conditions.rules,
        num_trials=num_cars,
        seed=conditions.seed,
        vehicle=conditions.vehicle,
        camera=conditions.camera,
        has_lidar=has_lidar,
        randomize=conditions.randomize,
        objects=conditions.objects,
        cars_per_race=conditions.cars_per_race,
        num_threads=num_threads,
    )


def trial_simulation(
    tracks: Track | Sequence[Track],
    *,
    rules: RaceRules = RULE_SETS["first_lap"],
    num_trials: int = 5,
    seed: int = 0,
    vehicle: Vehicle | str = "v5",
    camera: CameraSpec | None = CameraSpec(),
    has_lidar: bool = False,
    randomize: Randomization | str = "none",
    objects: Objects = NO_OBJECTS,
    cars_per_race: int = 1,
    num_threads: int = 0,
) -> Simulation:
    """A simulation by the rules, a car for each trial: what `evaluate` makes and `completion` reuses.

    On several tracks, for `completion` only, trial i drives track i modulo their number.
    """
    check_whole("num_trials", num_trials, 1, 1000, is_plain=True)
    if isinstance(tracks, Track):
        tracks = (tracks,)
    is_closed = all(track.is_closed for track in tracks)
    laps = rules.laps if rules.is_continuous and is_closed else 1  # of one simulated episode
    return Simulation(
        tracks,
        num_envs=num_trials,
        seed=seed,
        vehicle=vehicle,
        camera=camera,
        lidar=has_lidar,
        start=_start(rules, is_alone=cars_per_race == 1),
        direction=rules.direction,
        randomize=randomize,
        laps=laps,
        max_steps=laps * MAX_STEPS,
        objects=objects,
        cars_per_race=cars_per_race,
        num_threads=num_threads,
    )


def _start(rules: RaceRules, *, is_alone: bool) -> Start:
    """Where the simulation itself starts cars; `line_up` moves those of trials from the line."""
    if rules.starts == "line":
        return Start(mode="fixed", offset=rules.start_offset)
    if not is_alone:
        return Start(mode="random")
    return Start(mode="random", lateral_jitter=rules.lateral_jitter, heading_jitter=rules.heading_jitter)


@dataclass(frozen=True, kw_only=True, eq=False)
class Completion:
    """How far each car got on its first lap."""

    completions: NDArray[np.float64]
    """Fraction of the lap driven, 0 to 1  (N,)."""
    lap_times: NDArray[np.float64]
    """s of completed laps, NaN for the others  (N,)."""
    rewards: NDArray[np.float64]
    """Sum of AWS's default reward, which evaluation logs whatever the policy was trained with  (N,)."""
    statuses: tuple[str, ...]
    """How each car's lap ended  (N,)."""

    @property
    def laps_completed(self) -> int:
        """Cars that completed the lap."""
        return int(np.isfinite(self.lap_times).sum())

    @property
    def mean_completion(self) -> float:
        """Mean of `completions`."""
        return float(self.completions.mean())

    @property
    def best_lap(self) -> float | None:
        """Fastest completed lap, s."""
        return float(np.nanmin(self.lap_times)) if self.laps_completed else None


def completion(
    policy: Driver,
    simulation: Simulation,
    *,
    rules: RaceRules = RULE_SETS["first_lap"],
    seed: int = 0,
    sees: str = "",
    sensors: SensorSuite | None = None,
    max_seconds: float = 0.0,
    on_row: Callable[[NDArray[np.float64]], None] | None = None,
) -> Completion:
    """How far a policy gets on the first lap with nobody to put it back: the judgement used during training.

    Args:
        policy: What drives.
        simulation: From `trial_simulation`, with the same rules; it is reset first and can be used again.
        rules: Its starts are used: jitter as in `evaluate`, so equal seeds mean equal starts.
        seed: Of the starts, and of where objects stand: whatever was driven before, equal seeds mean equal places.
        sees: As for `evaluate`.
        sensors: What ``frames`` are read from, as for `evaluate`.
        max_seconds: Simulated seconds after which a slow car is stopped; 0 for none.
        on_row: Is given every judged row of the first car's lap, a view that the next step overwrites.

    Raises:
        ConfigError: `sees` is unknown, or ``frames`` from a simulation without a camera.
        ShapeError: The policy's commands do not have the shape (N, 2).
        NonFiniteAction: A command is NaN or infinite.
    """
    sees = sight_of(policy, sees)
    _needed(simulation.camera, sees)
    if simulation.laps != 1:
        raise ConfigError(f"completion judges one lap; the simulation was made for {simulation.laps}.")
    line_up(simulation, rules, seed=seed, is_anew=True)
    begin_anew(policy)
    return drive_lap(policy, simulation, sees=sees, sensors=sensors, max_seconds=max_seconds, on_row=on_row)


def drive_lap(
    policy: Driver,
    simulation: Simulation,
    *,
    sees: str = "",
    sensors: SensorSuite | None = None,
    max_seconds: float | NDArray[np.float64] = 0.0,
    on_row: Callable[[NDArray[np.float64]], None] | None = None,
) -> Completion:
    """The same from where the cars stand; `max_seconds` may be each car's own  (N,)."""
    sensors, sees = _sensors_of(policy, sensors), sight_of(policy, sees)
    rewards = np.zeros(simulation.num_envs)
    is_running = np.ones(simulation.num_envs, dtype=np.bool_)
    rows = simulation.rows.copy()  # those that laps ended with
    limits = np.where(np.greater(max_seconds, 0.0), np.rint(np.divide(max_seconds, CONTROL_DT)), MAX_STEPS)
    for step in range(1, int(limits.max()) + 1):
        simulation.step(_checked(policy(_sight(simulation, sees, sensors)), simulation.num_envs))
        rewards += is_running * centerline_rewards(simulation.rows)
        if on_row is not None and is_running[0]:
            on_row(simulation.rows[0])
        rows[is_running] = simulation.rows[is_running]
        is_running &= ~(simulation.terminated | simulation.truncated) & (step < limits)
        if not is_running.any():
            break
    status = rows[:, _STATUS].astype(int)
    is_complete = status == _LAP_COMPLETE
    return Completion(
        completions=np.where(is_complete, 1.0, rows[:, _PROGRESS].clip(0.0, 1.0)),
        lap_times=np.where(is_complete, rows[:, _TIME], np.nan),
        rewards=rewards,
        statuses=tuple(STATUS_NAMES[code] for code in status),
    )


def sight_of(policy: Any, sees: str = "") -> str:
    """``frames`` or ``state``: what is asked for, else what the policy says that it sees."""
    return sees or str(getattr(policy, "sees", "frames"))


def _sensors_of(policy: Any, sensors: SensorSuite | None) -> SensorSuite:
    suite: SensorSuite = getattr(policy, "sensors", FRONT_CAMERA) if sensors is None else sensors
    return suite


def _sight(simulation: Simulation, sees: str, sensors: SensorSuite) -> NDArray[Any]:
    return sensors.read(simulation) if sees == "frames" else simulation.state


def _needed(camera: CameraSpec | None, sees: str) -> CameraSpec | None:
    check_choice("sees", sees, SIGHTS)
    if sees == "state":
        return None
    if camera is None:
        raise ConfigError("A policy that sees frames needs a camera; give one, or evaluate with sees='state'.")
    return camera


def _checked(commands: NDArray[np.float32], num_cars: int) -> NDArray[np.float32]:
    if np.shape(commands) != (num_cars, 2):
        raise ShapeError(
            f"The policy's commands have shape {np.shape(commands)}, expected ({num_cars}, 2): "
            "one row per car, columns steering_angle [rad] and speed [m/s]."
        )
    return commands
