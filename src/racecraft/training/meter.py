"""What a training's clock and curves show: seconds, pace, the last episodes, and what is left to do."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Iterable
from typing import Final

import numpy as np
from numpy.typing import NDArray

from racecraft.learn import IterationStats
from racecraft.run import Episode
from racecraft.training.progress import IterationReport, Lesson
from racecraft.training.stop import Until

RECENT: Final = 100  # episodes that the curves average over
PACE: Final = 20  # iterations that steps per second are averaged over
PARTS: Final = ("start", "simulator", "reward", "log", "policy", "learner", "evaluation", "checkpoint")


class _Pace:
    """Steps per second over the last iterations."""

    def __init__(self) -> None:
        self._points: deque[tuple[float, int]] = deque(maxlen=PACE)  # s, steps

    def begin(self, steps: int) -> None:
        """Count from here on."""
        self._points.clear()
        self._points.append((time.monotonic(), steps))

    def add(self, steps: int) -> float:
        """Steps per second, now that there were so many; NaN where nothing was counted before."""
        self._points.append((time.monotonic(), steps))
        (then, steps_then), (now, _) = self._points[0], self._points[-1]
        return (steps - steps_then) / (now - then) if now > then else float("nan")


class Meter:
    """Follows a training.

    Args:
        until: Its limits.
        started: When it began, in `time.monotonic()` seconds.
    """

    def __init__(self, until: Until, *, started: float) -> None:
        self.until = until
        self.started = started
        self.seconds_before = 0.0
        """Wall clock of the run before it was resumed."""
        self.parts = dict.fromkeys(PARTS, 0.0)
        """Seconds by part."""
        self._recent: deque[tuple[float, float]] = deque(maxlen=RECENT)  # reward, progress
        self._pace = _Pace()  # of camera steps
        self._lesson_pace = _Pace()  # of a teacher's

    @property
    def seconds(self) -> float:
        """Wall clock of the run so far."""
        return self.seconds_before + time.monotonic() - self.started

    @property
    def mean_reward(self) -> float:
        """Of the last episodes; NaN before the first."""
        return float(np.mean([reward for reward, _ in self._recent])) if self._recent else float("nan")

    @property
    def completion(self) -> float:
        """Mean fraction of a lap in the last episodes; NaN before the first."""
        shares = [min(max(progress, 0.0), 1.0) for _, progress in self._recent]
        return float(np.mean(shares)) if shares else float("nan")

    def begin(self, *, steps: int) -> None:
        """Training begins now, at so many camera steps."""
        self.parts["start"] = time.monotonic() - self.started
        self._pace.begin(steps)

    def add(self, episodes: Iterable[Episode]) -> None:
        """Count episodes of training."""
        self._recent.extend((episode.reward, episode.progress) for episode in episodes)

    def report(self, stats: IterationStats, *, episodes: int, taught: tuple[int, int] | None = None) -> IterationReport:
        """The figures after an iteration.

        Args:
            stats: What it did.
            episodes: Of the run, that have ended.
            taught: Where the iteration was a teacher's, its steps so far, and how many it is to have.
        """
        steps, lesson = stats.total_steps, None
        if taught is None:
            pace = self._pace.add(steps)
        else:
            lesson = Lesson(steps=taught[0], needed=taught[1], steps_per_second=self._lesson_pace.add(taught[0]))
            self._pace.begin(steps)  # what the student takes for its steps begins after it
            pace = 0.0
        left = []
        if self.until.seconds:
            left.append(self.until.seconds - self.seconds)
        if self.until.steps and pace > 0:
            left.append((self.until.steps - steps) / pace)
        return IterationReport(
            stats=stats,
            seconds=self.seconds,
            steps_per_second=pace,
            episodes=episodes,
            mean_reward=self.mean_reward,
            completion=self.completion,
            remaining=max(0.0, min(left)) if left else None,
            lesson=lesson,
        )

    def state(self) -> NDArray[np.float64]:
        """The last episodes, for a resumed run: reward and progress of each  (E, 2)."""
        return np.array(self._recent, np.float64).reshape(-1, 2)

    def load_state(self, recent: NDArray[np.float64], *, seconds: float) -> None:
        """Continue from what `state` gave, after so many seconds."""
        self._recent.extend((reward, progress) for reward, progress in recent.tolist())
        self.seconds_before = seconds
