"""A film of one greedy episode, drawn by the environment itself."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

import gymnasium
import numpy as np
from numpy.typing import NDArray

from racecraft.classic.job import WATCH, worlds_of
from racecraft.classic.policy import Policy
from racecraft.classic.saved import Lesson
from racecraft.errors import ConfigError
from racecraft.extras import not_installed
from racecraft.film.encoding import write_video

MAX_SECONDS: Final = 120
RATES: Final = (4, 60)
"""Frames per second that are kept; others are brought within."""
QUALITY: Final = 20
"""x264's constant rate factor."""


def film_learned(lesson: Lesson, policy: Policy, path: str | Path) -> Path:
    """Write a film of the policy in a world it has not seen.

    Args:
        lesson: What was learned from what.
        policy: What came of it.
        path: Where to, ending in ``.mp4``.

    Raises:
        ConfigError: The environment draws no pictures, or what it draws with is not installed.
        RunError: The file cannot be written.
    """
    path = Path(path)
    if path.suffix.lower() != ".mp4":
        raise ConfigError(f"Cannot write a film to {path.name!r}; the name must end in .mp4.")
    worlds = worlds_of(lesson, num_envs=1, purpose=WATCH, render_mode="rgb_array")
    rate = min(max(int(worlds.render_fps), RATES[0]), RATES[1])

    def pictures() -> Iterator[NDArray[np.uint8]]:
        yield picture(worlds.render(), lesson.environment)
        for _ in range(MAX_SECONDS * rate):
            step = worlds.step(policy.act(worlds.observations))
            if step.over[0]:
                break
            yield picture(worlds.render(), lesson.environment)

    try:
        write_video(pictures(), path, rate=rate, quality=QUALITY)
    except gymnasium.error.DependencyNotInstalled as error:
        raise not_installed("pygame", f"A film of {lesson.environment}") or error from error
    finally:
        worlds.close()
    return path


def picture(drawn: Any, environment: str) -> NDArray[np.uint8]:
    """What an environment drew, with sides that H.264 can hold: even ones.

    Raises:
        ConfigError: It drew nothing.
    """
    if not isinstance(drawn, np.ndarray) or drawn.ndim != 3 or drawn.shape[2] != 3 or min(drawn.shape[:2]) < 2:
        raise ConfigError(f"{environment} draws no pictures, so there is nothing to watch.")
    height, width = drawn.shape[0] // 2 * 2, drawn.shape[1] // 2 * 2
    return np.ascontiguousarray(drawn[:height, :width], np.uint8)
