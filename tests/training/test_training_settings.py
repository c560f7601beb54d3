from __future__ import annotations

import json
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import pytest

from racecraft.agent import Hyperparameters, ModelMetadata, action_space
from racecraft.errors import ConfigError, RunError
from racecraft.learn import DistillConfig, PPOConfig, SACConfig
from racecraft.reward import load_preset, load_reward
from racecraft.run import RunFolder
from racecraft.sim import Bots, Objects, Obstacles, Start, Vehicle
from racecraft.training import Until, train
from racecraft.training import settings as settings_module
from racecraft.training.opponents import Opponents
from racecraft.training.plan import make_plan
from racecraft.training.regimes import (
    BRISK_FAST_DISTILL,
    DUEL,
    FAST_DISTILL,
    FAST_OBJECTS,
    LONG_FAST_DISTILL,
    MANY_TRACKS,
    OBJECTS,
    TIME_TRIAL,
    Regime,
)
from racecraft.training.settings import VEHICLE_OF_VERSION, TrainSettings, make_settings
from racecraft.training.start import aws_hyperparameters, read_settings

DISCRETE = ModelMetadata(neural_network="RACECRAFT_SMALL")
CONTINUOUS = replace(DISCRETE, action_space=action_space("continuous"))
SETTINGS = TrainSettings(
    track="oval",
    until=Until(laps=3, seconds=100.1, steps=12_345_678),
    seed=2**32 - 1,
    network="DEEP_CONVOLUTIONAL_NETWORK_SHALLOW",
    critic="camera",
    vehicle=Vehicle(mass=5.0),
    camera="2026",
    start=Start(mode="random", lateral_jitter=0.1),
    direction="alternate",
    ppo=PPOConfig(num_envs=7, learning_rate=1e-4, exploration="e-greedy"),
    evaluate_every=1000,
    evaluation_trials=4,
    num_threads=3,
)


@pytest.mark.parametrize("settings", [TrainSettings(), SETTINGS])
def test_the_round_trip_through_json_is_exact(settings: TrainSettings) -> None:
    assert TrainSettings.from_dict(json.loads(json.dumps(settings.to_dict(), allow_nan=False))) == settings


LATER = settings_module._ADDED  # runs of earlier versions lack them


@pytest.mark.parametrize("name", [field.name for field in fields(TrainSettings) if field.name not in LATER])
def test_a_missing_field_is_refused_by_name(name: str) -> None:
    document = SETTINGS.to_dict()
    del document[name]
    with pytest.raises(RunError, match=name):
        TrainSettings.from_dict(document)


@pytest.mark.parametrize("inside", [None, "vehicle", "start", "ppo"])
def test_an_unknown_field_is_refused_by_name(inside: str | None) -> None:
    document = SETTINGS.to_dict()
    (document if inside is None else document[inside])["turbo"] = 1
    with pytest.raises(RunError, match="turbo"):
        TrainSettings.from_dict(document)


@pytest.mark.parametrize("name", ["until", "vehicle", "start", "ppo"])
@pytest.mark.parametrize("value", [None, 5, "x", []])
def test_a_field_of_another_kind_is_refused(name: str, value: Any) -> None:
    with pytest.raises((RunError, ConfigError)):
        TrainSettings.from_dict({**SETTINGS.to_dict(), name: value})


def test_opponents_of_whom_nothing_is_said_are_the_usual_ones() -> None:
    usual = TrainSettings.from_dict({**TrainSettings().to_dict(), "opponents": {}})
    assert usual.opponents == Opponents()
    with pytest.raises(RunError, match="do not fit this version"):
        TrainSettings.from_dict({**TrainSettings().to_dict(), "opponents": {"drivers": None}})


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("network", "ALEXNET"),
        ("network", None),
        ("critic", "oracle"),
        ("direction", "sideways"),
        ("seed", -1),
        ("seed", 2**32),
        ("seed", 1.5),
        ("seed", True),
        ("evaluate_every", 0),
        ("evaluation_trials", 0),
        ("evaluation_trials", 101),
        ("num_threads", -1),
        ("num_threads", "2"),
    ],
)
def test_a_value_out_of_range_names_field_and_value(field: str, value: Any) -> None:
    with pytest.raises(ConfigError, match=field) as caught:
        TrainSettings(**{field: value})
    assert repr(value) in str(caught.value)
    assert "allowed" in str(caught.value)


