"""Many cars: equal to single environments to the bit, in every autoreset mode; masks, laps, bad arguments."""

from __future__ import annotations

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import data_equivalence
from gymnasium.vector import AutoresetMode, SyncVectorEnv

from racecraft.env import RacecraftEnv, RacecraftVectorEnv
from racecraft.errors import ConfigError, ResetNeeded, RewardError, ShapeError
from racecraft.sim import Start

N = 5
SHORT = {"track": "oval", "max_episode_steps": 25, "start": Start(mode="random", lateral_jitter=0.35)}

COUNTING_REWARD = """
calls = 0

def reward_function(params):
    global calls
    calls += 1
    return float(calls)
"""


def pair(mode, **settings):
    """The batch, and single environments in Gymnasium's own vector environment, in the same mode."""
    settings = {**SHORT, **settings}
    singles = SyncVectorEnv([lambda: RacecraftEnv(**settings)] * N, autoreset_mode=mode)
    return RacecraftVectorEnv(num_envs=N, autoreset_mode=mode, num_threads=2, **settings), singles


def actions_for(envs, *, steps, seed=0):
    envs.action_space.seed(seed)
    return [envs.action_space.sample() for _ in range(steps)]


@pytest.mark.costly
@pytest.mark.parametrize("mode", list(AutoresetMode))
@pytest.mark.parametrize(
    "settings",
    [
        {"observation": "both"},
        {"observation": "state", "action_space": "continuous", "direction": "alternate", "start": "advance"},
        {"observation": "state", "reward": COUNTING_REWARD},
        {"observation": "both", "randomize": "strong"},
    ],
    ids=["both", "continuous", "stateful reward", "randomized"],
)
def test_a_batch_equals_single_environments_to_the_bit(mode, settings):
    batch, singles = pair(mode, **settings)
    assert batch.single_observation_space == singles.single_observation_space
    assert batch.observation_space == singles.observation_space
    assert batch.action_space == singles.action_space
    assert batch.metadata["autoreset_mode"] is mode

    ours, theirs = batch.reset(seed=7), singles.reset(seed=7)
    assert data_equivalence(ours, theirs, exact=True)
    num_terminated = num_truncated = 0
    for actions in actions_for(batch, steps=90):
        ours, theirs = batch.step(actions), singles.step(actions)
        assert data_equivalence(ours, theirs, exact=True)
        assert ours[0] in batch.observation_space if isinstance(ours[0], np.ndarray) else True
        done = ours[2] | ours[3]
        num_terminated, num_truncated = num_terminated + ours[2].sum(), num_truncated + ours[3].sum()
        if mode is AutoresetMode.DISABLED and done.any():
            ours = batch.reset(options={"reset_mask": done})
            theirs = singles.reset(options={"reset_mask": done})
            assert data_equivalence(ours, theirs, exact=True)
    assert num_terminated > 0
    assert num_truncated > 0
    batch.close()
    singles.close()


@pytest.mark.parametrize("num_threads", [1, 3])
def test_threads_and_batch_size_change_nothing(num_threads):
    seen = []
    for num_envs, threads in ((3, 1), (11, num_threads)):
        with_cars = RacecraftVectorEnv(num_envs=num_envs, num_threads=threads, **SHORT)
        with_cars.reset(seed=5)
        actions = np.random.default_rng(0).integers(10, size=(40, 11))
        seen.append([with_cars.step(row[:num_envs])[0][:3].copy() for row in actions])
        with_cars.close()
    assert np.array_equal(*seen)


def test_next_step_ignores_the_action_and_pays_nothing_while_it_resets():
    envs = RacecraftVectorEnv(num_envs=2, observation="state", track="oval", max_episode_steps=3)
    envs.reset(seed=0)
    for _ in range(3):
        _, _, _, truncations, _ = envs.step(np.array([5, 5]))
    assert truncations.all()
    _, rewards, terminations, truncations, infos = envs.step(np.array([0, 9]))
    assert not rewards.any()
    assert not (terminations | truncations).any()
    assert infos["status"].tolist() == ["prepare", "prepare"]
    assert infos["steps"].tolist() == [1, 1]
    envs.close()


