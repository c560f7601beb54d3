"""Logs of the original against the simulator: rules, dynamics and rewards in one pass over the files."""

from __future__ import annotations

import warnings
from collections.abc import Iterable
from contextlib import ExitStack
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from racecraft.checks import check_path, require
from racecraft.fidelity.differences import Differences
from racecraft.fidelity.dynamics import (
    KNOWN_ROWS,
    REPORTED_STEPS,
    WINDOW_ROWS,
    Windows,
    errors_of,
    reported_errors,
    windows_of,
)
from racecraft.fidelity.given import log_files, track_of, vehicle_of
from racecraft.fidelity.logs import GIVE_APART, Faults, Log, read_logs
from racecraft.fidelity.rules import RulesAgreement, TrackRules, require_agreement, require_length

if TYPE_CHECKING:
    from racecraft.sim.vehicle import Vehicle
    from racecraft.track.track import Track

REWARD_TOLERANCE: Final = 1.0001e-4
MAX_WINDOWS: Final = 2_000_000
"""Windows kept for the percentiles; beyond it every other one is driven."""


@dataclass(frozen=True)
class Example:
    """One window to look at: where it is, and what was predicted."""

    source: str
    line: int  # of its first row
    error: float  # m, after the last step
    known: NDArray[np.float64]  # poses   (K, 3)
    truth: NDArray[np.float64]  # (S, 3)
    prediction: NDArray[np.float64]  # (S, 3)


@dataclass
class Comparison:
    """What came out. Shares are of all rows, 0 to 1."""

    track: Track
    vehicle: Vehicle
    rules: RulesAgreement
    faults: Faults
    differences: Differences
    errors: NDArray[np.float64]  # m and rad after REPORTED_STEPS   (W, 3, 2)
    clocks: tuple[str, ...]  # readings of the time stamps that were met
    moved: int = 0  # times that somebody moved the car by hand
    rewards: int = 0  # rows whose reward was compared
    good_rewards: int = 0
    examples: tuple[Example, ...] = ()  # the median and the worst window

    @property
    def reversed(self) -> bool:
        """Whether most of the driving was against the route's direction."""
        return 2 * self.rules.reversed > self.rules.rows

    def to_dict(self) -> dict[str, Any]:
        """What ``racecraft replay --json`` prints."""
        rules = self.rules
        return {
            "rows": rules.rows,
            "episodes": rules.episodes,
            "windows": len(self.errors),
            "broken_rows": self.faults.count,
            "moved_by_hand": self.moved,
            "progress_agreement": _share(rules.progress, rules.rows),
            "all_wheels_agreement": _share(rules.all_wheels, rules.rows),
            "closest_waypoint_agreement": _share(rules.closest_waypoint, rules.rows),
            "unseen_ends": rules.unseen,
            "episode_end_agreement": _share(rules.ends, rules.episodes - rules.unseen),
            "position_error_m": self._quantile(0, 0.5),
            "position_error_p90_m": self._quantile(0, 0.9),
            "heading_error_deg": self._quantile(1, 0.5),
            "heading_error_p90_deg": self._quantile(1, 0.9),
            "reward_agreement": _share(self.good_rewards, self.rewards),
            "differences": [asdict(difference) for difference in self.differences.kept],
        }

    def _quantile(self, quantity: int, share: float) -> dict[str, float] | None:
        if not len(self.errors):
            return None
        values = np.quantile(self.errors[:, :, quantity], share, axis=0)
        values = np.degrees(values) if quantity else values
        return {str(step): float(value) for step, value in zip(REPORTED_STEPS, values, strict=True)}