def test_a_near_miss_is_recognised() -> None:
    with pytest.raises(ConfigError) as caught:
        TrainSettings(critic="privilege")
    assert caught.value.hint == "Did you mean 'privileged'?"


def test_more_laps_than_trials_bring_more_trials() -> None:
    assert TrainSettings(until=Until(laps=9)).evaluation_trials == 9
    assert TrainSettings(until=Until(laps=2)).evaluation_trials == 5


@pytest.mark.parametrize(
    ("algorithm", "expected"),
    [
        ("ppo", {"lr": PPOConfig().learning_rate, "num_epochs": PPOConfig().update_epochs, "discount_factor": 0.98}),
        ("sac", {"lr": SACConfig().learning_rate, "sac_alpha": 0.2, "batch_size": 128, "discount_factor": 0.98}),
        ("distill", {"lr": DistillConfig().learning_rate, "batch_size": DistillConfig().minibatch_size}),
        ("sb3:dqn", {"discount_factor": 0.98}),
    ],
)
def test_what_awss_tools_are_told_is_how_the_algorithm_learns(algorithm: str, expected: dict[str, float]) -> None:
    told = aws_hyperparameters(TrainSettings(algorithm=algorithm).learning)
    assert expected.items() <= told.items()
    assert ("beta_entropy" in told) == (algorithm == "ppo")
    assert ("lr" in told) == (algorithm != "sb3:dqn")  # the library's own default, which it does not tell


def test_a_distillation_of_continuous_actions_is_for_fast_laps() -> None:
    continuous = ModelMetadata(neural_network="RACECRAFT_SMALL", action_space=action_space("continuous"))
    fast = make_settings(metadata=continuous, algorithm="distill", num_envs=32)
    assert FAST_DISTILL.distill is not None
    assert fast.distill == replace(FAST_DISTILL.distill, num_envs=32)
    assert fast.distill.teacher_steps > DistillConfig().teacher_steps
    assert fast.start == FAST_DISTILL.start
    own = make_settings(
        metadata=continuous, algorithm="distill", distill=DistillConfig(teacher_steps=5), start=SETTINGS.start
    )
    assert (own.distill.teacher_steps, own.start) == (5, SETTINGS.start)
    assert make_settings(metadata=continuous, algorithm="distill", track=["oval", "kidney"]).start == MANY_TRACKS.start
    for other in (make_settings(metadata=DISCRETE, algorithm="distill"), make_settings(metadata=continuous)):
        assert (other.distill, other.start) == (DistillConfig(), Start(spread=True))


def test_aws_hyperparameters_become_ppo() -> None:
    hyperparameters = Hyperparameters(
        batch_size=32,
        num_epochs=4,
        lr=1e-4,
        beta_entropy=0.02,
        discount_factor=0.9,
        loss_type="huber",
        num_episodes_between_training=10,
        exploration_type="e-greedy",
        e_greedy_value=0.1,
        epsilon_steps=500,
    )
    ppo = make_settings(metadata=DISCRETE, hyperparameters=hyperparameters).ppo
    assert ppo == replace(
        ppo,
        minibatch_size=32,
        update_epochs=4,
        learning_rate=1e-4,
        ent_coef=0.02,
        gamma=0.9,
        value_loss="huber",
        episodes_per_iteration=10,
        num_envs=10,
        exploration="e-greedy",
        epsilon_start=1.0,
        epsilon_end=0.1,
        epsilon_steps=500,
        max_grad_norm=0.0,
    )
    assert make_settings(metadata=DISCRETE, hyperparameters=hyperparameters, num_envs=3).ppo.num_envs == 3


