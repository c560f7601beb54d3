"""What a car may do: the table or the box between a policy's outputs and the simulator's commands.

Inside, a command is (steering_angle [rad, left positive], speed [m/s]); AWS's files say degrees, and only
``from_aws`` and ``to_aws`` know that.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from racecraft.checks import check_choice, is_number, require, shown
from racecraft.errors import ConfigError, NonFiniteAction, ShapeError

if TYPE_CHECKING:
    import gymnasium

MAX_STEERING = 30.0  # degrees; the car's front wheels turn no further
MAX_FILE_STEERING = 45.0  # degrees; files of 2018 have it: rewards and logs say so, the wheels stop at 30
MIN_SPEED, MAX_SPEED = 0.1, 4.0  # m/s
MAX_FILE_SPEED = 12.0  # m/s; files of 2019 have more than 4: rewards and logs say so, the car drives 4
MIN_ACTIONS, MAX_ACTIONS = 2, 30
STEERING_GRANULARITIES = (3, 5, 7)
SPEED_GRANULARITIES = (1, 2, 3)


class DiscreteActionSpace:
    """A table of commands; the policy picks a row.

    Args:
        table: Rows of (steering_angle [rad], speed [m/s])   (A, 2), A from 2 to 30.
        extra: Of each action what else its file says, which means nothing here.
    """

    kind = "discrete"

    def __init__(self, table: ArrayLike, *, extra: Sequence[Mapping[str, Any]] = ()) -> None:
        self.table = _frozen(table, name="table")
        self.extra = tuple(extra)
        if self.table.ndim != 2 or self.table.shape[1] != 2:
            raise ShapeError(f"table has shape {self.table.shape}, expected (actions, 2): steering_angle, speed.")
        if not MIN_ACTIONS <= len(self.table) <= MAX_ACTIONS:
            count = len(self.table)
            raise ConfigError(f"action_space has {MIN_ACTIONS} to {MAX_ACTIONS} actions; this one has {count}.")
        for index, (steering, speed) in enumerate(self.to_degrees()):
            _check(
                f"action_space[{index}].steering_angle",
                steering,
                -MAX_FILE_STEERING,
                MAX_FILE_STEERING,
                "degrees",
            )
            if not MIN_SPEED <= speed <= MAX_FILE_SPEED:
                _check(f"action_space[{index}].speed", speed, MIN_SPEED, MAX_SPEED, "m/s")
        self._commands = self.table.astype(np.float32)

    @classmethod
    def grid(
        cls, max_steering: float, *, steering_granularity: int, max_speed: float, speed_granularity: int
    ) -> DiscreteActionSpace:
        """The table AWS's console makes: every steering angle with every speed.

        Args:
            max_steering: Largest angle in degrees, 1 to 30; angles are spread evenly from minus to plus this.
            steering_granularity: Number of angles: 3, 5 or 7.
            max_speed: Largest speed in m/s, 0.1 to 4.
            speed_granularity: Number of speeds n: 1, 2 or 3; they are max_speed · i/n.
        """
        _check("max_steering", max_steering, 1.0, MAX_STEERING, "degrees")
        _check("max_speed", max_speed, MIN_SPEED, MAX_SPEED, "m/s")
        is_usual = steering_granularity in STEERING_GRANULARITIES
        require("steering_granularity", steering_granularity, is_usual, "3, 5 or 7")
        require("speed_granularity", speed_granularity, speed_granularity in SPEED_GRANULARITIES, "1, 2 or 3")
        angles = np.linspace(-max_steering, max_steering, steering_granularity)
        speeds = [max_speed * (i + 1) / speed_granularity for i in range(speed_granularity)]
        return cls([(math.radians(angle), speed) for angle in angles for speed in speeds])

    @classmethod
    def from_aws(cls, actions: Sequence[Mapping[str, Any]]) -> DiscreteActionSpace:
        """From AWS's list of ``{"steering_angle": degrees, "speed": m/s}``; other keys are `extra`."""
        try:
            table = [(math.radians(float(a["steering_angle"])), float(a["speed"])) for a in actions]
        except (LookupError, TypeError, ValueError) as error:
            allowed = 'a list of {"steering_angle": degrees, "speed": m/s}'
            raise ConfigError(f"actions is {shown(actions)}; allowed is {allowed}.") from error
        known = ("steering_angle", "speed", "index")
        return cls(
            np.array(table, dtype=np.float64).reshape(-1, 2),
            extra=[{key: value for key, value in a.items() if key not in known} for a in actions],
        )

    def to_aws(self) -> list[dict[str, float | int]]:
        """AWS's list of actions, in degrees, with their index."""
        return [
            {"steering_angle": steering, "speed": speed, "index": index}
            for index, (steering, speed) in enumerate(self.to_degrees())
        ]

    def to_file(self) -> list[dict[str, Any]]:
        """The same with `extra`."""
        extra = self.extra or ({},) * self.size
        return [{**action, **more} for action, more in zip(self.to_aws(), extra, strict=True)]

    def to_commands(self, actions: ArrayLike) -> NDArray[np.float32]:
        """Commands for ``Simulation.step``   (N, 2) from action indices   (N,)."""
        indices = _array(actions)
        if indices.ndim != 1 or indices.dtype.kind not in "iu":
            raise ShapeError(
                f"actions have shape {indices.shape} and type {indices.dtype}, "
                "expected (N,) integers: one index per car."
            )
        if indices.size and (indices.min() < 0 or indices.max() >= self.size):
            wrong = indices[(indices < 0) | (indices >= self.size)][0]
            raise ConfigError(f"action {wrong} does not exist; allowed is 0 to {self.size - 1}.")
        commands: NDArray[np.float32] = self._commands[indices]
        return commands

    def to_degrees(self) -> list[tuple[float, float]]:
        """The table as (steering_angle [degrees], speed [m/s]), with the decimals a person would write."""
        return [(_degrees(steering), speed) for steering, speed in self.table.tolist()]

    @property
    def size(self) -> int:
        """Number of actions A: the width of the policy's output."""
        return len(self.table)

    @property
    def most_speed(self) -> float:
        """The fastest action's, m/s."""
        return float(self.table[:, 1].max())

    @cached_property
    def labels(self) -> tuple[str, ...]:
        """A short name of each action, such as ``left 15° 2 m/s``."""
        return tuple(f"{_direction(steering)} {speed:g} m/s" for steering, speed in self.to_degrees())

    @property
    def space(self) -> gymnasium.spaces.Discrete:
        """The Gymnasium space of one car's action."""
        from gymnasium.spaces import Discrete

        return Discrete(self.size)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, DiscreteActionSpace) and np.array_equal(self.table, other.table)

    def __hash__(self) -> int:
        return hash(self.table.tobytes())

    def __repr__(self) -> str:
        angles, speeds = zip(*self.to_degrees(), strict=True)
        widest = max(map(abs, angles))
        return f"DiscreteActionSpace({self.size} actions, ±{widest:g}°, {min(speeds):g} to {max(speeds):g} m/s)"