def test_same_step_hands_over_the_last_observation():
    envs = RacecraftVectorEnv(
        num_envs=2, observation="camera", track="oval", max_episode_steps=3, autoreset_mode="SameStep"
    )
    first, _ = envs.reset(seed=0)
    for _ in range(2):
        before, _, _, _, infos = envs.step(np.array([5, 5]))
        assert "final_obs" not in infos
    observations, _, _, truncations, infos = envs.step(np.array([5, 5]))
    assert truncations.all()
    assert infos["_final_obs"].all()
    assert infos["final_info"]["steps"].tolist() == [4, 4]
    for car in range(2):
        last = infos["final_obs"][car]
        assert last in envs.single_observation_space
        assert not np.array_equal(last, before[car])  # the car moved on before it was cut off
        assert not np.array_equal(last, observations[car])
    assert not np.array_equal(first, observations)
    envs.close()


def test_disabled_refuses_to_step_a_finished_car():
    envs = RacecraftVectorEnv(
        num_envs=2, observation="state", track="oval", max_episode_steps=3, autoreset_mode="Disabled"
    )
    envs.reset(seed=0)
    for _ in range(3):
        envs.step(np.array([5, 5]))
    with pytest.raises(ResetNeeded, match=r"\[0, 1\]"):
        envs.step(np.array([5, 5]))
    with pytest.raises(ConfigError, match=r"options is 5; use a dict, such as \{'reset_mask': mask\}"):
        envs.reset(options=5)
    envs.reset(options={"reset_mask": np.array([True, False])})
    with pytest.raises(ResetNeeded, match=r"\[1\]"):
        envs.step(np.array([5, 5]))
    envs.close()


def test_a_masked_reset_leaves_the_other_cars_untouched():
    envs = RacecraftVectorEnv(num_envs=N, observation="both", track="oval")
    envs.reset(seed=0)
    for actions in actions_for(envs, steps=5):
        before = envs.step(actions)[0]
    mask = np.array([True, False, True, False, False])
    after, infos = envs.reset(seed=[9, None, None, None, 3], options={"reset_mask": mask})
    assert np.array_equal(infos["_progress"], mask)
    assert infos["status"].tolist() == ["prepare", None, "prepare", None, None]
    assert infos["episode_number"].tolist() == [0, 0, 1, 0, 0]
    for kind in ("camera", "state"):
        assert np.array_equal(after[kind][~mask], before[kind][~mask])
        assert not np.array_equal(after[kind][mask], before[kind][mask])
    with RacecraftEnv("oval", observation="state") as alone:
        assert np.array_equal(alone.reset(seed=9)[0], after["state"][0])
    envs.close()


def test_observations_without_a_copy_are_overwritten_and_with_one_are_not():
    for copy in (True, False):
        envs = RacecraftVectorEnv(num_envs=2, observation="both", track="oval", copy=copy)
        first, _ = envs.reset(seed=0)
        kept = {kind: value.copy() for kind, value in first.items()}
        for _ in range(5):
            second = envs.step(np.array([5, 5]))[0]
        for kind in ("camera", "state"):
            assert np.shares_memory(first[kind], second[kind]) is not copy
            assert np.array_equal(first[kind], kept[kind]) is copy
        envs.close()


def test_lap_times_come_with_a_mask():
    envs = RacecraftVectorEnv(
        num_envs=3,
        observation="state",
        track="oval",
        action_space="continuous",
        start="fixed",
        autoreset_mode="SameStep",
    )
    state, _ = envs.reset(seed=0)
    for _ in range(2000):
        steering = 0.3 * state[:, 9] - 0.6 * state[:, 4] - 1.5 * np.arctan2(state[:, 5], state[:, 6])
        speed = np.array([-0.5, -0.6, -0.5])
        state, _, terminations, _, infos = envs.step(np.stack([np.clip(steering, -1, 1), speed], axis=1))
        if terminations.any():
            break
    final = infos["final_info"]
    assert terminations.tolist() == final["_lap_time"].tolist() == [True, False, True]
    assert final["lap_time"].tolist() == final["time"].tolist()
    assert final["status"].tolist() == ["lap_complete", None, "lap_complete"]
    assert "lap_time" not in infos  # that belongs to the episode that ended
    envs.close()


def test_every_car_draws_its_own_conditions_and_a_seed_repeats_them():
    envs = RacecraftVectorEnv("oval", num_envs=2, start="fixed", randomize="strong")
    first, second, again = (envs.reset(seed=seed)[0] for seed in (3, None, 3))
    assert not np.array_equal(*first)
    assert not np.array_equal(first, second)
    assert np.array_equal(first, again)
    with RacecraftEnv("oval", start="fixed", randomize="strong") as env:
        assert np.array_equal(env.reset(seed=4)[0], first[1])
    envs.close()


