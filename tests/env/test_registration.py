"""Ids in Gymnasium's registry, and the datasheet against what the environment really is."""

from __future__ import annotations

import inspect
import subprocess
import sys

import gymnasium
import numpy as np
import pytest
from gymnasium.vector import AsyncVectorEnv, SyncVectorEnv

from racecraft import _native
from racecraft.agent import PRESETS, DiscreteActionSpace, action_space
from racecraft.env import ENV_ID, STATE_BOUNDS, RacecraftEnv, RacecraftVectorEnv, register_environments
from racecraft.env.task import DrivingTask, TaskSettings
from racecraft.race import Autopilot
from racecraft.sim import STATUS_NAMES, CameraSpec
from racecraft.sim.simulation import MAX_STEERING

DATASHEET = inspect.getdoc(RacecraftEnv) or ""
SETTINGS = {"track": "oval", "observation": "state"}


def test_make_knows_the_id():
    env = gymnasium.make(ENV_ID, **SETTINGS)
    assert isinstance(env.unwrapped, RacecraftEnv)
    env.close()


def test_make_vec_takes_the_native_batch_by_itself():
    for mode in (None, "vector_entry_point"):
        envs = gymnasium.make_vec(ENV_ID, num_envs=3, vectorization_mode=mode, **SETTINGS)
        assert isinstance(envs, RacecraftVectorEnv)
        assert envs.num_envs == 3
        envs.close()


@pytest.mark.costly
def test_make_vec_can_still_wrap_single_environments():
    for mode, kind in (("sync", SyncVectorEnv), ("async", AsyncVectorEnv)):
        envs = gymnasium.make_vec(ENV_ID, num_envs=2, vectorization_mode=mode, **SETTINGS)
        assert isinstance(envs, kind)
        envs.reset(seed=0)
        assert envs.step(envs.action_space.sample())[0].shape == (2, 16)
        envs.close()


def test_make_limits_the_steps_of_both():
    env = gymnasium.make(ENV_ID, max_episode_steps=2, **SETTINGS)
    env.reset(seed=0)
    assert [env.step(5)[3] for _ in range(2)] == [False, True]
    env.close()
    envs = gymnasium.make_vec(ENV_ID, num_envs=1, max_episode_steps=2, **SETTINGS)
    envs.reset(seed=0)
    assert [bool(envs.step(np.array([5]))[3][0]) for _ in range(2)] == [False, True]
    envs.close()


@pytest.mark.costly
def test_episodes_are_as_long_as_the_spec_says():
    default = inspect.signature(DrivingTask).parameters["max_episode_steps"].default
    assert gymnasium.spec(ENV_ID).max_episode_steps == default
    settings = {**SETTINGS, "action_space": "continuous", "start": "fixed", "laps": 1000, "reward": lambda params: 1.0}
    env = gymnasium.make(ENV_ID, max_episode_steps=default + 50, **settings)
    driver, is_over, length = Autopilot(), False, 0
    state, _ = env.reset(seed=0)
    while not is_over:
        ((steering, speed),) = driver(state[None])
        state, _, terminated, truncated, _ = env.step(np.float32([steering / MAX_STEERING, (speed - 2.25) / 1.75]))
        is_over, length = terminated or truncated, length + 1
    assert truncated
    assert length == env.spec.max_episode_steps == default + 50
    env.close()


def test_make_knows_the_pictures_that_there_are():
    with pytest.warns(UserWarning, match="HumanRendering"):
        env = gymnasium.make(ENV_ID, render_mode="human", **SETTINGS)
    assert env.unwrapped.render_mode == "rgb_array"
    env.unwrapped.close()


def test_registering_again_does_nothing():
    spec = gymnasium.spec(ENV_ID)
    register_environments()
    assert gymnasium.spec(ENV_ID) is spec
    assert gymnasium.spec(ENV_ID).to_json()


