"""Many cars as one Gymnasium vector environment, stepped together by the native core."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Unpack

import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import ArrayLike, NDArray

from racecraft.checks import check_flag, check_type
from racecraft.env.info import vector_info
from racecraft.env.observation import Observation
from racecraft.env.rendering import Renderer, check_render_mode
from racecraft.env.task import DrivingTask, TaskSettings, check_names, seed_key
from racecraft.errors import ConfigError, ResetNeeded, ShapeError
from racecraft.track import Track

StepResult = tuple[Observation, NDArray[np.float64], NDArray[np.bool_], NDArray[np.bool_], dict[str, Any]]


class RacecraftVectorEnv(VectorEnv[Observation, Any, NDArray[Any]]):
    """N cars, each as `RacecraftEnv` has one; its datasheet describes spaces, rewards, info and arguments.

    ```python
    envs = gymnasium.make_vec("Racecraft-v0", num_envs=64, track="oval")
    ```

    Car ``i`` after ``reset(seed=s)`` gives the same bits as a `RacecraftEnv` after ``reset(seed=s + i)``
    (a reward function that draws random numbers excepted: the cars share its process).

    Args:
        track: One track, or several: car ``i`` then drives on track ``i`` modulo their number.
        num_envs: Cars, N.
        autoreset_mode: When a car whose episode is over begins the next: ``NextStep`` (the following step
            only resets it: reward 0, action ignored), ``SameStep`` (at once; the infos have ``final_obs`` and
            ``final_info``), or ``Disabled`` (call ``reset(options={"reset_mask": mask})``).
        copy: Whether observations are copies; False gives views that the next step overwrites.
        num_threads: Threads that step the cars, 0 for one per core.
        render_mode: None or ``rgb_array``.
        **settings: As for `RacecraftEnv`.

    Raises:
        ConfigError: A setting is not allowed.
        RewardError: The reward function is not valid.
    """

    metadata: dict[str, Any] = {  # noqa: RUF012 - Gymnasium's contract
        "render_modes": ["rgb_array"],
        "render_fps": 15,
        "autoreset_mode": AutoresetMode.NEXT_STEP,
    }

    def __init__(
        self,
        track: str | Path | Track | Sequence[str | Path | Track] = "reinvent_2018",
        *,
        num_envs: int = 1,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        copy: bool = True,
        num_threads: int = 0,
        render_mode: str | None = None,
        **settings: Unpack[TaskSettings],
    ) -> None:
        check_names(settings, own=("track", "num_envs", "autoreset_mode", "copy", "num_threads", "render_mode"))
        check_render_mode(render_mode)
        check_flag("copy", copy)
        self.render_mode = render_mode
        self._mode = _autoreset_mode(autoreset_mode)
        self.metadata = {**self.metadata, "autoreset_mode": self._mode}
        self._task = DrivingTask(
            track,
            num_envs=num_envs,
            num_threads=num_threads,
            **settings,
        )
        self._renderer = Renderer(self._task.simulation) if render_mode else None
        self.num_envs = num_envs
        self.single_observation_space = self._task.observer.space
        self.single_action_space = self._task.action_space.space
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self._copy = copy
        self._has_key = np.zeros(num_envs, dtype=np.bool_)

    def reset(
        self,
        *,
        seed: int | Sequence[int | None] | NDArray[np.integer[Any]] | None = None,
        options: dict[str, Any] | None = None,
    ) -> tuple[Observation, dict[str, Any]]:
        """Begin the next episode of all cars or of some.

        Args:
            seed: One for all (car ``i`` gets ``seed + i``), or one per car, None where it keeps its own.
            options: ``{"reset_mask": mask}`` resets only the masked cars, bool (N,).

        Returns:
            Observations of all cars, and the infos of those that were reset.

        Raises:
            ConfigError: A seed is not allowed.
            ShapeError: The mask is not bool (N,) with a car in it.
        """
        given: int | Sequence[int | None] | None = seed.tolist() if isinstance(seed, np.ndarray) else seed
        mask = self._reset_mask(options)
        super().reset(seed=seed_key(given) if isinstance(given, int | np.integer) else None)
        own, keys = self._keys(given)
        if (mask & own).any():
            self._task.reset(mask & own)
        if (mask & ~own).any():
            self._task.reset(mask & ~own, seeds=keys)
        self._has_key |= mask
        infos = vector_info(self._task.simulation.rows, mask)
        return self._task.observer.batch(copy=self._copy), infos

    def step(self, actions: ArrayLike) -> StepResult:
        """Drive for 1/15 s.

        Args:
            actions: Indices (N,) or numbers in [-1, 1] (N, 2).

        Returns:
            Observations, rewards, terminations, truncations (N, ...), and infos in Gymnasium's vector format.

        Raises:
            ResetNeeded: A car has not begun an episode, or its episode is over and autoreset is disabled.
            ShapeError: The actions have another form than the action space's, or are not one per car.
            ConfigError: There is no such discrete action.
            NonFiniteAction: They hold NaN.
            RewardError: The reward function failed.
        """
        if not self._has_key.all():
            raise ResetNeeded("step() was called before reset(); call reset() first.")
        task, simulation = self._task, self._task.simulation
        over = task.done
        if self._mode is AutoresetMode.DISABLED and over.any():
            raise ResetNeeded(
                f"The episodes of cars {np.flatnonzero(over).tolist()} are over and autoreset is disabled; "
                'call reset(options={"reset_mask": terminations | truncations}) first.'
            )
        rewards = task.step(actions, reset=over)
        terminations, truncations = simulation.terminated.copy(), simulation.truncated.copy()
        laps = task.lap_times()
        infos: dict[str, Any] = {}
        if self._mode is AutoresetMode.SAME_STEP and (terminations | truncations).any():
            infos = self._reset_finished(terminations | truncations, laps)
            laps = _within(laps, ~(terminations | truncations))
        infos |= _with_laps(vector_info(simulation.rows), laps)
        return task.observer.batch(copy=self._copy), rewards, terminations, truncations, infos

    def render(self) -> tuple[Any, ...] | None:
        """The scene around every car as uint8 (480, 640, 3) if ``render_mode`` is ``rgb_array``."""
        if self._renderer is None:
            return None
        return tuple(self._renderer.frame(car) for car in range(self.num_envs))

    def close_extras(self, **kwargs: Any) -> None:
        """End the reward's process."""
        if hasattr(self, "_task"):
            self._task.close()

    def _reset_finished(
        self, finished: NDArray[np.bool_], laps: tuple[NDArray[np.bool_], NDArray[np.float64]] | None
    ) -> dict[str, Any]:
        """Reset the finished cars and return what Gymnasium wants to know of their last step."""
        task = self._task
        last_observations = np.full(self.num_envs, None, dtype=object)
        for car in np.flatnonzero(finished):
            last_observations[car] = task.observer.one(int(car))
        last_infos = _with_laps(vector_info(task.simulation.rows, finished), _within(laps, finished))
        task.reset(finished)
        return {
            "final_obs": last_observations,
            "_final_obs": finished.copy(),
            "final_info": last_infos,
            "_final_info": finished.copy(),
        }

    def _reset_mask(self, options: dict[str, Any] | None) -> NDArray[np.bool_]:
        check_type("options", options, (dict, type(None)), "use a dict, such as {'reset_mask': mask}")
        if not options or "reset_mask" not in options:
            return np.ones(self.num_envs, dtype=np.bool_)
        mask = options["reset_mask"]
        if not isinstance(mask, np.ndarray) or mask.dtype != np.bool_ or mask.shape != (self.num_envs,):
            raise ShapeError(f"options['reset_mask'] is {mask!r}, expected a bool array of shape ({self.num_envs},).")
        if not mask.any():
            raise ShapeError("options['reset_mask'] is False everywhere; there is no car to reset.")
        return mask

    def _keys(self, seed: int | Sequence[int | None] | None) -> tuple[NDArray[np.bool_], NDArray[np.uint64]]:
        """The cars that go on with their own key (N,), and the new keys of the others (N,)."""
        if seed is not None and not isinstance(seed, Sequence):
            seeds: list[int | None] = [(seed_key(seed) + car) % 2**64 for car in range(self.num_envs)]
        else:
            seeds = [None] * self.num_envs if seed is None else list(seed)
        if len(seeds) != self.num_envs:
            raise ConfigError(f"seed has {len(seeds)} entries, expected {self.num_envs}: one per car.")
        keys = np.zeros(self.num_envs, dtype=np.uint64)
        own = np.zeros(self.num_envs, dtype=np.bool_)
        for car, value in enumerate(seeds):
            if value is not None:
                keys[car] = seed_key(value)
            elif self._has_key[car]:
                own[car] = True
            else:
                keys[car] = self.np_random.integers(2**63)
        return own, keys


def _autoreset_mode(mode: AutoresetMode | str) -> AutoresetMode:
    try:
        return AutoresetMode(mode)
    except ValueError:
        allowed = ", ".join(repr(known.value) for known in AutoresetMode)
        raise ConfigError(f"autoreset_mode is {mode!r}; allowed is {allowed} or an AutoresetMode.") from None


def _within(
    laps: tuple[NDArray[np.bool_], NDArray[np.float64]] | None, mask: NDArray[np.bool_]
) -> tuple[NDArray[np.bool_], NDArray[np.float64]] | None:
    """The laps of the masked cars, None without any."""
    if laps is None or not (laps[0] & mask).any():
        return None
    return laps[0] & mask, np.where(mask, laps[1], 0.0)


def _with_laps(infos: dict[str, Any], laps: tuple[NDArray[np.bool_], NDArray[np.float64]] | None) -> dict[str, Any]:
    if laps is not None:
        infos["_lap_time"], infos["lap_time"] = laps
    return infos
