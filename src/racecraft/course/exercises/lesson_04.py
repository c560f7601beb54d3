"""The updates of Q-learning and SARSA held against worked numbers, and Bellman's equation against a solved lake."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from racecraft.course.verdict import Verdict, right, wrong

ALPHA, GAMMA = 0.5, 0.9


def check_update(update: Callable[..., Any]) -> Verdict:
    """One step of Q-learning."""
    return _check_update(update, "the best action of the next state: values[successor].max()", of_next=3.0)


def check_sarsa(update: Callable[..., Any]) -> Verdict:
    """One step of SARSA, whose next action is not the best."""
    return _check_update(update, "the action that really comes next: values[successor, next_action]", of_next=1.0)


def _check_update(update: Callable[..., Any], future: str, *, of_next: float) -> Verdict:
    is_sarsa = of_next != 3.0
    going = _try(update, is_sarsa=is_sarsa, terminated=False)
    ending = _try(update, is_sarsa=is_sarsa, terminated=True)
    before, reward = 2.0, -2.0
    expected = before + ALPHA * (reward + GAMMA * of_next - before)
    if isinstance(going, Verdict):
        return going
    if isinstance(ending, Verdict):
        return ending
    if np.isclose(going, reward + GAMMA * of_next):
        return wrong(
            f"It made the value {going:g}, all of what the step turned out to be worth, and forgot the old {before:g}. "
            "Go only a part of the way, alpha times the surprise: luck is not to be believed at once."
        )
    if np.isclose(going, before + ALPHA * (reward + of_next - before)):
        return wrong(f"It made the value {going:g}: what comes a step later counts gamma = {GAMMA} of what comes now.")
    other = 1.0 if not is_sarsa else 3.0
    if np.isclose(going, before + ALPHA * (reward + GAMMA * other - before)):
        return wrong(f"It made the value {going:g}, with the wrong action in the next state. It takes {future}.")
    if np.isclose(going, before + ALPHA * (reward + GAMMA * of_next)):
        return wrong(f"It made the value {going:g}: the surprise is what came *less* what the table said.")
    if not np.isclose(going, expected):
        return wrong(
            f"Q was {before:g}, the reward {reward:g}, alpha {ALPHA}, gamma {GAMMA}, and the next state is worth "
            f"{of_next:g}; it made {going:g}, and it should be {expected:g}. Do it on paper once."
        )
    if not np.isclose(ending, before + ALPHA * (reward - before)):
        return wrong(
            f"Right while it goes on; but where the episode has ended it made {ending:g} instead of "
            f"{before + ALPHA * (reward - before):g}: nothing comes after the end, so its worth is 0, and the reward "
            "of the last step counts as ever."
        )
    return right("A step of the way towards what the world has answered.")


def _try(update: Callable[..., Any], *, is_sarsa: bool, terminated: bool) -> float | Verdict:
    """What an update makes of a value of 2 in a small table, or what else it did."""
    values = np.array([[7.0, 2.0], [1.0, 3.0], [5.0, 6.0]])
    before = values.copy()
    arguments = (0, 1, -2.0, 1, 0) if is_sarsa else (0, 1, -2.0, 1)
    update(values, *arguments, terminated, ALPHA, GAMMA)
    changed = np.argwhere(values != before).tolist()
    if not changed and not terminated:
        return wrong("The table is as it was: change it in place, values[state, action] = … or += …")
    if changed not in ([[0, 1]], []):
        return wrong(f"It changed cells {changed}; only values[state, action], here [0, 1], was tried and may change.")
    return float(values[0, 1])


def check_bellman(backup: Callable[..., Any]) -> Verdict:
    """One of Bellman's equations, whose only solution is the true worth of a lake's squares."""
    import gymnasium

    lake: Any = gymnasium.make("FrozenLake-v1").unwrapped
    values, table = np.zeros(16), lake.P
    for _ in range(400):
        values = np.array([float(backup(table[state], values.copy(), 0.95)) for state in range(16)])
    truth = np.zeros(16)
    for _ in range(400):
        truth = np.array([_backup(table[state], truth, 0.95) for state in range(16)])
    if not np.isfinite(values).all() or values.max() > 10.0:
        return wrong(
            f"The worth grows to {values.max():.3g}, and no square is worth more than the one reward of 1: weigh every "
            "outcome with its probability, and take the best of the actions, not the sum of all."
        )
    if np.allclose(values, truth, atol=1e-3):
        return right(f"The start is worth {values[0]:.3f}, as dynamic programming has it.")
    mean = np.zeros(16)
    for _ in range(400):
        mean = np.array([_backup(table[state], mean, 0.95, best=False) for state in range(16)])
    if np.allclose(values, mean, atol=1e-3):
        return wrong(
            f"The start is worth {values[0]:.3f}: that is the mean over the actions, what somebody who chooses by lot "
            f"would get. Whoever chooses well gets {truth[0]:.3f}: take the max."
        )
    patient = np.zeros(16)
    for _ in range(400):
        patient = np.array([_backup(table[state], patient, 1.0) for state in range(16)])
    if np.allclose(values, patient, atol=1e-3):
        return wrong(
            f"The start would be worth {values[0]:.3f}, however long the way from there is, and truly it is worth "
            f"{truth[0]:.3f}: what comes a step later counts gamma of it."
        )
    if (values > truth + 1e-3).any():
        return wrong(
            f"The start would be worth {values[0]:.3f}, more than the true {truth[0]:.3f}: every outcome counts only "
            "as often as it happens, so weigh it with its probability."
        )
    return wrong(
        f"The start would be worth {values[0]:.3f}, less than the true {truth[0]:.3f}: reward now, plus gamma times "
        "the worth of where one ends up, over all outcomes."
    )


def _backup(outcomes: Any, values: Any, gamma: float, *, best: bool = True) -> float:
    worths = [
        sum(chance * (reward + gamma * (0.0 if over else values[after])) for chance, after, reward, over in outcomes[a])
        for a in outcomes
    ]
    return float(max(worths) if best else np.mean(worths))


CHECKS = {"bellman": check_bellman, "update": check_update, "sarsa": check_sarsa}