@pytest.mark.parametrize(("loss_type", "vf_coef"), [("huber", 1.0), ("mean squared error", 2.0)])
def test_with_awss_critic_ppo_is_exactly_awss(loss_type: str, vf_coef: float) -> None:
    hyperparameters = Hyperparameters(loss_type=loss_type)
    ours, awss = (
        make_settings(metadata=DISCRETE, hyperparameters=hyperparameters, critic=critic)
        for critic in ("privileged", "camera")
    )
    exactly = {"initial_weights": "glorot", "is_eps_hat": True, "normalize_returns": False, "vf_coef": vf_coef}
    assert awss.ppo == replace(ours.ppo, **exactly)
    assert (ours.initial_weights, awss.initial_weights) == ("orthogonal", "glorot")
    assert (awss.ppo.objective.is_eps_hat, ours.ppo.objective.is_eps_hat) == (True, False)
    assert make_settings(metadata=DISCRETE, critic="camera").ppo == make_settings(metadata=DISCRETE).ppo
    assert replace(awss, algorithm="distill").initial_weights == "orthogonal"


@pytest.mark.parametrize("episodes", [1, 100])
def test_cars_follow_the_episodes_between_training(episodes: int) -> None:
    hyperparameters = Hyperparameters(num_episodes_between_training=episodes)
    settings = make_settings(metadata=DISCRETE, hyperparameters=hyperparameters)
    assert settings.ppo.num_envs == min(episodes, 64)


@pytest.mark.parametrize("version", VEHICLE_OF_VERSION)
def test_version_and_network_of_the_metadata_are_used_unless_said_otherwise(version: str) -> None:
    metadata = replace(DISCRETE, version=version, neural_network="DEEP_CONVOLUTIONAL_NETWORK")
    settings = make_settings(metadata=metadata)
    assert settings.network == "DEEP_CONVOLUTIONAL_NETWORK"
    assert settings == make_settings(metadata=metadata, vehicle=VEHICLE_OF_VERSION[version])
    assert make_settings(metadata=metadata, network="RACECRAFT_SMALL").network == "RACECRAFT_SMALL"
    assert make_settings(metadata=metadata, vehicle=Vehicle(mass=2.0)).vehicle.mass == 2.0


@pytest.mark.parametrize("num_envs", [1, 3, 64, 100, 1000, TIME_TRIAL.most_envs])
def test_any_number_of_cars_makes_rollouts_that_ppo_accepts(num_envs: int) -> None:
    ppo = make_settings(metadata=DISCRETE, num_envs=num_envs).ppo
    assert ppo.num_envs == num_envs
    assert 1 <= ppo.minibatch_size <= ppo.num_envs * ppo.num_steps


@pytest.mark.parametrize("num_envs", [-1, TIME_TRIAL.most_envs + 1, 10**9])
def test_an_impossible_number_of_cars_is_refused(num_envs: int) -> None:
    with pytest.raises(ConfigError, match="num_envs"):
        make_settings(metadata=DISCRETE, num_envs=num_envs)
    with pytest.raises(ConfigError, match="num_envs"):
        make_settings(metadata=DISCRETE, hyperparameters=Hyperparameters(), num_envs=num_envs)


def test_ppo_can_be_given_whole_but_not_beside_hyperparameters() -> None:
    ppo = PPOConfig(learning_rate=0.0)
    assert make_settings(metadata=DISCRETE, ppo=ppo).ppo == ppo
    assert make_settings(metadata=DISCRETE, ppo=ppo, num_envs=4).ppo.learning_rate == 0.0
    with pytest.raises(ConfigError, match="one of them"):
        make_settings(metadata=DISCRETE, ppo=ppo, hyperparameters=Hyperparameters())
    for wrong in ({}, {"learning_rate": 1e-3}, 5):
        with pytest.raises(ConfigError, match=r"ppo is .*; use racecraft\.learn\.PPOConfig\(\.\.\.\)\."):
            train("oval", ppo=wrong)
    assert make_plan(ppo=None).settings == make_plan().settings


