"""Trainings by other algorithms than PPO: the same run folder, evaluated natively, resumed; bad input."""

from __future__ import annotations

import json
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tiny_runs import Recorder, Train, weights

from racecraft import evaluate, train
from racecraft.agent import Hyperparameters, ModelMetadata, action_space
from racecraft.errors import ConfigError
from racecraft.learn import DistillConfig, SACConfig
from racecraft.learn.sb3 import SB3Config
from racecraft.run import RunFolder
from racecraft.sim import Objects, Obstacles
from racecraft.training import resume
from racecraft.training.plan import make_plan
from racecraft.training.start import read_settings

pytestmark = pytest.mark.skipif(find_spec("torch") is None, reason="torch is not installed")

TINY_SAC = SACConfig(num_envs=4, num_steps=8, minibatch_size=16, learning_starts=32, buffer_size=512)
TINY_SB3 = SB3Config(num_envs=4, num_steps=8, batch_size=16, learning_starts=16, buffer_size=256)
TINY_DISTILL = DistillConfig(
    num_envs=4, num_steps=8, teacher_steps=1, minibatch_size=16, updates_per_iteration=1, buffer_size=64
)
SHORT: dict[str, Any] = {"until": "96 steps", "evaluate_every": 64}


@pytest.mark.costly
@pytest.mark.parametrize(
    "algorithm",
    [
        "sac",
        "distill",
        "sb3:ppo",
        pytest.param("sb3:dqn", marks=pytest.mark.slow),
        pytest.param("sb3:a2c", marks=pytest.mark.slow),
        pytest.param("sb3:sac", marks=pytest.mark.slow),
        pytest.param("sb3:td3", marks=pytest.mark.slow),
    ],
)
def test_a_run_is_as_any_other(tiny: Train, algorithm: str) -> None:
    if algorithm.startswith("sb3"):
        pytest.importorskip("stable_baselines3")
    recorder = Recorder()
    result = tiny(algorithm=algorithm, sac=TINY_SAC, sb3=TINY_SB3, distill=TINY_DISTILL, reporter=recorder, **SHORT)
    assert (result.reason, result.steps) == ("steps", 96)
    folder = RunFolder.open(result.run)
    assert read_settings(folder).algorithm == algorithm
    expected = "sac" if algorithm == "sac" else "clipped_ppo"
    assert folder.read_model_metadata().training_algorithm == expected
    last = folder.checkpoints.load("last")
    assert last.metadata["network"]["is_squashed"] == (algorithm in ("sac", "sb3:sac", "sb3:td3"))
    assert recorder.evaluations
    lessons = [report.lesson for report in recorder.iterations if report.lesson is not None]
    assert len(lessons) == (1 if algorithm == "distill" else 0)
    assert all((lesson.needed, lesson.share) == (1, 1.0) for lesson in lessons)
    assert sum(len(path.read_text().splitlines()) - 1 for path in folder.training_simtrace.iterdir()) > 0

    raced = evaluate(result.run, laps=1, num_trials=2, checkpoint="last", video=False).evaluation
    assert len(raced.trials) == 2

    before = weights(result.run)["weights/policy.conv2.weight"]
    resumed = resume(result.run, until="192 steps")
    assert resumed.steps == 192
    assert not np.array_equal(weights(result.run)["weights/policy.conv2.weight"], before)


def test_awss_files_choose_sac_and_its_settings(tmp_path: Path) -> None:
    metadata, hyperparameters = tmp_path / "model_metadata.json", tmp_path / "hyperparameters.json"
    ModelMetadata(action_space=action_space("continuous"), training_algorithm="sac").save(metadata)
    Hyperparameters(num_episodes_between_training=1, sac_alpha=0.4, lr=1e-4, batch_size=32).save(hyperparameters)
    plan = make_plan("oval", model_metadata=metadata, hyperparameters=hyperparameters)
    assert plan.settings.algorithm == "sac"
    sac = plan.settings.sac
    assert (sac.alpha, sac.learns_alpha, sac.learning_rate, sac.minibatch_size) == (0.4, False, 1e-4, 32)
    assert (sac.tau, sac.updates_per_step, sac.policy_frequency) == (1.0, 1.0, 1)

    Hyperparameters().save(hyperparameters)
    told = "num_episodes_between_training 20 has no effect: SAC learns after every step."
    assert told in make_plan("oval", model_metadata=metadata, hyperparameters=hyperparameters).notes
    assert make_plan("oval", model_metadata=metadata, algorithm="ppo").metadata.training_algorithm == "clipped_ppo"


