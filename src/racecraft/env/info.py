"""The ``info`` of a step: the row that the rules judged, for one car or in Gymnasium's vector format."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from racecraft.sim.columns import ROW_COLUMNS, STATUS_NAMES

INFO_NAMES: Final = tuple("episode_number" if name == "episode" else name for name in ROW_COLUMNS)
"""Keys of an info; ``episode`` belongs to the wrappers that record statistics."""

WHOLE_COLUMNS: Final = ("episode", "steps", "closest_prev", "closest_next", "track_index", "lap")
TRUTH_COLUMNS: Final = ("all_wheels_on_track", "is_offtrack", "is_crashed", "is_reversed")

_STATUS = ROW_COLUMNS.index("status")
_NAMES = np.array(STATUS_NAMES, dtype=object)
_PYTHON_TYPES: Final[list[type]] = [
    int if name in WHOLE_COLUMNS else bool if name in TRUTH_COLUMNS else float for name in ROW_COLUMNS
]


def single_info(row: NDArray[np.float64]) -> dict[str, Any]:
    """Every column of a row by its name, as int, bool or float; ``status`` as its name."""
    info: dict[str, Any] = {
        name: kind(value) for name, kind, value in zip(INFO_NAMES, _PYTHON_TYPES, row.tolist(), strict=True)
    }
    info["status"] = STATUS_NAMES[int(info["status"])]
    return info


def vector_info(rows: NDArray[np.float64], mask: NDArray[np.bool_] | None = None) -> dict[str, Any]:
    """The same for a batch: an array (N,) per name, and a mask ``_name`` (N,) of the cars that it speaks of.

    Args:
        rows: Rows of the simulation (N, columns).
        mask: The cars to speak of; the others' entries are zero. All without a mask.
    """
    has_all = mask is None
    shown = np.ones(len(rows), dtype=np.bool_) if mask is None else mask
    codes = rows[:, _STATUS].astype(np.intp)
    info: dict[str, Any] = {}
    for index, (name, kind) in enumerate(zip(INFO_NAMES, _PYTHON_TYPES, strict=True)):
        values: NDArray[Any] = _NAMES[codes] if index == _STATUS else rows[:, index].astype(kind)
        if not has_all:
            values[~shown] = None if index == _STATUS else 0
        info[name] = values
        info[f"_{name}"] = shown.copy()
    return info


class LapClock:
    """Times laps: seconds from the episode's start, or from the end of its last lap, to the end of a lap."""

    def __init__(self, num_envs: int) -> None:
        self._began = np.zeros(num_envs)

    def restart(self, mask: NDArray[np.bool_]) -> None:
        """The masked cars begin an episode."""
        self._began[mask] = 0.0

    def completed(
        self, status: NDArray[np.float64], time: NDArray[np.float64]
    ) -> tuple[NDArray[np.bool_], NDArray[np.float64]] | None:
        """Which cars completed a lap in this step and their lap times, 0 for the others; None without any.

        Args:
            status: Column of the rows (N,).
            time: Column of the rows, seconds since the episode's start (N,).
        """
        has_lap = status == STATUS_NAMES.index("lap_complete")
        if not has_lap.any():
            return None
        lap_times = np.where(has_lap, time - self._began, 0.0)
        self._began[has_lap] = time[has_lap]
        return has_lap, lap_times
