"""Where on the lap a car is, as the critic of a race and the teacher of a long road are told."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from tiny_runs import Train, weights

from racecraft.agent import ModelMetadata, action_space
from racecraft.errors import ConfigError
from racecraft.learn import DistillConfig
from racecraft.run import RunFolder
from racecraft.sim import Simulation
from racecraft.sim.columns import state_width
from racecraft.track import load_track
from racecraft.training.environment import TrainingEnvironment
from racecraft.training.job import Training
from racecraft.training.lap_view import CRITICS_VIEW, TEACHERS_VIEW, LapTeller, LapView, lap_place
from racecraft.training.opponents import Opponents
from racecraft.training.settings import TrainSettings, make_settings

LAP_COLUMNS = CRITICS_VIEW.size
METADATA = replace(ModelMetadata(neural_network="RACECRAFT_SMALL"), action_space=action_space("continuous"))


def test_it_is_round_smooth_and_of_one_place_alone() -> None:
    length = 30.0
    at = np.linspace(0.0, length, 301)
    columns = lap_place(at, np.full(301, length), num_harmonics=3)
    assert columns.shape == (301, 6)
    assert columns.dtype == np.float32
    assert np.abs(columns).max() <= 1.0
    np.testing.assert_allclose(columns[0], columns[-1], atol=1e-6)  # both sides of the line
    np.testing.assert_allclose(columns[0], [0, 0, 0, 1, 1, 1], atol=1e-6)
    steps = [np.linalg.norm(b - a) for a, b in pairwise(columns)]
    assert max(steps) < 1.01 * min(steps)  # everywhere as fine
    apart = np.linalg.norm(columns[:-1, None] - columns[None, :-1], axis=2)
    assert (apart + 9.0 * np.eye(300)).min() == pytest.approx(min(steps), rel=0.01)
    np.testing.assert_allclose(
        lap_place(at / 3, np.full(301, length / 3), num_harmonics=3), columns, atol=1e-6
    )  # a share of the lap


@pytest.mark.parametrize("direction", ["forward", "reverse"])
def test_the_road_ahead_is_the_one_that_comes(direction: str) -> None:
    tracks = [load_track(name) for name in ("oval", "kidney")]
    simulation = Simulation(tracks, num_envs=2, camera=None, direction=direction)
    tell = LapTeller(LapView(num_harmonics=1, ahead=(0.0, 2.5)), simulation)
    for car, track in enumerate(tracks):
        driven = track if direction == "forward" else track.reversed()
        for at in (1.0, 0.6 * track.length, track.length - 1.0):  # the last one looks across the line
            simulation.place(car, at)
            simulation.step([[0.0, 1.0]] * 2)
            told, here = tell()[car], simulation.column("projection_distance")[car]
            angle = 2.0 * np.pi * here / track.length
            curvatures = driven.curvature_at(here + np.array([0.0, 2.5]))
            np.testing.assert_allclose(told[:2], [np.sin(angle), np.cos(angle)], atol=1e-6)
            np.testing.assert_allclose(told[2:], curvatures, atol=0.05)  # within half a table's spacing of it
    assert LapTeller(CRITICS_VIEW, simulation)().shape == (2, CRITICS_VIEW.size)


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


@pytest.mark.costly
def test_the_teacher_of_a_long_road_and_the_critic_it_hands_on_are_told(tiny: Train) -> None:
    seen: list[tuple[bool, np.ndarray]] = []
    tell_state = TrainingEnvironment.tell_state

    def listen(environment):
        state = tell_state(environment)
        assert np.isfinite(state).all()
        seen.append((environment.simulation.frames.size == 0, state))
        return state

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(TrainingEnvironment, "tell_state", listen)
        result = tiny(
            name="long",
            actions="continuous",
            track="grand_circuit",
            algorithm="distill",
            distill=DistillConfig(num_envs=2, num_steps=8, teacher_steps=4096, student_steps=32, buffer_size=64),
            until="96 steps",
        )
    assert {(is_teacher, state.shape[1]) for is_teacher, state in seen} == {
        (is_teacher, state_width(0) + TEACHERS_VIEW.size) for is_teacher in (True, False)
    }
    assert state_width(0) + TEACHERS_VIEW.size in weights(result.run)["weights/critic.dense1.weight"].shape


@pytest.mark.parametrize(
    ("settings", "critic"),
    [
        ({}, "privileged"),
        ({"opponents": Opponents()}, "lap"),
        ({"opponents": Opponents(), "critic": "camera"}, "camera"),
        ({"opponents": Opponents(), "critic": "privileged"}, "privileged"),
        ({"opponents": Opponents(), "track": ["oval", "speedway"]}, "privileged"),  # a place on which of them?
        ({"critic": "lap"}, "lap"),
        ({"algorithm": "distill", "track": "grand_circuit"}, "lap"),
        ({"algorithm": "distill", "track": "grand_circuit", "critic": "camera"}, "camera"),
        ({"algorithm": "distill", "track": "oval"}, "privileged"),
    ],
)
def test_against_others_on_one_track_it_is_the_default(settings, critic) -> None:
    assert make_settings(metadata=METADATA, **settings).critic == critic


@pytest.mark.parametrize(("name", "value"), [("algorithm", "sac"), ("device", "cuda")])
def test_who_did_not_ask_for_it_is_not_told_of_it(name, value) -> None:
    with pytest.raises(ConfigError, match=f"^{name} is '{value}'"):
        make_settings(metadata=METADATA, opponents=Opponents(), **{name: value})


@pytest.mark.parametrize("settings", [{"algorithm": "sac"}, {"algorithm": "sb3:ppo"}, {"device": "cuda"}])
def test_who_cannot_be_told_says_so(settings) -> None:
    with pytest.raises(
        ConfigError, match=r"critic is 'lap', which is for algorithm 'ppo' or 'distill' on device 'cpu'"
    ):
        TrainSettings(critic="lap", **settings)
