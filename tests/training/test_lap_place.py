"""Where on the lap a car is, as the critic of a race is told."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from tiny_runs import Train, weights

from racecraft.agent import ModelMetadata, action_space
from racecraft.errors import ConfigError
from racecraft.run import RunFolder
from racecraft.sim.columns import state_width
from racecraft.training.environment import TrainingEnvironment
from racecraft.training.job import Training
from racecraft.training.lap_place import LAP_COLUMNS, lap_place
from racecraft.training.opponents import Opponents
from racecraft.training.settings import TrainSettings, make_settings

METADATA = replace(ModelMetadata(neural_network="RACECRAFT_SMALL"), action_space=action_space("continuous"))


def test_it_is_round_smooth_and_of_one_place_alone() -> None:
    length = 30.0
    at = np.linspace(0.0, length, 301)
    columns = lap_place(at, np.full(301, length))
    assert columns.shape == (301, LAP_COLUMNS)
    assert columns.dtype == np.float32
    assert np.abs(columns).max() <= 1.0
    np.testing.assert_allclose(columns[0], columns[-1], atol=1e-6)  # both sides of the line
    np.testing.assert_allclose(columns[0], [0, 0, 0, 1, 1, 1], atol=1e-6)
    steps = [np.linalg.norm(b - a) for a, b in pairwise(columns)]
    assert max(steps) < 1.01 * min(steps)  # everywhere as fine
    apart = np.linalg.norm(columns[:-1, None] - columns[None, :-1], axis=2)
    assert (apart + 9.0 * np.eye(300)).min() == pytest.approx(min(steps), rel=0.01)
    np.testing.assert_allclose(lap_place(at / 3, np.full(301, length / 3)), columns, atol=1e-6)  # a share of the lap


def test_a_training_against_itself_is_told(tiny: Train) -> None:
    seen: list[np.ndarray] = []
    observe = TrainingEnvironment.observe

    def listen(environment):
        frames, state = observe(environment)
        simulation, own = environment.simulation, environment.opponents.own
        share = simulation.column("projection_distance")[own] / simulation.driven_track(0).length
        np.testing.assert_allclose(state[:, -LAP_COLUMNS], np.sin(2 * np.pi * share), atol=1e-6)
        np.testing.assert_array_equal(state[:, :-LAP_COLUMNS], simulation.state[own])
        seen.append(state)
        return frames, state

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(TrainingEnvironment, "observe", listen)
        result = tiny(name="duel", opponents=Opponents(), until="128 steps", evaluate_every=128)
    assert {state.shape[1] for state in seen} == {state_width(1) + LAP_COLUMNS}
    critic = weights(result.run)["weights/critic.dense1.weight"]
    assert state_width(1) + LAP_COLUMNS in critic.shape
    assert Training(RunFolder.open(result.run)).settings.critic == "lap"


@pytest.mark.parametrize(
    ("settings", "critic"),
    [
        ({}, "privileged"),
        ({"opponents": Opponents()}, "lap"),
        ({"opponents": Opponents(), "critic": "camera"}, "camera"),
        ({"opponents": Opponents(), "critic": "privileged"}, "privileged"),
        ({"opponents": Opponents(), "track": ["oval", "speedway"]}, "privileged"),  # a place on which of them?
        ({"critic": "lap"}, "lap"),
    ],
)
def test_against_others_on_one_track_it_is_the_default(settings, critic) -> None:
    assert make_settings(metadata=METADATA, **settings).critic == critic


@pytest.mark.parametrize(("name", "value"), [("algorithm", "sac"), ("device", "cuda")])
def test_who_did_not_ask_for_it_is_not_told_of_it(name, value) -> None:
    with pytest.raises(ConfigError, match=f"^{name} is '{value}'"):
        make_settings(metadata=METADATA, opponents=Opponents(), **{name: value})


@pytest.mark.parametrize("settings", [{"algorithm": "sac"}, {"algorithm": "distill"}, {"device": "cuda"}])
def test_who_cannot_be_told_says_so(settings) -> None:
    with pytest.raises(ConfigError, match=r"critic is 'lap', which is for algorithm 'ppo' on device 'cpu'"):
        TrainSettings(critic="lap", **settings)