@pytest.mark.parametrize(("kind", "num_actions"), [("default", None), ("continuous", 2)])
@pytest.mark.parametrize("critic", ["privileged", "camera"])
def test_the_network_fits_the_action_space(kind: str, num_actions: int | None, critic: str) -> None:
    metadata = replace(DISCRETE, action_space=action_space(kind))
    spec = make_settings(metadata=metadata, critic=critic).network_spec(metadata)
    assert spec.num_actions == (num_actions or metadata.action_space.size)  # type: ignore[union-attr]
    assert spec.is_discrete == (kind == "default")
    assert (spec.state_size > 0) == (critic == "privileged")


def test_aws_own_files_give_settings() -> None:
    folder = Path(__file__).parents[3] / "shared" / "logs" / "drfc"
    if not folder.is_dir():
        pytest.skip("the logs of a real AWS training are not here (../shared/logs/drfc)")
    metadata = ModelMetadata.load(folder / "model_metadata.json")
    settings = make_settings(metadata=metadata, hyperparameters=Hyperparameters.load(folder / "hyperparameters.json"))
    assert settings.network == "DEEP_CONVOLUTIONAL_NETWORK_SHALLOW"
    assert settings.network_spec(metadata).num_actions == 14
    assert (settings.ppo.gamma, settings.ppo.update_epochs, settings.ppo.value_loss) == (0.95, 3, "huber")


@pytest.mark.parametrize("objects", [Objects(obstacles=Obstacles(count=2)), Objects(bots=Bots(count=1))])
def test_among_objects_training_takes_its_time(objects: Objects) -> None:
    """What is not said is chosen for the race; what is said stays."""
    settings = make_settings(metadata=DISCRETE, objects=objects)
    assert (settings.ppo, settings.evaluate_every, settings.evaluation_trials) == (
        OBJECTS.ppo,
        OBJECTS.evaluate_every,
        OBJECTS.evaluation_trials,
    )
    chosen = make_settings(metadata=DISCRETE, objects=objects, ppo=PPOConfig(), evaluate_every=7, evaluation_trials=6)
    assert (chosen.ppo, chosen.evaluate_every, chosen.evaluation_trials) == (PPOConfig(), 7, 6)
    assert make_settings(metadata=DISCRETE).evaluate_every == TIME_TRIAL.evaluate_every == 4096
    with pytest.raises(ConfigError, match="5 or minutes"):
        train("oval", objects=objects, until="5 or minutes")


@pytest.mark.parametrize("objects", [Objects(obstacles=Obstacles(count=2)), Objects(bots=Bots(count=1))])
def test_among_objects_a_teacher_comes_first_unless_it_is_said_how_to_learn(objects: Objects) -> None:
    plain = make_settings(metadata=DISCRETE, objects=objects)
    assert (plain.algorithm, plain.distill) == ("distill", FAST_OBJECTS.distill)
    several = make_settings(metadata=DISCRETE, objects=objects, track=["oval", "kidney"], critic="privileged")
    assert (several.algorithm, several.distill) == ("distill", FAST_OBJECTS.distill)
    said: list[dict[str, Any]] = [
        {"algorithm": "ppo"},
        {"ppo": PPOConfig()},
        {"hyperparameters": Hyperparameters()},
        {"critic": "camera"},  # has no teacher's critic to go on with
        {"network": "DEEP_CONVOLUTIONAL_NETWORK_SHALLOW"},  # its frames are too large to be remembered
        {"metadata": replace(DISCRETE, neural_network="DEEP_CONVOLUTIONAL_NETWORK")},
    ]
    for one in said:
        assert make_settings(**{"metadata": DISCRETE, "objects": objects, **one}).algorithm == "ppo", one
    soft = replace(CONTINUOUS, training_algorithm="sac")
    assert make_settings(metadata=soft, objects=objects).algorithm == "sac"


def test_a_training_of_few_steps_has_a_teacher_of_few() -> None:
    def teacher_steps(until: str, **settings: Any) -> int:
        made = make_settings(metadata=DISCRETE, until=Until.parse(until), algorithm="distill", **settings)
        return made.distill.teacher_steps

    assert teacher_steps("1000 steps") == teacher_steps("1000 steps or 5 minutes") == 5000
    assert teacher_steps("50000 steps") == teacher_steps("5 laps") == DistillConfig().teacher_steps
    assert teacher_steps("1000 steps", distill=DistillConfig(teacher_steps=9)) == 9