class ContinuousActionSpace:
    """A box of commands; the policy gives two numbers in [-1, 1], scaled onto it.

    Args:
        low: Smallest (steering_angle [rad], speed [m/s])   (2,).
        high: Largest   (2,); steering spans zero.
        extra: What else its file says, which means nothing here, at any depth.
    """

    kind = "continuous"
    size = 2
    """Numbers the policy gives: steering and speed."""
    labels = ("steering_angle", "speed")

    def __init__(self, low: ArrayLike, high: ArrayLike, *, extra: Mapping[str, Any] = {}) -> None:
        self.low, self.high = _frozen(low, name="low"), _frozen(high, name="high")
        self.extra = dict(extra)
        if self.low.shape != (2,) or self.high.shape != (2,):
            raise ShapeError(
                f"low has shape {self.low.shape} and high {self.high.shape}, expected (2,): steering_angle, speed."
            )
        left, right = _degrees(float(self.low[0])), _degrees(float(self.high[0]))
        _check("action_space.steering_angle.low", left, -MAX_STEERING, 0.0, "degrees")
        _check("action_space.steering_angle.high", right, 0.0, MAX_STEERING, "degrees")
        _check("action_space.speed.low", float(self.low[1]), MIN_SPEED, MAX_SPEED, "m/s")
        _check("action_space.speed.high", float(self.high[1]), MIN_SPEED, MAX_SPEED, "m/s")
        for name, low_value, high_value in (
            ("steering_angle", left, right),
            ("speed", self.low[1], self.high[1]),
        ):
            is_below = low_value < high_value
            require(f"action_space.{name}.low", float(low_value), is_below, f"below its high of {high_value:g}")

    @classmethod
    def from_aws(cls, limits: Mapping[str, Mapping[str, Any]]) -> ContinuousActionSpace:
        """From AWS's ``{"steering_angle": {"low", "high"} in °, "speed": {"low", "high"}}``; others are `extra`."""
        names = ("steering_angle", "speed")
        try:
            low, high = ([float(limits[name][end]) for name in names] for end in ("low", "high"))
        except (LookupError, TypeError, ValueError) as error:
            allowed = '{"low": ..., "high": ...} for "steering_angle" in degrees and "speed" in m/s'
            raise ConfigError(f"limits is {shown(limits)}; allowed is {allowed}.") from error
        inside = {
            name: {key: value for key, value in limits[name].items() if key not in ("low", "high")} for name in names
        }
        return cls([math.radians(low[0]), low[1]], [math.radians(high[0]), high[1]], extra={**limits, **inside})

    def to_aws(self) -> dict[str, dict[str, float]]:
        """AWS's limits, steering in degrees."""
        return {
            "steering_angle": {"low": _degrees(float(self.low[0])), "high": _degrees(float(self.high[0]))},
            "speed": {"low": float(self.low[1]), "high": float(self.high[1])},
        }

    def to_file(self) -> dict[str, Any]:
        """The same with `extra`."""
        return {**self.extra, **{name: {**ends, **self.extra.get(name, {})} for name, ends in self.to_aws().items()}}

    def to_commands(self, actions: ArrayLike) -> NDArray[np.float32]:
        """Commands for ``Simulation.step``   (N, 2) from actions   (N, 2); what is beyond ±1 counts as ±1."""
        values = _array(actions, dtype=np.float64)
        if values.ndim != 2 or values.shape[1] != 2:
            raise ShapeError(
                f"actions have shape {values.shape}, expected (N, 2): steering_angle and speed in [-1, 1]."
            )
        if np.isnan(values).any():
            car = int(np.isnan(values).any(axis=1).argmax())
            raise NonFiniteAction(f"action[{car}] = {tuple(values[car].tolist())}, expected two numbers in [-1, 1].")
        share = (np.clip(values, -1.0, 1.0) + 1.0) * 0.5
        commands: NDArray[np.float32] = (self.low * (1.0 - share) + self.high * share).astype(np.float32)
        return commands

    @property
    def most_speed(self) -> float:
        """m/s."""
        return float(self.high[1])

    @property
    def space(self) -> gymnasium.spaces.Box:
        """The Gymnasium space of one car's action: [-1, 1]²."""
        from gymnasium.spaces import Box

        return Box(-1.0, 1.0, (2,), np.float32)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, ContinuousActionSpace):
            return NotImplemented
        return np.array_equal(self.low, other.low) and np.array_equal(self.high, other.high)

    def __hash__(self) -> int:
        return hash((self.low.tobytes(), self.high.tobytes()))

    def __repr__(self) -> str:
        left, right = _degrees(float(self.low[0])), _degrees(float(self.high[0]))
        return f"ContinuousActionSpace({left:g}° to {right:g}°, {self.low[1]:g} to {self.high[1]:g} m/s)"


