"""One car: Gymnasium's contract, determinism, the end of episodes, bad arguments."""

from __future__ import annotations

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env, data_equivalence

import racecraft.env  # noqa: F401 - registers the id
from racecraft.agent import ContinuousActionSpace, ModelMetadata
from racecraft.env import RacecraftEnv
from racecraft.env.info import INFO_NAMES
from racecraft.errors import ConfigError, NonFiniteAction, ResetNeeded, RewardError, ShapeError, TrackNotFound
from racecraft.sim import STATUS_NAMES, CameraSpec, Randomization, Start

STRAIGHT_AHEAD = 5  # of the default table: 0 degrees, 2 m/s


@pytest.mark.parametrize("action_space", ["default", "continuous"])
@pytest.mark.parametrize("observation", ["camera", "state", "both"])
def test_gymnasiums_checker_has_nothing_to_say(observation, action_space):
    env = gymnasium.make("Racecraft-v0", track="oval", observation=observation, action_space=action_space)
    check_env(env.unwrapped)
    env.close()


@pytest.mark.parametrize("observation", ["camera", "state", "both"])
def test_every_observation_is_inside_its_space(observation):
    with RacecraftEnv("bowtie", observation=observation, max_episode_steps=40) as env:
        env.action_space.seed(3)
        seen, _ = env.reset(seed=3)
        for _ in range(200):
            assert seen in env.observation_space
            seen, _, terminated, truncated, _ = env.step(env.action_space.sample())
            if terminated or truncated:
                seen, _ = env.reset()


def episodes(env, *, seed, steps=120):
    """Everything that an environment says, from a seed on."""
    env.action_space.seed(seed)
    said = [env.reset(seed=seed)]
    for _ in range(steps):
        said.append(env.step(env.action_space.sample()))
        if said[-1][2] or said[-1][3]:
            said.append(env.reset())
    return said


@pytest.mark.parametrize("settings", [{}, {"start": Start(mode="random", lateral_jitter=0.1)}, {"randomize": "strong"}])
def test_a_seed_repeats_every_bit_of_all_its_episodes(settings):
    with (
        RacecraftEnv("oval", observation="both", **settings) as env,
        RacecraftEnv("oval", observation="both", **settings) as other,
    ):
        first = episodes(env, seed=11)
        assert data_equivalence(first, episodes(env, seed=11), exact=True)
        assert data_equivalence(first, episodes(other, seed=11), exact=True)
        assert not data_equivalence(first, episodes(other, seed=12), exact=True)


def test_without_a_seed_the_first_reset_draws_one():
    starts = set()
    for _ in range(4):
        with RacecraftEnv("oval", observation="state") as env:
            starts.add(env.reset()[1]["projection_distance"])
    assert len(starts) == 4


def test_advance_moves_the_start_by_a_twentieth_of_a_lap():
    with RacecraftEnv("oval", observation="state", start="advance") as env:
        places = [env.reset(seed=0)[1]["projection_distance"]] + [
            env.reset()[1]["projection_distance"] for _ in range(5)
        ]
        length = env.reset()[1]["track_length"]
    assert np.diff(places) / length == pytest.approx(np.full(5, 0.05), abs=1e-3)


def test_every_episode_has_its_own_conditions(tmp_path):
    file = tmp_path / "light.json"
    file.write_text('{"light": [0.3, 1.0]}')
    for randomize in ("strong", file, str(file), Randomization(light=(0.3, 1.0))):
        with RacecraftEnv("oval", start="fixed", randomize=randomize) as env:
            pictures = [env.reset(seed=3)[0], env.reset()[0], env.reset(seed=3)[0]]
        assert not np.array_equal(pictures[0], pictures[1])
        assert np.array_equal(pictures[0], pictures[2])