@pytest.mark.parametrize(
    ("track", "until", "regime"),
    [
        ("reinvent_2018", "no better lap or 10 minutes", FAST_DISTILL),  # 17.7 m
        ("grand_circuit", "no better lap or 10 minutes", LONG_FAST_DISTILL),  # 68.3 m
        ("grand_circuit", "19 s lap", LONG_FAST_DISTILL),
        ("grand_circuit", "3 minutes", LONG_FAST_DISTILL),
        ("grand_circuit", "179 s", BRISK_FAST_DISTILL),
        ("grand_circuit", "2 minutes or no better lap", BRISK_FAST_DISTILL),
        ("grand_circuit", "99 s", FAST_DISTILL),
        ("reinvent_2018", "2 minutes", FAST_DISTILL),
        (["grand_circuit", "endurance"], "10 minutes", FAST_DISTILL),
    ],
)
def test_who_is_to_be_fast_on_a_long_road_has_long_lessons(track: str | list[str], until: str, regime: Regime) -> None:
    settings: dict[str, Any] = {"track": track, "until": Until.parse(until), "algorithm": "distill"}
    made = make_settings(metadata=CONTINUOUS, **settings)
    assert (made.distill, made.critic) == (regime.distill, regime.critic or "privileged")
    assert make_settings(metadata=DISCRETE, **settings).distill == DistillConfig()


@pytest.mark.costly
def test_a_child_of_a_taught_model_among_objects_has_a_teacher_and_no_lessons(tmp_path: Path) -> None:
    boxes = Objects(obstacles=Obstacles(count=2))
    settings: dict[str, Any] = {"objects": boxes, "num_envs": 8, "evaluation_trials": 1, "num_threads": 1}
    parent = train("oval", until="64 steps", name="parent", root=tmp_path, **settings).run
    made = make_plan(parent=parent, until="10 minutes").settings
    assert OBJECTS.distill is not None
    assert (made.algorithm, made.objects) == ("distill", boxes)
    assert made.distill == replace(OBJECTS.distill, student_steps=1)
    child = train(parent=parent, until="128 steps", num_envs=8, evaluation_trials=1, num_threads=1, root=tmp_path)
    assert read_settings(RunFolder.open(child.run)).distill.teacher_steps == 640

    assert make_plan(parent=parent, ppo=PPOConfig()).settings.algorithm == "ppo"
    assert make_plan(parent=parent, objects=Objects()).settings.algorithm == "ppo"  # on a free road PPO finds its way
    alone = train("oval", until="64 steps", num_envs=8, evaluation_trials=1, num_threads=1, root=tmp_path).run
    assert make_plan(parent=alone, objects=boxes).settings.algorithm == "ppo"


@pytest.mark.costly
def test_a_racers_child_has_a_teacher_and_no_lessons(tmp_path: Path) -> None:
    settings: dict[str, Any] = {"num_envs": 8, "evaluation_trials": 1, "num_threads": 1, "root": tmp_path}
    parent = train("oval", opponents=Opponents(), until="64 steps", name="parent", **settings).run
    for plan in (make_plan(parent=parent), make_plan(parent=parent, opponents=Opponents(drivers=(str(parent),)))):
        assert (plan.settings.algorithm, plan.settings.critic) == ("distill", "lap")
        assert plan.settings.distill.student_steps == 1
        assert plan.settings.distill.refining_rate == DUEL.distill.refining_rate
    child = train(parent=parent, opponents=Opponents(drivers=(str(parent),)), until="128 steps", **settings)
    assert child.steps >= 128
    assert make_plan(parent=parent, ppo=PPOConfig()).settings.algorithm == "ppo"
    assert make_plan(parent=parent, opponents=None).settings.algorithm == "ppo"  # alone again