ActionSpace = DiscreteActionSpace | ContinuousActionSpace


def _grid(steering: int, speed: float, speeds: int) -> Callable[[], ActionSpace]:
    return lambda: DiscreteActionSpace.grid(
        MAX_STEERING, steering_granularity=steering, max_speed=speed, speed_granularity=speeds
    )


PRESETS: Mapping[str, Callable[[], ActionSpace]] = {
    "default": _grid(5, 2.0, 2),
    "aws": _grid(5, 1.0, 2),
    "fast": _grid(7, 4.0, 3),
    "safe": _grid(7, 1.4, 2),
    "steady": _grid(5, 1.0, 1),
    "continuous": lambda: ContinuousActionSpace([-math.radians(30), 0.5], [math.radians(30), 4.0]),
}
"""Action spaces by name: ours at 1 and 2 m/s, AWS's own at 0.5 and 1, one up to 4, one
that gets round everywhere (0.7 and 1.4), one that keeps to 1 among objects, and a continuous one."""


def action_space(name: str) -> ActionSpace:
    """The action space of a preset.

    Raises:
        ConfigError: No preset has this name.
    """
    check_choice("action space", name, PRESETS)
    return PRESETS[name]()


def _frozen(values: ArrayLike, *, name: str) -> NDArray[np.float64]:
    try:
        array = np.array(values, dtype=np.float64, order="C")
    except (TypeError, ValueError) as error:
        raise ShapeError(f"{name} is not an array of numbers: {error}.") from error
    if not np.isfinite(array).all():
        raise ConfigError(f"{name} holds NaN or infinity; allowed are finite steering angles and speeds.")
    array.setflags(write=False)
    return array


def _array(actions: ArrayLike, *, dtype: type | None = None) -> NDArray[Any]:
    try:
        array = np.asarray(actions)
        if array.dtype.kind == "c":
            raise TypeError("they are complex")  # NumPy would leave a part of them out
        return array if dtype is None else array.astype(dtype, copy=False)
    except (TypeError, ValueError, OverflowError) as error:
        raise ShapeError(f"actions are not an array of numbers: {error}.") from error


def _check(name: str, value: float, low: float, high: float, unit: str) -> None:
    if not is_number(value, is_plain=False) or not low <= value <= high:
        given = f"{value:g}" if is_number(value, is_plain=False) else shown(value)
        is_slip = unit == "degrees" and is_number(value, is_plain=False) and abs(value) > 100.0
        hint = "Angles are in radians here; from_aws takes degrees." if is_slip else ""
        allowed = f"{low:g} to {high:g} {unit}"
        raise ConfigError(f"{name} is {given}; allowed is {allowed}.", hint=hint)


def _degrees(radians: float) -> float:
    """The shortest decimal in degrees for this angle, so that a file is written as it was read."""
    exact = math.degrees(radians)
    for digits in range(16):
        rounded = round(exact, digits)
        if math.radians(rounded) == radians:
            return rounded
    return exact


def _direction(steering: float) -> str:
    if steering == 0:
        return "straight"
    return f"{'left' if steering > 0 else 'right'} {abs(steering):g}°"
