"""Several copies of one Gymnasium environment, stepped together: what every algorithm here learns from.

A world whose episode is over begins the next one at once. What came last in the old episode is still handed out, since
it is what the last step led to: a time limit (truncation) ends an episode, yet the world would have gone on.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, Final

import gymnasium
import numpy as np
from gymnasium import spaces
from gymnasium.vector import AutoresetMode
from numpy.typing import NDArray

from racecraft.classic.views import View
from racecraft.env import ENV_ID
from racecraft.errors import ConfigError, RacecraftError, TrainingError, did_you_mean, printable
from racecraft.extras import check_installed

NO_LIMIT: Final = 1000
"""Steps after which an episode is cut off that has no limit of its own: a bad policy would walk in circles for ever."""
OWN: Final = (ENV_ID, f"racecraft:{ENV_ID}")
"""Ids of ours: many cars are one simulation, and as fast as it is."""


@dataclass(frozen=True)
class Step:
    """What one step of N worlds gave."""

    rewards: NDArray[np.float32]
    """(N,)."""
    terminated: NDArray[np.bool_]
    """Where the episode has ended for good (N,)."""
    over: NDArray[np.bool_]
    """Where it has ended at all, by a time limit, too (N,)."""
    successors: NDArray[Any]
    """What the step led to (N, ...), also where the next episode has already begun."""


class Worlds:
    """N worlds, and a ledger of the episodes that were played in them.

    Args:
        name: Id of the environment, as ``gymnasium.make`` takes it.
        num_envs: Worlds, N.
        seed: The same seed gives the same worlds.
        make: Further arguments of ``gymnasium.make``.
        view: What the learner sees, made from the space of an observation.

    Raises:
        ConfigError: There is no such environment, or it cannot be made.
        TrainingError: It fails where it begins.
    """

    def __init__(
        self,
        name: str,
        *,
        num_envs: int,
        seed: int,
        view: Callable[[gymnasium.Space[Any]], View],
        make: Mapping[str, Any] | None = None,
    ) -> None:
        self.name, self.num_envs, self.seed, self.make = name, num_envs, seed, dict(make or {})
        self._players = _Cars(name, num_envs, self.make) if name in OWN else _Singles(name, num_envs, self.make)
        try:
            self.action_space = self._players.action_space
            self.num_actions = count_actions(self.action_space)
            """Choices there are, or numbers that make up an action; 0 for anything else."""
            self.view = view(self._players.observation_space)
            self.steps = 0
            """Taken in all worlds together."""
            self.returns: list[float] = []
            """Sum of the rewards of every finished episode."""
            self._sums = np.zeros(num_envs)
            seeds = np.random.SeedSequence(seed).generate_state(num_envs, np.uint32)
            with _failures_of(name):
                begun = self._players.reset([int(key) for key in seeds])
            self.observations: NDArray[Any] = self.view(begun)
            """What the learner sees now (N, ...)."""
        except BaseException:
            self.close()
            raise

    def step(self, actions: NDArray[Any], *, among: NDArray[np.bool_] | None = None) -> Step:
        """Act in every world.

        Args:
            actions: Numbers of choices (N,), or from -1 to 1 over the range of each action (N, A).
            among: Worlds that matter (N,); what others do is not looked at, and they may rest.

        Raises:
            TrainingError: The environment has failed, or has given a reward that is no finite number.
        """
        space = self.action_space
        if isinstance(space, spaces.Box):
            actions = to_bounds(actions, space)
        else:
            actions = actions + int(getattr(space, "start", 0))
        with _failures_of(self.name):
            raw, rewards, terminated, truncated = self._players.step(actions, among)
        if not np.isfinite(rewards).all():
            raise TrainingError(f"{self.name} has given a reward that is no finite number.")
        over = terminated | truncated
        successors = self.observations = self.view(raw)
        self.steps += self.num_envs
        self._sums += rewards
        if over.any():
            finished = np.flatnonzero(over)
            self.returns += self._sums[finished].tolist()
            self._sums[finished] = 0.0
            self.observations = successors.copy()
            with _failures_of(self.name):
                begun = self._players.begin(finished)
            self.observations[finished] = self.view(begun)
        return Step(np.asarray(rewards, np.float32), terminated, over, successors)

    @property
    def render_fps(self) -> float:
        """Pictures that make up a second."""
        return float(self._players.metadata.get("render_fps", 30))

    def render(self) -> Any:
        """A picture of the first world, RGB (height, width, 3)."""
        return self._players.render()

    def close(self) -> None:
        """Release what the worlds hold; calling again does nothing."""
        self._players.close()


def count_actions(space: gymnasium.Space[Any]) -> int:
    """Choices, or numbers of a vector."""
    if isinstance(space, spaces.Discrete):
        return int(space.n)
    return int(np.prod(space.shape)) if isinstance(space, spaces.Box) else 0


def to_bounds(actions: NDArray[Any], space: spaces.Box) -> NDArray[Any]:
    """From -1 .. 1 to the bounds of the space; as they are where it has none."""
    low, high = space.low, space.high
    if not space.is_bounded():
        return np.asarray(actions, space.dtype).reshape(-1, *space.shape)
    shares = (np.clip(actions, -1.0, 1.0).reshape(-1, *space.shape) + 1.0) / 2.0
    return np.asarray(low + shares * (high - low), space.dtype)


Raw = tuple[Sequence[Any], NDArray[np.float64], NDArray[np.bool_], NDArray[np.bool_]]


class _Singles:
    """Environments one by one."""

    def __init__(self, name: str, num_envs: int, make: Mapping[str, Any]) -> None:
        self._envs = [make_env(name, make)]
        self._envs += [make_env(name, make) for _ in range(num_envs - 1)]
        self.observation_space, self.action_space = self._envs[0].observation_space, self._envs[0].action_space
        self.metadata = self._envs[0].metadata
        self._is_box = isinstance(self.action_space, spaces.Box)
        self._seen: list[Any] = []

    def reset(self, seeds: Sequence[int]) -> list[Any]:
        self._seen = [env.reset(seed=seed)[0] for env, seed in zip(self._envs, seeds, strict=True)]
        return self._seen

    def begin(self, which: NDArray[Any]) -> list[Any]:
        return [self._envs[world].reset()[0] for world in which]

    def step(self, actions: NDArray[Any], among: NDArray[np.bool_] | None) -> Raw:
        n = len(self._envs)
        rewards, terminated, truncated = np.zeros(n), np.zeros(n, np.bool_), np.zeros(n, np.bool_)
        choices = actions if self._is_box else actions.tolist()
        for world in range(n) if among is None else np.flatnonzero(among).tolist():
            self._seen[world], rewards[world], terminated[world], truncated[world], _ = self._envs[world].step(
                choices[world]
            )
        return self._seen, rewards, terminated, truncated

    def render(self) -> Any:
        return self._envs[0].render()

    def close(self) -> None:
        for env in self._envs:
            env.close()


class _Cars:
    """Our own environment: all cars at once."""

    def __init__(self, name: str, num_envs: int, make: Mapping[str, Any]) -> None:
        with said_plainly(name, make):
            self._env: Any = gymnasium.make_vec(
                f"racecraft.env:{ENV_ID}",
                num_envs=num_envs,
                num_threads=1,
                autoreset_mode=AutoresetMode.DISABLED,
                **make,
            )
        self.observation_space = self._env.single_observation_space
        self.action_space = self._env.single_action_space
        self.metadata = self._env.metadata

    def reset(self, seeds: Sequence[int]) -> Any:
        return self._env.reset(seed=list(seeds))[0]

    def begin(self, which: NDArray[Any]) -> Any:
        mask = np.zeros(self._env.num_envs, np.bool_)
        mask[which] = True
        return self._env.reset(options={"reset_mask": mask})[0][which]

    def step(self, actions: NDArray[Any], among: NDArray[np.bool_] | None) -> Raw:
        seen, rewards, terminated, truncated, _ = self._env.step(actions)
        return seen, np.asarray(rewards), terminated, truncated

    def render(self) -> Any:
        pictures = self._env.render()
        return None if pictures is None else pictures[0]

    def close(self) -> None:
        self._env.close()


def make_env(name: str, make: Mapping[str, Any]) -> gymnasium.Env[Any, Any]:
    """An environment of Gymnasium's registry, with a limit to its episodes; errors as of `said_plainly`."""
    if name.startswith("ALE/"):
        check_installed("ale_py", f"{name} is a game of Atari and")
        import ale_py

        gymnasium.register_envs(ale_py)
    with said_plainly(name, make):
        env = gymnasium.make(name, disable_env_checker=True, **make)
    has_limit = env.spec is not None and env.spec.max_episode_steps is not None
    return env if has_limit else gymnasium.wrappers.TimeLimit(env, NO_LIMIT)