def test_who_is_taught_to_be_fast_trains_until_no_lap_is_better() -> None:
    fast = make_plan(algorithm="distill", actions="continuous").settings
    assert fast.until == Until(no_better_lap=True, seconds=600)
    assert make_plan(algorithm="distill").settings.until == Until(laps=5)
    boxes = Objects(obstacles=Obstacles(count=2))
    assert make_plan(algorithm="distill", actions="continuous", objects=boxes).settings.until == Until.parse(
        OBJECTS.until
    )


def test_against_other_models_training_takes_its_time() -> None:
    rivals = Opponents()
    settings = make_settings(metadata=CONTINUOUS, opponents=rivals)
    assert DUEL.ppo is not None
    assert (settings.ppo, settings.evaluate_every) == (replace(DUEL.ppo, ent_coef=0.0), DUEL.evaluate_every)
    assert (settings.algorithm, settings.distill) == ("distill", DUEL.distill)
    chosen = make_settings(metadata=CONTINUOUS, opponents=rivals, ppo=PPOConfig(), evaluate_every=7)
    assert (chosen.ppo, chosen.evaluate_every, chosen.algorithm) == (PPOConfig(), 7, "ppo")
    alone = make_settings(metadata=CONTINUOUS)
    assert (alone.ppo, alone.evaluate_every) == (PPOConfig(ent_coef=0.0), 4096)
    plan = make_plan(opponents=rivals)
    assert (plan.settings.until, plan.metadata.action_space) == (Until(seconds=600), action_space("continuous"))
    assert plan.reward == load_reward("duel")
    assert plan.settings.critic == "lap"


@pytest.mark.parametrize(
    ("until", "steps"),
    [
        ("10 minutes", 3_000_000),
        ("1 minutes", 600_000),
        ("0.00001 seconds", 1),
        ("5 laps", 3_000_000),
        ("1000 steps", 5_000),
        ("100000 steps or 10 seconds", 100_000),
    ],
)
def test_a_short_race_training_leaves_its_student_time(until: str, steps: int) -> None:
    settings = make_settings(metadata=CONTINUOUS, opponents=Opponents(), until=Until.parse(until))
    assert settings.distill == replace(DUEL.distill, teacher_steps=steps)
    alone = make_settings(metadata=CONTINUOUS, algorithm="distill", until=Until.parse("1 minutes"))
    assert alone.distill.teacher_steps > 600_000  # its teacher is quicker


@pytest.mark.parametrize(
    ("asked", "reward"),
    [
        ({}, "dodge"),
        ({"actions": "aws"}, "dodge"),
        ({"actions": "safe"}, "slalom"),
        ({"actions": "continuous"}, "slalom"),
        ({"actions": "default", "algorithm": "ppo"}, "slalom"),
        ({"actions": "continuous", "algorithm": "sac"}, "slalom"),
        ({"actions": "fast", "reward": "racing"}, "racing"),
    ],
)
def test_mistakes_among_objects_are_dear_for_who_drives_faster_than_a_walk(asked: dict[str, str], reward: str) -> None:
    boxes = Objects(obstacles=Obstacles(count=2))
    assert make_plan("oval", objects=boxes, **asked).reward == load_preset(reward)  # type: ignore[arg-type]
    assert make_plan("oval", **asked).reward == load_preset("racing")  # type: ignore[arg-type]


@pytest.mark.costly
def test_a_training_among_objects_has_the_reward_and_the_actions_of_its_race(tmp_path: Path) -> None:
    ppo = PPOConfig(num_envs=2, num_steps=8, minibatch_size=16, update_epochs=1)
    boxes = Objects(obstacles=Obstacles(count=2))
    result = train("oval", objects=boxes, until="16 steps", evaluation_trials=1, ppo=ppo, num_threads=1, root=tmp_path)
    assert (result.run / "reward_function.py").read_text() == load_preset(OBJECTS.reward)
    metadata = ModelMetadata.load(result.run / "model_metadata.json")
    assert (metadata.action_space, metadata.sensors) == (action_space(OBJECTS.actions), OBJECTS.sensors)