def test_driving_off_terminates_and_stepping_on_is_refused():
    with RacecraftEnv("oval", observation="state", start="fixed") as env:
        with pytest.raises(ResetNeeded, match="reset"):
            env.step(STRAIGHT_AHEAD)
        env.reset(seed=0)
        for _ in range(300):
            _, reward, terminated, truncated, info = env.step(STRAIGHT_AHEAD)
            if terminated or truncated:
                break
        assert (terminated, truncated) == (True, False)
        assert info["status"] == "off_track"
        assert info["is_offtrack"] is True
        assert reward == -1.0
        with pytest.raises(ResetNeeded, match="reset"):
            env.step(STRAIGHT_AHEAD)


@pytest.mark.parametrize("limit", [1, 2, 17])
def test_max_episode_steps_truncates_after_exactly_so_many_steps(limit):
    with RacecraftEnv("oval", observation="state", max_episode_steps=limit) as env:
        env.reset(seed=0)
        ends = [env.step(STRAIGHT_AHEAD)[2:4] for _ in range(limit)]
    assert ends == [(False, False)] * (limit - 1) + [(False, True)]


def test_a_lap_ends_the_episode_with_its_time():
    """A controller on the privileged state drives the oval: steer against offset and heading error."""
    with RacecraftEnv("oval", observation="state", action_space="continuous", start="fixed", laps=2) as env:
        state, _ = env.reset(seed=0)
        lap_times = []
        for _ in range(2000):
            offset, heading_error = state[4], np.arctan2(state[5], state[6])
            curvature = state[9]
            steering = np.clip(0.3 * curvature - 0.6 * offset - 1.5 * heading_error, -1, 1)
            state, _, terminated, truncated, info = env.step(np.array([steering, -0.5], np.float32))
            if "lap_time" in info:
                lap_times.append(info["lap_time"])
            if terminated or truncated:
                break
    assert info["status"] == "lap_complete"
    assert (terminated, info["lap"]) == (True, 2)
    assert len(lap_times) == 2
    assert sum(lap_times) == pytest.approx(info["time"])
    assert lap_times[1] < lap_times[0]  # the first one starts from rest


def test_the_info_is_the_judged_row_by_name():
    with RacecraftEnv("oval", observation="state") as env:
        _, info = env.reset(seed=0)
        assert tuple(info) == INFO_NAMES
        assert info["status"] == "prepare"
        _, _, _, _, info = env.step(0)
    assert info["status"] == "in_progress"
    assert info["steps"] == 2
    assert info["steering_angle"] == pytest.approx(np.radians(-30), abs=1e-6)
    assert {type(value) for value in info.values()} == {int, bool, float, str}
    assert info["status"] in STATUS_NAMES


def test_wrappers_that_record_episodes_find_no_name_taken():
    env = gymnasium.wrappers.RecordEpisodeStatistics(
        gymnasium.make("Racecraft-v0", track="oval", observation="state", max_episode_steps=5)
    )
    env.reset(seed=0)
    infos = [env.step(STRAIGHT_AHEAD)[4] for _ in range(5)]
    env.close()
    assert infos[-1]["episode"]["l"] == 5


def test_the_camera_can_be_smaller():
    with RacecraftEnv("oval", camera=CameraSpec(width=80, height=60)) as env:
        assert env.reset(seed=0)[0].shape == env.observation_space.shape == (60, 80, 1)


def test_action_spaces_by_name_file_and_object(tmp_path):
    file = tmp_path / "model_metadata.json"
    space = ContinuousActionSpace([-0.2, 1.0], [0.2, 3.0])
    ModelMetadata(action_space=space).save(file)
    for value in (file, str(file), space):
        with RacecraftEnv("oval", observation="state", action_space=value) as env:
            env.reset(seed=0)
            info = env.step(np.array([1.0, -1.0]))[4]
        assert (info["steering_angle"], info["speed"]) == pytest.approx((0.2, 1.0), abs=1e-6)
    with RacecraftEnv("oval", observation="state", action_space="fast") as env:
        assert env.action_space.n == len(env.commands) == 21


def test_rendering_gives_a_picture_whatever_is_observed():
    for observation in ("camera", "state"):
        with RacecraftEnv("oval", observation=observation, render_mode="rgb_array") as env:
            env.reset(seed=0)
            picture = env.render()
        assert (picture.shape, picture.dtype) == ((480, 640, 3), np.uint8)
        assert picture.std() > 10  # a scene, not a blank
    with RacecraftEnv("oval", observation="state") as env:
        env.reset(seed=0)
        assert env.render() is None


