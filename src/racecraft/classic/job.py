"""`learn`: an algorithm meets an environment; evaluated on the way, judged at the end, saved.

Learning on and on can make a network worse. So greedy episodes are played now and then, the best policy seen so far is
what is kept, and what is reported at the end was measured on 100 episodes that had no part in choosing it.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from racecraft.checks import check_whole, require
from racecraft.classic.algorithms import check_fit, find_algorithm
from racecraft.classic.blas import one_blas_thread
from racecraft.classic.evaluation import play
from racecraft.classic.policy import Policy, restore
from racecraft.classic.recipes import find_recipe
from racecraft.classic.saved import Lesson, load, read_curve, save
from racecraft.classic.until import Goal
from racecraft.classic.views import CellView, VectorView, View
from racecraft.classic.worlds import Worlds
from racecraft.errors import TrainingError
from racecraft.run import RunFolder

EPISODES: Final = 20
"""Of an evaluation on the way."""
JUDGED: Final = 100
"""Episodes of the last evaluation, and of one that says that the goal is reached."""
RECENT: Final = 100
"""Episodes of learning that a mean looks back on."""
LEARN, EVALUATE, CONFIRM, JUDGE, WATCH = range(5)
"""What random numbers are for: no two purposes share worlds."""


@dataclass(frozen=True)
class Progress:
    """Where learning stands, after an evaluation."""

    steps: int
    """Of all worlds."""
    total_steps: int
    """After which it ends."""
    seconds: float
    """Wall clock so far."""
    seconds_left: float
    """That the other steps will take, if they are as quick as those so far; NaN where nobody can say yet."""
    training_return: float
    """Mean of the last episodes that were played to learn; NaN before the first."""
    mean_return: float
    """Mean of greedy episodes."""
    is_best: bool
    """Whether none was better."""


@dataclass(frozen=True, kw_only=True)
class Learned:
    """What came of it."""

    lesson: Lesson
    """What was learned from what."""
    policy: Policy
    """The best one seen; of a table the last."""
    run: Path | None
    """Where it is saved."""
    reason: str
    """Why learning ended: return, steps, seconds or interrupted."""
    steps: int
    """Of all worlds, up to the end."""
    wall_seconds: float
    """Of learning, with the evaluations on the way."""
    learning_seconds: float
    """Of these, those of learning alone."""
    training_return: float
    """Mean of the last 100 episodes that were played to learn: with exploration."""
    returns: list[float] = field(repr=False)
    """Of every episode that was played to learn."""
    curve: list[tuple[int, float]] = field(repr=False)
    """Steps, and mean return of greedy episodes then."""

    @cached_property
    @one_blas_thread()
    def mean_return(self) -> float:
        """Of 100 greedy episodes in worlds of their own, played when somebody asks for it."""
        return _judged(self.lesson, self.policy, JUDGE, number=self.steps, episodes=JUDGED)

    def to_dict(self) -> dict[str, Any]:
        """As JSON."""
        return {
            "run": None if self.run is None else str(self.run),
            "environment": self.lesson.environment,
            "algorithm": self.lesson.algorithm,
            "seed": self.lesson.seed,
            "reason": self.reason,
            "steps": self.steps,
            "episodes": len(self.returns),
            "wall_seconds": round(self.wall_seconds, 3),
            "learning_seconds": round(self.learning_seconds, 3),
            "mean_return": self.mean_return,
            "training_return": None if math.isnan(self.training_return) else self.training_return,
        }


@one_blas_thread()
def learn(
    environment: str,
    algorithm: str,
    *,
    seed: int = 0,
    until: str = "",
    settings: Mapping[str, Any] | None = None,
    make: Mapping[str, Any] | None = None,
    root: str | Path | None = None,
    name: str | None = None,
    on_progress: Callable[[Progress], None] | None = None,
) -> Learned:
    """Learn from scratch.

    Args:
        environment: Any id of Gymnasium; ``module:Id`` imports the module first.
        algorithm: One of `ALGORITHMS`.
        seed: The same seed repeats it on the same kind of processor; not of ``a3c``, whose processes race.
        until: Such as ``"475 return or 60 s"``; replaces the recipe's end.
        settings: Of the algorithm, by name, instead of the recipe's.
        make: Further arguments of ``gymnasium.make``, beside the recipe's.
        root: Folder of all runs, in which one is made; nothing is saved without.
        name: Of the run's folder.
        on_progress: Called after every evaluation.

    Raises:
        ConfigError: There is no such environment, algorithm or setting, they do not fit each other, or `on_progress`
            cannot be called.
        RunError: The folder cannot be made.
        TrainingError: The numbers have left all bounds.
    """
    check_whole("seed", seed, 0, 2**63 - 1)
    for what, given in (("settings", settings), ("make", make)):
        is_named = isinstance(given, Mapping) and all(isinstance(key, str) for key in given)
        require(what, given, given is None or is_named, "a dict of names and values")
    _check_callable(on_progress)
    recipe = find_recipe(environment, algorithm)
    goal = Goal.parse(until) if until else Goal(mean_return=recipe.goal)
    chosen = recipe.settings.changed(settings or {})
    if goal.steps:
        chosen = replace(chosen, steps=goal.steps)
    lesson = Lesson(
        environment=environment, make={**recipe.make, **(make or {})}, algorithm=algorithm, settings=chosen, seed=seed
    )
    with _Classroom(lesson) as room:
        folder = None
        if root is not None:
            folder = RunFolder.create(root, name=name, prefix=f"{environment.rpartition(':')[2]}-{algorithm}").path
        try:
            return room.learn(goal, recipe.evaluate_every, folder, on_progress)
        except BaseException:
            if folder is not None:
                with suppress(OSError):
                    folder.rmdir()  # its name is free again where nothing was saved
            raise


@one_blas_thread()
def resume(run: str | Path, *, until: str = "", on_progress: Callable[[Progress], None] | None = None) -> Learned:
    """Go on with what a run has saved: its best policy, with a fresh optimiser and memory.

    Args:
        run: Its folder.
        until: As of `learn`; without, the settings' steps.
        on_progress: Called after every evaluation.

    Raises:
        RunError: The folder holds nothing of the kind.
        ConfigError: Its environment cannot be made, or `on_progress` cannot be called.
    """
    _check_callable(on_progress)
    lesson, arrays, steps = load(run)
    folder = Path(run)
    goal = Goal.parse(until) if until else Goal()
    if goal.steps:
        lesson = replace(lesson, settings=replace(lesson.settings, steps=goal.steps))
    with _Classroom(lesson, begun=steps) as room:
        restore(room.policy, arrays)
        room.curve = read_curve(folder)
        every = find_recipe(lesson.environment, lesson.algorithm).evaluate_every
        return room.learn(goal, every, folder, on_progress)


def _check_callable(on_progress: object) -> None:
    require("on_progress", on_progress, on_progress is None or callable(on_progress), "a function of one Progress")


def recall(run: str | Path) -> tuple[Lesson, Policy]:
    """What a run has learned, as it was saved.

    Raises:
        RunError: The folder holds nothing of the kind.
        ConfigError: Its environment cannot be made.
    """
    lesson, arrays, steps = load(run)
    with _Classroom(lesson, begun=steps) as room:
        restore(room.policy, arrays)
        return lesson, room.policy


def view_of(lesson: Lesson) -> Callable[[Any], View]:
    """What the algorithm sees, given the space of an observation."""
    if not find_algorithm(lesson.algorithm).has_table:
        return VectorView
    table: Any = lesson.settings
    return lambda space: CellView(space, cuts=table.cuts, bins=table.bins)


def worlds_of(lesson: Lesson, *, num_envs: int, purpose: int, number: int = 0, **more: Any) -> Worlds:
    """Worlds for a purpose; further arguments go to ``gymnasium.make``."""
    seed = int(np.random.SeedSequence((lesson.seed, purpose, number)).generate_state(1)[0])
    make = {**lesson.make, **more}
    return Worlds(lesson.environment, num_envs=num_envs, seed=seed, view=view_of(lesson), make=make)


class _Classroom:
    """One lesson while it goes on: its worlds, its policy, and the best of it so far."""

    def __init__(self, lesson: Lesson, *, begun: int = 0) -> None:
        self.lesson, self.algorithm, self.begun = lesson, find_algorithm(lesson.algorithm), begun
        self.started = time.perf_counter()
        self.rng = np.random.default_rng((lesson.seed, begun))
        self.worlds = worlds_of(lesson, num_envs=lesson.settings.num_envs, purpose=LEARN, number=begun)
        try:
            check_fit(lesson.algorithm, lesson.environment, self.worlds.action_space)
            self.policy: Policy = self.algorithm.begin(self.worlds, lesson.settings, self.rng)
        except BaseException:
            self.worlds.close()
            raise
        self.worlds.steps = begun
        self.curve: list[tuple[int, float]] = []
        self.judging = 0.0
        """s that evaluations took."""

    def __enter__(self) -> _Classroom:
        return self

    def __exit__(self, *_: object) -> None:
        self.worlds.close()

    def learn(
        self, goal: Goal, every: int, folder: Path | None, on_progress: Callable[[Progress], None] | None
    ) -> Learned:
        worlds, settings = self.worlds, self.lesson.settings
        best, kept = -math.inf, _copy(self.policy)
        if self.curve:  # a resumed run begins with its best
            best = max(mean for _, mean in self.curve)
        reason, evaluated, saved_at = "steps", worlds.steps, worlds.steps
        turns = self.algorithm.learn(worlds, self.policy, settings, self.rng)
        try:
            with np.errstate(all="ignore"):  # what is no number is found below
                for _ in turns:
                    is_late = time.perf_counter() - self.started >= goal.seconds
                    if worlds.steps < min(evaluated + every, settings.steps) and not is_late:
                        continue
                    evaluated = worlds.steps
                    self._check_finite()
                    mean = self._evaluate(EVALUATE, episodes=EPISODES)
                    self.curve.append((evaluated, mean))
                    is_best = mean >= best
                    if is_best:
                        best, saved_at, kept = mean, evaluated, _copy(self.policy)
                    if folder is not None:
                        self._save(folder, kept, saved_at, {})
                    if on_progress is not None:
                        on_progress(self._progress(mean, is_best=is_best))
                    if mean >= goal.mean_return and self._evaluate(CONFIRM, episodes=JUDGED) >= goal.mean_return:
                        reason, kept = "return", _copy(self.policy)
                        break
                    if is_late:
                        reason = "seconds"
                        break
        except KeyboardInterrupt:
            reason = "interrupted"
        finally:
            turns.close()  # type: ignore[attr-defined]
        self._check_finite()
        if not self.algorithm.has_table and best > -math.inf:  # who stops before the first evaluation keeps what it has
            restore(self.policy, kept)
        steps, learning = worlds.steps, time.perf_counter() - self.started - self.judging
        outcome = Learned(
            lesson=self.lesson,
            policy=self.policy,
            run=folder,
            reason=reason,
            steps=steps,
            learning_seconds=learning,
            wall_seconds=time.perf_counter() - self.started,
            training_return=self._recent(),
            returns=worlds.returns,
            curve=self.curve,
        )
        if folder is not None:
            self._save(folder, self.policy.arrays, steps, {})  # for those who do not wait for the judgement
            self._save(folder, self.policy.arrays, steps, outcome.to_dict())
        return outcome

    def _evaluate(self, purpose: int, *, episodes: int) -> float:
        """Mean return of greedy episodes in fresh worlds."""
        before = time.perf_counter()
        mean = _judged(self.lesson, self.policy, purpose, number=self.worlds.steps, episodes=episodes)
        self.judging += time.perf_counter() - before
        return mean

    def _check_finite(self) -> None:
        if not all(np.isfinite(array).all() for array in self.policy.arrays.values()):
            raise TrainingError(
                f"{self.lesson.algorithm} has left all bounds after {self.worlds.steps:,} steps: its weights are no "
                "numbers any more.",
                hint="A smaller learning_rate helps, or rewards of a smaller size.",
            )

    def _recent(self) -> float:
        returns = self.worlds.returns[-RECENT:]
        return float(np.mean(returns)) if returns else math.nan

    def _progress(self, mean: float, *, is_best: bool) -> Progress:
        steps, total = self.worlds.steps, self.lesson.settings.steps
        seconds, taken = time.perf_counter() - self.started, steps - self.begun
        return Progress(
            steps=steps,
            total_steps=total,
            seconds=seconds,
            seconds_left=seconds / taken * max(total - steps, 0) if taken > 0 else math.nan,
            training_return=self._recent(),
            mean_return=mean,
            is_best=is_best,
        )

    def _save(self, folder: Path, arrays: Mapping[str, NDArray[Any]], steps: int, result: Mapping[str, Any]) -> None:
        plain = {name: value for name, value in result.items() if name not in ("run", "steps", "seed")}
        plain = {name: value for name, value in plain.items() if name not in ("environment", "algorithm")}
        save(folder, self.lesson, arrays, steps=steps, curve=self.curve, result=plain)


def _judged(lesson: Lesson, policy: Policy, purpose: int, *, number: int, episodes: int) -> float:
    """Mean return of greedy episodes, one in each of so many worlds."""
    worlds = worlds_of(lesson, num_envs=episodes, purpose=purpose, number=number)
    try:
        return float(play(worlds, policy).mean())
    finally:
        worlds.close()


def _copy(policy: Policy) -> dict[str, NDArray[Any]]:
    return {name: array.copy() for name, array in policy.arrays.items()}