@contextmanager
def said_plainly(name: str, make: Mapping[str, Any]) -> Iterator[None]:
    """What Gymnasium says of an environment that it cannot make, in one sentence of ours.

    Raises:
        ConfigError: There is none of this name, what it needs is not installed, or its arguments are wrong.
    """
    try:
        yield
    except RacecraftError:
        raise
    except gymnasium.error.DependencyNotInstalled as error:
        raise ConfigError(f"{name} needs more than is installed: {one_line(error)}") from error
    except (gymnasium.error.Error, ModuleNotFoundError) as error:
        raise ConfigError(
            f"There is no environment {printable(name)!r}: {one_line(error)}",
            hint=did_you_mean(name, sorted(gymnasium.registry)) or "Gymnasium's own pages list what there is.",
        ) from error
    except (TypeError, ValueError, KeyError) as error:
        given = ", ".join(f"{key}={value!r}" for key, value in make.items()) or "no arguments"
        raise ConfigError(f"{name} cannot be made with {given}: {one_line(error)}") from error


@contextmanager
def _failures_of(name: str) -> Iterator[None]:
    """What an environment raises while it is played, as its own failure.

    Raises:
        TrainingError: It has raised something.
    """
    try:
        yield
    except RacecraftError:
        raise
    except Exception as error:
        raise TrainingError(
            f"{name} has failed while it was played: {type(error).__name__}: {one_line(error)}",
            hint="The mistake is in the environment; --debug shows where.",
        ) from error


def one_line(error: Exception) -> str:
    """Somebody else's error."""
    return printable(" ".join(str(error).split()))
