"""Exercises that check themselves: a module per lesson, whose ``CHECKS`` name its exercises.

    verdict = check("1.inside", reward_function)
    print(verdict)

A check is a function of the answer; it returns `racecraft.course.verdict.right` or `wrong` with a sentence that helps.
"""

from __future__ import annotations

import importlib
import re
import warnings
from collections.abc import Callable
from typing import Any

from racecraft.course.phrases import learner_language, said_in
from racecraft.course.progress import record_exercise
from racecraft.course.verdict import Verdict, wrong
from racecraft.errors import ConfigError, RacecraftError, RewardError, did_you_mean, printable
from racecraft.reward.params import TEMPLATE

Check = Callable[[Any], Verdict]


def check(exercise: str, answer: Any) -> Verdict:
    """Judge an answer, and remember it when it is right.

    Args:
        exercise: Lesson and name, such as ``1.inside``.
        answer: What the exercise asks for: a function, a number, settings.

    Raises:
        ConfigError: There is no such exercise.
    """
    judge = _find(exercise)
    try:
        verdict = judge(answer)
    except RewardError as error:
        what, _, called_with = str(error).partition("\n")
        return wrong(f"It cannot be tried as a reward: {what}\n{called_with}".rstrip())
    except RacecraftError as error:
        return wrong(f"It cannot be tried: {error} {error.hint}".rstrip())
    except KeyError as error:
        known = did_you_mean(str(error.args[0]), TEMPLATE) if error.args else ""
        return wrong(f"It stops with a KeyError: there is no {error}. {known}".rstrip())
    except Exception as error:  # somebody else's code
        return wrong(f"It stops with {type(error).__name__}: {printable(' '.join(str(error).split()))}.")
    if verdict.is_right:
        try:
            record_exercise(exercise)
        except (OSError, ConfigError) as error:  # a full disk or a damaged file makes no answer wrong
            told = said_in(learner_language(), f"It is right, but that cannot be kept: {error}")
            warnings.warn(told, stacklevel=2)
    return verdict


def checks_of(number: int) -> dict[str, Check]:
    """Exercises of a lesson by name, in their order; none where the lesson has none."""
    try:
        module = importlib.import_module(f"racecraft.course.exercises.lesson_{number:02d}")
    except ModuleNotFoundError:
        return {}
    checks: dict[str, Check] = module.CHECKS
    return checks


def _find(exercise: str) -> Check:
    number, _, name = str(exercise).partition(".")
    checks = checks_of(int(number)) if re.fullmatch("[1-9][0-9]?", number) else {}
    if name not in checks:
        known = [f"{number}.{other}" for other in checks]
        raise ConfigError(f"There is no exercise {printable(str(exercise))!r}.", hint=did_you_mean(exercise, known))
    return checks[name]