@pytest.mark.parametrize(
    ("settings", "error", "words"),
    [
        ({"track": "ovall"}, TrackNotFound, "ovall"),
        ({"track": ["oval", "bowtie"]}, ConfigError, "RacecraftVectorEnv"),
        ({"track": None}, ConfigError, "track"),
        ({"observation": "video"}, ConfigError, "camera, state, both"),
        ({"action_space": "defualt"}, ConfigError, "default"),
        ({"action_space": "nowhere/model_metadata.json"}, ConfigError, "nowhere"),
        ({"start": "anywhere"}, ConfigError, "random"),
        ({"direction": "backwards"}, ConfigError, "reverse"),
        ({"vehicle": "v9"}, ConfigError, "v9"),
        ({"randomize": "storng"}, ConfigError, "strong"),
        ({"randomize": 3}, ConfigError, "randomize"),
        ({"laps": 0}, ConfigError, "laps"),
        ({"max_episode_steps": 0}, ConfigError, "max_episode_steps"),
        ({"max_episode_steps": 1.5}, ConfigError, "max_episode_steps"),
        ({"max_episode_steps": True}, ConfigError, "max_episode_steps"),
        ({"render_mode": "human"}, ConfigError, "rgb_array"),
        ({"reward": "raicng"}, RewardError, "racing"),
        ({"reward": 3}, RewardError, "3"),
        ({"reward": "def reward_function(params)\n    return 1.0"}, RewardError, "line 1"),
        ({"action_space": 3}, ConfigError, "action_space is 3"),
        ({"camera": 3}, ConfigError, "camera is 3"),
        ({"sensors": 3}, ConfigError, "sensors is 3"),
        ({"sensors": ["LIDAR", "observation"], "lidar": 3}, ConfigError, "lidar is 3"),
        ({"seat": "leather"}, ConfigError, "seat"),
        ({"observatoin": "state"}, ConfigError, "Did you mean 'observation'"),
        ({"num_envs": 2}, ConfigError, "make_vec"),
        ({"cars_per_race": 2}, ConfigError, "cars_per_race"),
    ],
)
def test_a_bad_argument_is_named(settings, error, words):
    with pytest.raises(error) as caught:
        RacecraftEnv(**{"track": "oval", "observation": "state", **settings})
    assert words in str(caught.value) + getattr(caught.value, "hint", "")


@pytest.mark.parametrize("seed", [-1, 2**64, 1.5, True, "1"])
def test_a_bad_seed_is_refused(seed):
    with RacecraftEnv("oval", observation="state") as env, pytest.raises(ConfigError, match="seed"):
        env.reset(seed=seed)


@pytest.mark.parametrize(
    ("action_space", "action", "error"),
    [
        ("default", 10, ConfigError),
        ("default", -1, ConfigError),
        ("default", 0.5, ShapeError),
        ("default", [0, 1], ShapeError),
        ("default", None, ShapeError),
        ("continuous", [np.nan, 0.0], NonFiniteAction),
        ("continuous", [0.0], ShapeError),
        ("default", [0, [1]], ShapeError),
        ("continuous", [0.0, [1.0]], ShapeError),
        ("continuous", "left", ShapeError),
        ("continuous", [0.0, "left"], ShapeError),
        ("continuous", {"steering": 1.0}, ShapeError),
        ("continuous", [1j, 0.0], ShapeError),
        ("continuous", [10**400, 0.0], ShapeError),
    ],
)
def test_a_bad_action_is_refused_and_nothing_moves(action_space, action, error):
    with RacecraftEnv("oval", observation="state", action_space=action_space) as env:
        env.reset(seed=0)
        with pytest.raises(error):
            env.step(action)
        good = 0 if action_space == "default" else [0.0, 0.0]
        assert env.step(good)[4]["steps"] == 2