@pytest.mark.costly
@pytest.mark.parametrize("module", ["racecraft", "racecraft.env"])
def test_an_id_can_name_the_module_to_import(module):
    code = (
        f"import gymnasium; env = gymnasium.make('{module}:Racecraft-v0', track='oval', observation='state');"
        "env.reset(seed=0); env.close()"
    )
    subprocess.run([sys.executable, "-W", "error", "-c", code], check=True, timeout=300)


def table(heading, *, first="Num"):
    """Rows of the first table below a heading of the datasheet whose head begins with a word."""
    section = DATASHEET.split(f"## {heading}\n")[1].split("\n## ")[0]
    lines = section.split(f"| {first}")[1].splitlines()[2:]
    rows = []
    for line in lines:
        if not line.startswith("|"):
            break
        rows.append([cell.strip().strip("`") for cell in line.strip("|").split("|")])
    return rows


def test_the_datasheet_has_every_section_in_gymnasiums_order():
    headings = [line[3:] for line in DATASHEET.splitlines() if line.startswith("## ")]
    assert headings == [
        "Description",
        "Action Space",
        "Observation Space",
        "Rewards",
        "Info",
        "Starting State",
        "Episode End",
        "Arguments",
        "Version History",
    ]
    assert ENV_ID.endswith(DATASHEET.split("## Version History")[1].split()[1].rstrip(":"))


def test_the_datasheets_state_is_the_real_one():
    with RacecraftEnv(**SETTINGS) as env:
        space = env.observation_space
    rows = table("Observation Space")
    assert [int(row[0]) for row in rows] == list(range(space.shape[0]))
    assert tuple(row[1] for row in rows) == tuple(STATE_BOUNDS) == tuple(_native.STATE_COLUMNS)
    assert [float(row[2]) for row in rows] == space.low.tolist()
    assert [float(row[3]) for row in rows] == space.high.tolist()


def test_the_datasheets_camera_is_the_real_one():
    with RacecraftEnv("oval") as env:
        assert f"`{env.observation_space}`" in DATASHEET
    with RacecraftEnv("oval", observation="both") as env:
        assert set(env.observation_space) == {"camera", "state"}


def test_the_datasheets_actions_are_the_real_ones():
    rows = table("Action Space", first="Preset")
    discrete = {name for name in PRESETS if isinstance(action_space(name), DiscreteActionSpace)}
    assert {row[0] for row in rows} == discrete
    for name, count, steering, speed in rows:
        commands = action_space(name).to_degrees()
        angles = [float(angle) for angle in steering.split(",")]
        speeds = [float(value) for value in speed.split(",")]
        assert int(count) == len(commands)
        for index, command in enumerate(commands):
            expected = angles[index // len(speeds)], speeds[index % len(speeds)]
            assert command == pytest.approx(expected, abs=1e-4)

    continuous = action_space("continuous")
    assert f"`{continuous.space}`" in DATASHEET
    (_, _, right, left), (_, _, slow, fast) = table("Action Space")
    assert [float(right.split("°")[0]), float(left.split("°")[0])] == pytest.approx(
        np.degrees([continuous.low[0], continuous.high[0]])
    )
    assert [float(slow.split()[0]), float(fast.split()[0])] == [continuous.low[1], continuous.high[1]]


def test_the_datasheets_arguments_are_the_real_ones():
    rows = table("Arguments", first="Argument")
    own = inspect.signature(RacecraftEnv.__init__).parameters
    shared = inspect.signature(DrivingTask.__init__).parameters
    assert [row[0] for row in rows] == ["track", *TaskSettings.__annotations__, "opponents"]
    for name, default, _ in rows:
        real = (own if name in ("track", "opponents") else shared)[name].default
        assert default == ("CameraSpec()" if real == CameraSpec() else str(real))


def test_the_datasheets_endings_are_statuses():
    section = DATASHEET.split("## Episode End\n")[1].split("\n## ")[0]
    named = [line.split("`")[1] for line in section.split("Truncation")[0].splitlines() if line[:1].isdigit()]
    assert set(named) <= set(STATUS_NAMES)
    assert named[0] == "lap_complete"
