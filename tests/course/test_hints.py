"""What a check says of mistakes that pupils make is so: it names the mistake, and no number that is right."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from racecraft.course import check
from racecraft.course.phrases import LANGUAGE
from racecraft.course.verdict import Verdict

Answer = Callable[..., Any]


def backup(outcomes: Any, worth: Any, gamma: float, *, weighed: bool = True) -> float:
    sums = [sum((p if weighed else 1) * (r + gamma * worth[s]) for p, s, r, _ in one) for one in outcomes.values()]
    return float(max(sums))


def leaves_the_end(
    values: Any, state: int, action: int, reward: float, after: int, over: bool, a: float, g: float
) -> None:
    if not over:
        values[state, action] += a * (reward + g * values[after].max() - values[state, action])


def stops_at_the_bound(numbers: Any, low: Any, high: Any, bins: int) -> int:
    total = 0
    for value, bottom, top in zip(numbers, low, high, strict=True):
        index = bins - 1 if value == top else int((value - bottom) / (top - bottom) * bins)
        total = total * bins + index
    return total


def advantages(rewards: Any, values: Any, after: Any, over: Any, gamma: float, lam: float, *, fade: float = 1.0) -> Any:
    found, following = np.zeros(4), 0.0
    for t in reversed(range(4)):
        following = rewards[t] + gamma * after[t] - values[t] + fade * gamma * lam * (not over[t]) * following
        found[t] = following
    return found


MISTAKES: list[tuple[str, Any, str]] = [
    ("4.bellman", lambda outcomes, worth, gamma: backup(outcomes, worth, 1.0), "counts gamma of it"),
    ("4.bellman", lambda *asked: backup(*asked, weighed=False), "weigh every outcome with its probability"),
    ("4.update", leaves_the_end, "Right while it goes on; but where the episode has ended it made 2 instead of 0"),
    (
        "5.cuts",
        {"offset": (0.0), "sin_heading_error": (0.0,), "curvature_2": ()},
        "offset is 0.0; edges stand in brackets",
    ),
    ("6.cell", stops_at_the_bound, "At [0.7, 0.007] it returned 105"),
    (
        "7.targets",
        lambda r, over, _, target, g: np.where(over, 0.0, r + g * target.max(axis=1)),
        "it made 0 of a reward of -1",
    ),
    (
        "7.targets",
        lambda r, over, _, target, g: r + g * np.where(over, 0.0, target[:, 0]),
        "It made 2.9 of step 2, and it should be 8.3",
    ),
    ("8.step", lambda preferences, *_: preferences, "The preferences are as they were"),
    ("9.advantages", advantages, "The second step ended its episode, and it made 2 of it"),
    (
        "10.gain",
        lambda r, a, clip: np.minimum(r * a, np.minimum(r, 1 + clip) * a),
        "A ratio of 0.5 with an advantage of -1 should count -0.8 and counts -0.5",
    ),
    (
        "12.ranges",
        {"friction": (-0.02, 1.1), "light": (0.6, 1.4), "latency": (0, 1), "steering_bias": (-0.1, 0.1)},
        "friction begins at -0.02",
    ),
]


@pytest.mark.parametrize(("exercise", "answer", "told"), MISTAKES)
def test_a_hint_names_the_mistake_that_was_made(exercise: str, answer: Any, told: str) -> None:
    verdict = check(exercise, answer)
    assert not verdict.is_right
    assert told in verdict.sentence


def test_a_step_that_is_wrong_is_named_where_the_last_is_right() -> None:
    verdict = check("9.advantages", lambda *asked: advantages(*asked, fade=0.5))
    assert verdict.sentence.startswith("The last step is right. Step 3 should get 1 and gets 0.75")


@pytest.mark.parametrize(
    ("reward", "german"),
    [
        (lambda params: None, "Die Belohnungsfunktion gab None zurück; auf jedem Weg"),
        (lambda params: "much", "Die Belohnungsfunktion gab den Text 'much' zurück"),
        (lambda params: float("nan"), "Die Belohnungsfunktion gab nan zurück"),
        (lambda params: params["spede"], "Meintest du 'speed'?"),
    ],
)
def test_what_is_wrong_with_a_reward_is_said_in_german(reward: Answer, german: str, monkeypatch: Any) -> None:
    monkeypatch.delenv("JPY_SESSION_NAME", raising=False)
    monkeypatch.setenv(LANGUAGE, "de")
    verdict: Verdict = check("1.inside", reward)
    assert german in str(verdict)
    assert "callable" not in str(verdict)
    assert "It was called" not in str(verdict)