def test_every_car_can_have_its_own_track():
    envs = RacecraftVectorEnv(["oval", "bowtie"], num_envs=4, observation="state")
    _, infos = envs.reset(seed=0)
    assert infos["track_index"].tolist() == [0, 1, 0, 1]
    assert len(set(infos["track_length"].tolist())) == 2
    envs.close()


def test_vector_wrappers_of_gymnasium_fit():
    envs = gymnasium.wrappers.vector.RecordEpisodeStatistics(
        RacecraftVectorEnv(num_envs=2, observation="state", track="oval", max_episode_steps=4)
    )
    envs.reset(seed=0)
    for _ in range(4):
        infos = envs.step(np.array([5, 5]))[4]
    assert infos["episode"]["l"].tolist() == [4, 4]
    envs.close()


def test_rendering_gives_one_picture_per_car():
    envs = RacecraftVectorEnv(num_envs=2, observation="state", track="oval", render_mode="rgb_array")
    envs.reset(seed=0)
    pictures = envs.render()
    assert [picture.shape for picture in pictures] == [(480, 640, 3)] * 2
    assert not np.array_equal(*pictures)
    envs.close()


@pytest.mark.parametrize(
    ("settings", "error", "words"),
    [
        ({"autoreset_mode": "Sometimes"}, ConfigError, "NextStep"),
        ({"num_envs": 0}, ConfigError, "num_envs"),
        ({"num_threads": -1}, ConfigError, "num_threads"),
        ({"track": []}, ConfigError, "track"),
        ({"track": 3}, ConfigError, "track is 3"),
        ({"track": ["oval", 3]}, ConfigError, "3"),
        ({"opponents": []}, ConfigError, r"with opponents=\[\]"),
        ({"seat": "leather"}, ConfigError, "with seat='leather'"),
        ({"reward": "racign"}, RewardError, "racing"),
        ({"copy": "no"}, ConfigError, "copy is 'no'; allowed are True and False"),
        ({"copy": 1}, ConfigError, "copy is 1; allowed are True and False"),
        ({"copy": None}, ConfigError, "copy is None"),
    ],
)
def test_a_bad_argument_is_named(settings, error, words):
    with pytest.raises(error, match=words):
        RacecraftVectorEnv(**{"track": "oval", "observation": "state", "num_envs": 2, **settings})


def test_bad_calls_are_refused():
    envs = RacecraftVectorEnv("oval", num_envs=2, observation="state")
    with pytest.raises(ResetNeeded, match="reset"):
        envs.step(np.array([0, 0]))
    for seed in (-1, [1], [1, 2, 3], [1, -1], [1.0, 2], "ab", 0.5):
        with pytest.raises(ConfigError, match="seed"):
            envs.reset(seed=seed)
    for mask in ([True, False], np.ones(3, bool), np.ones(2), np.zeros(2, bool)):
        with pytest.raises(ShapeError, match="reset_mask"):
            envs.reset(options={"reset_mask": mask})
    envs.reset(seed=0)
    for actions in (np.zeros(3, int), np.zeros(2), np.zeros((2, 2), int), 0):
        with pytest.raises(ShapeError, match="action"):
            envs.step(actions)
    with pytest.raises(ShapeError, match=r"actions have shape \(3,\), expected 2 rows: one per car"):
        envs.step(np.zeros(3, int))
    envs.close()


def test_a_closed_environment_says_so():
    envs = RacecraftVectorEnv("oval", num_envs=2, observation="state")
    env = RacecraftEnv("oval", observation="state")
    for one, actions in ((envs, np.zeros(2, int)), (env, 0)):
        one.reset(seed=0)
        one.close()
        with pytest.raises(ResetNeeded):
            one.step(actions)
        with pytest.raises(ResetNeeded, match="is closed"):
            one.reset()
    with pytest.raises(ResetNeeded, match="is closed"):
        envs.step(np.zeros(2, int))


def test_seeds_may_be_an_array():
    envs = RacecraftVectorEnv("oval", num_envs=3, observation="state")
    seeds = np.random.SeedSequence(1).generate_state(3)
    arrays, _ = envs.reset(seed=seeds)
    lists, _ = envs.reset(seed=seeds.tolist())
    np.testing.assert_array_equal(arrays, lists)
    np.testing.assert_array_equal(envs.reset(seed=np.array(7))[0], envs.reset(seed=7)[0])
    for wrong in (np.arange(2), np.array([1.0, 2.0, 3.0]), np.array([[1, 2, 3]]), np.array([-1, 0, 1])):
        with pytest.raises(ConfigError, match="seed"):
            envs.reset(seed=wrong)
    envs.close()
