"""Environments with AWS's sensors, and with objects on the track."""

from __future__ import annotations

import dataclasses

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import racecraft.env  # noqa: F401 (registers the environments)
from racecraft.agent import LidarConfig, camera_of, observation_shape
from racecraft.errors import ConfigError
from racecraft.sim import Bots, CameraSpec, Objects, Obstacles, Randomization, Simulation, Start

OBJECTS = Objects(obstacles=Obstacles(count=2, placement="random"), bots=Bots(count=1, speed=0.5))
SENSORS = [
    ("FRONT_FACING_CAMERA",),
    ("observation", "LIDAR"),
    ("LEFT_CAMERA", "SECTOR_LIDAR"),
    ("STEREO_CAMERAS", "DISCRETIZED_SECTOR_LIDAR"),
]


@pytest.mark.parametrize("sensors", SENSORS, ids="+".join)
def test_every_sensor_has_its_shape_and_the_environment_is_sound(sensors):
    env = gymnasium.make("Racecraft-v0", track="oval", sensors=sensors, objects=OBJECTS, max_episode_steps=30)
    check_env(env.unwrapped, skip_render_check=True)
    observation, _ = env.reset(seed=3)
    assert {name: array.shape for name, array in observation.items()} == {
        name: observation_shape(name) for name in sensors
    }
    env.close()


def test_a_batch_sees_what_each_car_would_alone():
    sensors, lidar = ("STEREO_CAMERAS", "DISCRETIZED_SECTOR_LIDAR"), LidarConfig(16, 4, 3.0)
    settings = {"track": "oval", "sensors": sensors, "lidar": lidar, "objects": OBJECTS}
    envs = gymnasium.make_vec("Racecraft-v0", num_envs=3, **settings)
    env = gymnasium.make("Racecraft-v0", **settings)
    seen, _ = envs.reset(seed=5)
    alone, _ = env.reset(seed=6)
    actions = np.array([3, 7, 1])
    for _ in range(5):
        for name in sensors:
            np.testing.assert_array_equal(seen[name][1], alone[name])
        seen, *_ = envs.step(actions)
        alone, *_ = env.step(actions[1])
    envs.close()
    env.close()


def test_the_stereo_pair_is_two_cameras_beside_each_other():
    settings = {"objects": OBJECTS, "start": Start(mode="fixed")}
    stereo = Simulation(_oval(), num_envs=2, camera=camera_of(["STEREO_CAMERAS"]), **settings)
    left = Simulation(_oval(), num_envs=2, camera=camera_of(["LEFT_CAMERA"]), **settings)
    right = Simulation(_oval(), num_envs=2, camera=CameraSpec(left=-0.03), **settings)
    assert stereo.frames.shape == (2, 2, 120, 160)
    for _ in range(4):
        for simulation in (stereo, left, right):
            simulation.step(np.tile(np.float32([0.1, 2.0]), (2, 1)))
        np.testing.assert_array_equal(stereo.frames[:, 0], left.frames)
        np.testing.assert_array_equal(stereo.frames[:, 1], right.frames)
    assert (left.frames != right.frames).mean() > 0.02


def test_both_lenses_of_a_pair_have_the_pose_that_was_drawn():
    """One bracket holds both: what is drawn for an episode moves them together."""
    ranges = Randomization(camera_pitch=(0.05, 0.05), camera_left=(0.02, 0.02), camera_fov=(-0.1, -0.1))
    settings = {"objects": OBJECTS, "start": Start(mode="fixed")}
    pair = Simulation(_oval(), num_envs=2, camera=camera_of(["STEREO_CAMERAS"]), randomize=ranges, **settings)

    def sum_of(first: float, second: float) -> float:
        return float(np.float32(first) + np.float32(second))  # as the core adds

    plain = CameraSpec()
    moved = CameraSpec(pitch=sum_of(plain.pitch, 0.05), horizontal_fov=sum_of(plain.horizontal_fov, -0.1))
    lenses = [
        Simulation(_oval(), num_envs=2, camera=dataclasses.replace(moved, left=sum_of(side, 0.02)), **settings)
        for side in (0.03, -0.03)
    ]
    for _ in range(4):
        for simulation in (pair, *lenses):
            simulation.step(np.tile(np.float32([0.1, 2.0]), (2, 1)))
    for lens, alone in enumerate(lenses):
        np.testing.assert_array_equal(pair.frames[:, lens], alone.frames)


def test_the_state_of_a_world_with_objects_lies_in_its_space():
    env = gymnasium.make("Racecraft-v0", track="oval", observation="state", objects=OBJECTS)
    assert env.observation_space.shape == (22,)
    observation, _ = env.reset(seed=1)
    for _ in range(30):
        assert observation in env.observation_space
        observation, _, terminated, *_ = env.step(4)
        if terminated:
            observation, _ = env.reset()
    env.close()


def test_rewards_know_of_objects():
    def reward(params):
        return float(len(params["objects_location"]))

    for function in (reward, "def reward_function(params):\n    return float(len(params['objects_location']))\n"):
        env = gymnasium.make("Racecraft-v0", track="oval", observation="state", objects=OBJECTS, reward=function)
        env.reset(seed=1)
        assert env.step(0)[1] == 3.0
        env.close()


def test_what_cannot_be_is_refused():
    with pytest.raises(ConfigError, match="exactly one of"):
        gymnasium.make("Racecraft-v0", sensors=("LIDAR",))
    with pytest.raises(ConfigError, match="objects is 6"):
        gymnasium.make("Racecraft-v0", objects=6)
    with pytest.raises(ConfigError, match="baseline is -1"):
        CameraSpec(baseline=-1)


@pytest.mark.parametrize(
    ("sizes", "words"),
    [
        ({"num_sectors": 7}, "num_sectors is 7; allowed is a divisor of 64"),
        ({"num_sectors": 0}, "num_sectors is 0"),
        ({"num_sectors": 8.0}, "num_sectors is 8.0"),
        ({"num_values_per_sector": 0}, "num_values_per_sector is 0"),
        ({"num_values_per_sector": 65}, "num_values_per_sector is 65"),
        ({"num_values_per_sector": 8.0}, "num_values_per_sector is 8.0"),
        ({"clipping_dist": 0}, "clipping_dist is 0"),
        ({"clipping_dist": 0.15}, "clipping_dist is 0.15; allowed is a number above 0.15"),
        ({"clipping_dist": 12.5}, "clipping_dist is 12.5"),
        ({"clipping_dist": "2"}, "clipping_dist is '2'"),
        ({"clipping_dist": float("nan")}, "clipping_dist is nan"),
    ],
)
def test_sizes_that_no_lidar_has_are_refused(sizes, words):
    with pytest.raises(ConfigError, match=words):
        LidarConfig(**sizes)


def _oval():
    from racecraft.track import load_track

    return load_track("oval")
