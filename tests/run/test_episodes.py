"""From steps of many cars to a sequence of episodes on one clock."""

from __future__ import annotations

import numpy as np
import pytest

from racecraft.run import EpisodeCounter
from racecraft.sim.columns import ROW_COLUMNS, STATUS_NAMES

DT = 1 / 15


def rows_of(*, steps: list[int], status: str = "off_track", progress: float = 0.25) -> np.ndarray:
    """Judged rows, a car each, after so many steps."""
    rows = np.zeros((len(steps), len(ROW_COLUMNS)))
    values = {"steps": steps, "time": np.array(steps) * DT, "progress": progress, "status": STATUS_NAMES.index(status)}
    for name, value in values.items():
        rows[:, ROW_COLUMNS.index(name)] = value
    return rows


def test_an_episode_has_its_cars_last_row_and_the_sum_of_its_rewards() -> None:
    counter = EpisodeCounter(2)
    assert counter.update(rows_of(steps=[7, 9]), [1.0, 10.0], np.array([False, False])) == []
    (episode,) = counter.update(rows_of(steps=[8, 10]), [2.0, 20.0], np.array([True, False]))
    assert (episode.number, episode.env, episode.steps, episode.reward) == (0, 0, 8, 3.0)
    assert (episode.progress, episode.status, episode.duration) == (0.25, "off_track", 8 * DT)
    both = counter.update(rows_of(steps=[2, 11]), [5.0, 30.0], np.array([True, True]))
    assert [(episode.number, episode.env, episode.reward) for episode in both] == [(1, 0, 5.0), (2, 1, 60.0)]
    assert counter.rewards.tolist() == [0.0, 0.0]


def test_episodes_follow_each_other_on_one_clock_a_step_apart() -> None:
    """As a single car would have driven them: the step between is the one that puts it at its new start."""
    counter = EpisodeCounter(2, number=40, clock=100.0)
    first, second = counter.update(rows_of(steps=[30, 15]), [0.0, 0.0], np.array([True, True]))
    assert (first.number, first.start_time, first.end_time) == (40, 100.0, 102.0)
    assert (second.number, second.start_time) == (41, 102.0 + DT)
    assert second.end_time == pytest.approx(103.0 + DT)
    assert counter.place(3.0) == pytest.approx(103.0 + 2 * DT)
    assert counter.clock == pytest.approx(106.0 + 3 * DT)
    assert counter.number == 42


def test_a_fresh_run_counts_from_nothing() -> None:
    (episode,) = EpisodeCounter(1).update(rows_of(steps=[15]), [1.0], np.array([True]))
    assert (episode.number, episode.start_time, episode.end_time) == (0, 0.0, 1.0)


def test_what_is_abandoned_is_not_counted() -> None:
    counter = EpisodeCounter(2)
    counter.update(rows_of(steps=[5, 5]), [1.0, 1.0], np.array([False, False]))
    counter.abandon(np.array([True, False]))
    ended = counter.update(rows_of(steps=[2, 6]), [3.0, 3.0], np.array([True, True]))
    assert [(episode.number, episode.reward) for episode in ended] == [(0, 3.0), (1, 4.0)]