def replay(
    logs: str | Path | Iterable[str | Path],
    *,
    track: str | Path | Track,
    vehicle: str | Path | Vehicle = "v5",
    reward: str | None = None,
    rows: str | Path | None = None,
) -> Comparison:
    """Compare logs that the original (or this simulator) wrote with what the simulator makes of them.

    Args:
        logs: Sim-traces: CSV, or logs with SIM_TRACE_LOG lines; gzip or not. Several are taken together.
        track: The track they were driven on: a name, a file or a `Track`. Each episode's direction is found by itself.
        vehicle: The car to compare with: a preset, a vehicle file or a `Vehicle`.
        reward: Source of the reward function that was in force, to compare rewards too.
        rows: CSV file for every row that comes out otherwise, with both values.

    Raises:
        RunError: A log cannot be read, or was not driven on this track.
        ConfigError: There is no log, or no such vehicle, or the reward is no source.
        TrackError: There is no such track.
        RewardError: The reward function is not valid or fails.
    """
    if rows is not None:
        check_path("rows", rows, "use a CSV file's path")
    paths, road, car = log_files(logs), track_of(track), vehicle_of(vehicle)
    if reward is not None:
        from racecraft.reward import preset_names, validate_reward

        is_source = isinstance(reward, str) and reward not in preset_names() and not reward.endswith(".py")
        require("reward", reward, is_source, "its source, which racecraft.reward.load_reward(NAME_OR_FILE) reads")
        validate_reward(reward)
    rules, agreement, faults, differences = TrackRules(road), RulesAgreement(), Faults(), Differences(rows)
    result = Comparison(road, car, agreement, faults, differences, np.zeros((0, len(REPORTED_STEPS), 2)), ())
    checked: set[str] = set()
    errors: list[NDArray[np.float64]] = []
    clocks: set[str] = set()
    typical: list[Example] = []
    worst: Example | None = None
    stride = 1
    with ExitStack() as stack:
        stack.enter_context(differences)
        worker = None
        if reward is not None:
            from racecraft.reward.worker import RewardWorker

            worker = stack.enter_context(RewardWorker(reward, road))
        for log in read_logs(paths, faults):
            judged = rules.judge(log)
            if log.source not in checked:
                checked.add(log.source)
                require_length(road, log)
                first = RulesAgreement()
                first.add(rules, log, judged, Differences())
                require_agreement(rules, log, first)
            agreement.add(rules, log, judged, differences)
            result.moved += int(log.is_moved.sum())
            if worker is not None:
                _compare_rewards(result, log, worker(judged[~log.is_prepare & ~log.is_paused]))
            windows = windows_of([log], stride=stride)
            if windows is not None:
                errors.append(reported_errors(windows, car).astype(np.float32))
                clocks.add(windows.clock)
                order = np.argsort(errors[-1][:, -1, 0])
                typical.append(_example(windows, int(order[len(order) // 2]), car))
                worst = max(worst, _example(windows, int(order[-1]), car), key=lambda e: -1.0 if e is None else e.error)
                if sum(map(len, errors)) > MAX_WINDOWS:
                    stride *= 2
                    errors = [np.concatenate(errors)[::2]]
    if errors and worst is not None:
        result.errors = np.concatenate(errors)
        middle = float(np.median(result.errors[:, -1, 0]))
        result.examples = (min(typical, key=lambda example: abs(example.error - middle)), worst)
    else:
        told = f"Motion is not compared: nowhere do {WINDOW_ROWS} rows of one drive follow each other. {GIVE_APART}"
        warnings.warn(told, stacklevel=2)
    result.clocks = tuple(sorted(clocks))
    return result


def _compare_rewards(result: Comparison, log: Log, rewards: NDArray[np.float64]) -> None:
    rows = np.flatnonzero(~log.is_prepare & ~log.is_paused)  # of a car that stands no reward is asked
    logged = log.reward[rows]
    good = np.abs(rewards - logged) <= REWARD_TOLERANCE
    result.rewards += len(logged)
    result.good_rewards += int(good.sum())
    if len(bad := np.flatnonzero(~good)):
        values = logged[bad].tolist(), rewards[bad].tolist()
        result.differences.add(log, "reward", rows[bad], *values, [""] * len(bad))


def _example(windows: Windows, number: int, car: Vehicle) -> Example:
    window = windows.take(np.array([number]))
    first = int(window.first[0])
    prediction, truth = window.drive(car)[0], window.truth()[0]
    return Example(
        source=window.source[0],
        line=int(window.lines[first]),
        error=float(errors_of(prediction, truth)[-1, 0]),
        known=window.poses[first : first + KNOWN_ROWS].copy(),
        truth=truth,
        prediction=prediction,
    )


def _share(good: int, of: int) -> float | None:
    return good / of if of else None
