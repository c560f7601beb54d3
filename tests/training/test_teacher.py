"""A teacher's cars: no camera, the user's reward, and a finish line that is not the end of the road."""

from __future__ import annotations

from contextlib import ExitStack

import numpy as np

from racecraft.agent import action_space
from racecraft.reward import load_reward
from racecraft.sim.columns import STATE_COLUMNS, STATUS_NAMES
from racecraft.track import load_track
from racecraft.training.algorithms import teacher_environment
from racecraft.training.settings import TrainSettings

OFFSET, ERROR, AHEAD = (STATE_COLUMNS.index(name) for name in ("offset", "sin_heading_error", "curvature_1"))


def test_a_completed_lap_cuts_the_episode_and_leaving_the_road_ends_it() -> None:
    track, space = load_track("oval"), action_space("continuous")
    settings = TrainSettings(track="oval", num_threads=1)
    seen = set()
    with ExitStack() as stack:
        cars = teacher_environment(settings, load_reward("lap_time"), [track], space, stack)
        is_careful = np.arange(cars.num_envs) % 2 == 0
        total = np.zeros(cars.num_envs)
        for _ in range(400):
            frames, states = cars.observe()
            assert frames.size == 0
            steering = 0.5 * states[:, AHEAD] - 1.5 * states[:, ERROR] - 0.5 * states[:, OFFSET]
            actions = np.stack([np.where(is_careful, steering.clip(-1, 1), 1.0), np.full(len(states), -0.5)], 1)
            rewards, terminated, truncated = cars.step(actions.astype(np.float32))
            total += rewards
            for car in np.flatnonzero(terminated | truncated):
                status = STATUS_NAMES[int(cars.simulation.column("status")[car])]
                seen.add((status, bool(is_careful[car]), bool(terminated[car]), bool(truncated[car])))
                if status == "lap_complete":
                    assert 0.9 * track.length < total[car] < 1.1 * track.length
                total[car] = 0.0
            cars.reset(terminated | truncated)
    assert seen == {("lap_complete", True, False, True), ("off_track", False, True, False)}