@pytest.mark.parametrize(
    ("settings", "match"),
    [
        ({"algorithm": "sacc"}, "algorithm is 'sacc'; allowed are ppo, sac, distill, sb3:ppo"),
        ({"algorithm": "sb3:"}, "algorithm is 'sb3:'"),
        ({"algorithm": "sac", "actions": "default"}, "sac needs a continuous action space; this one is discrete"),
        ({"algorithm": "sb3:td3", "actions": "default"}, "sb3:td3 needs a continuous"),
        ({"algorithm": "sb3:dqn", "actions": "continuous"}, "sb3:dqn needs a discrete"),
        ({"algorithm": "sac", "num_envs": 5000}, "num_envs is 5000"),
    ],
)
def test_what_does_not_go_together_is_refused(tmp_path: Path, settings: dict[str, Any], match: str) -> None:
    with pytest.raises(ConfigError, match=match):
        train("oval", root=tmp_path, **settings)
    assert list(tmp_path.iterdir()) == []


def test_sb3_takes_no_hyperparameters_of_aws_and_sac_no_parent(tiny: Train, tmp_path: Path) -> None:
    Hyperparameters().save(tmp_path / "hyperparameters.json")
    with pytest.raises(ConfigError, match="sb3:ppo is none of them"):
        tiny(algorithm="sb3:ppo", hyperparameters=tmp_path / "hyperparameters.json")
    parent = tiny(until="64 steps").run
    with pytest.raises(ConfigError, match="sac cannot begin from another one"):
        tiny(parent=parent, algorithm="sac", actions="continuous")


def test_a_run_of_an_earlier_version_is_one_of_ppo(tiny: Train) -> None:
    run = tiny(until="64 steps").run
    document = json.loads((run / "run.json").read_text())
    for name in ("algorithm", "sac", "distill", "sb3"):
        del document["settings"][name]
    (run / "run.json").write_text(json.dumps(document))
    assert read_settings(RunFolder.open(run)).algorithm == "ppo"
    assert resume(run, until="128 steps").steps == 128


@pytest.mark.slow
def test_a_student_laps_the_oval_after_a_few_thousand_frames(tmp_path: Path) -> None:
    """Of what the teacher learned from the user's reward; PPO needs some 8,000 frames for it."""
    settings: dict[str, Any] = {
        "until": "5 laps or 6144 steps",
        "evaluate_every": 2048,
        "num_threads": 1,
        "root": tmp_path,
    }
    result = train("oval", algorithm="distill", distill=DistillConfig(teacher_steps=100_000), seed=1, **settings)
    assert (result.reason, result.laps_completed) == ("laps", 5)


@pytest.mark.slow
def test_the_plain_command_finds_its_way_among_boxes(tmp_path: Path) -> None:
    """PPO alone completes none of these laps in so many steps, nor does a student after its lessons complete all."""
    recorder = Recorder()
    train(
        "oval",
        objects=Objects(obstacles=Obstacles(count=6, placement="random")),
        distill=DistillConfig(teacher_steps=200_000, student_steps=40_000),
        until="62000 steps",
        evaluate_every=62_000,
        seed=1,
        num_threads=1,
        root=tmp_path,
        reporter=recorder,
    )
    assert recorder.evaluations[-1].laps_completed >= 16  # of 20
    assert any("A teacher" in note for note in recorder.notes)


@pytest.mark.slow
def test_sac_learns_to_follow_the_oval(tmp_path: Path) -> None:
    """Undriven it leaves the road after a few percent of the lap."""
    recorder = Recorder()
    train(
        "oval",
        algorithm="sac",
        until="5 laps or 8000 steps",
        evaluate_every=2000,
        seed=1,
        num_threads=1,
        root=tmp_path,
        reporter=recorder,
    )
    assert max(report.completion for report in recorder.evaluations) > 0.3
