"""Every example runs as its docstring says, with a tiny budget, and AWS's files among them are valid."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from racecraft.agent import Hyperparameters, ModelMetadata
from racecraft.reward import check_reward, dry_run, load_reward
from racecraft.track import load_track, track_names

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
CUSTOM = EXAMPLES / "custom_reward"


BUILD = EXAMPLES.parent / "build"


def run(script, *arguments, is_quiet=True, **environment):
    """What an example prints; warnings of our own code are errors."""
    process = subprocess.run(
        [sys.executable, EXAMPLES / script, *arguments],
        capture_output=True,
        text=True,
        timeout=240,
        env={
            "OMP_NUM_THREADS": "1",
            "PYTHONWARNINGS": "error:::racecraft",
            "SB3_LOGDIR": os.environ["SB3_LOGDIR"],
            **environment,
        },
        check=False,
    )
    assert process.returncode == 0, process.stderr
    assert not is_quiet or "Warning" not in process.stderr
    return process.stdout


def test_every_script_is_tested_here():
    scripts = {str(path.relative_to(EXAMPLES)) for path in EXAMPLES.rglob("*.py")}
    assert scripts == {
        "gymnasium_loop.py",
        "rllib_ppo.py",
        "stable_baselines3_ppo.py",
        "custom_reward/reward_function.py",
        "custom_reward/try_reward.py",
    }


@pytest.mark.costly
def test_the_gymnasium_loop_drives_one_car_and_many():
    printed = run("gymnasium_loop.py", "--steps", "100", "--track", "oval")
    assert "camera steps/s with 64 cars" in printed
    assert "episode 0: off_track" in printed


@pytest.mark.costly
def test_the_custom_reward_is_tried_and_driven():
    printed = run("custom_reward/try_reward.py", "--steps", "5", "--track", "oval")
    assert printed.count("reward") == 5
    assert not re.search(r"line \d", printed)  # neither a problem nor an error


@pytest.mark.costly
def test_the_custom_reward_is_clean_on_every_track():
    source = load_reward(CUSTOM / "reward_function.py")
    assert check_reward(source) == []
    for name in track_names():
        for outcome in dry_run(source, load_track(name)):
            assert outcome.error is None
            assert 0.0 <= outcome.reward <= 1.31


def test_the_custom_files_are_awss():
    metadata = ModelMetadata.load(CUSTOM / "model_metadata.json")
    assert metadata.notes == ()
    assert {speed for _, speed in metadata.action_space.to_degrees()} == {1.0, 2.0}
    assert Hyperparameters.load(CUSTOM / "hyperparameters.json").notes == ()


@pytest.mark.slow
def test_stable_baselines3_trains_and_drives():
    pytest.importorskip("stable_baselines3")
    printed = run("stable_baselines3_ppo.py", "--steps", "1")
    assert "of a lap and" in printed


@pytest.mark.slow
@pytest.mark.timeout(300)
def test_rllib_trains_on_the_vector_environment():
    if not (BUILD / "rllib").is_dir():
        pytest.skip("RLlib is not installed: make build/rllib")
    pytest.importorskip("torch")
    environment = {
        "PYTHONPATH": os.pathsep.join(map(str, (BUILD / "ray", BUILD / "rllib"))),
        "RAY_raylet_start_wait_time_s": "200",  # the machine may be busy
        **{name: os.environ[name] for name in ("HOME", "PATH")},
    }
    printed = run("rllib_ppo.py", "--steps", "512", "--cars", "8", is_quiet=False, **environment)
    assert re.search(r"^ +5\d\d camera steps  return +-?\d+\.\d\d  +\d+ steps/s$", printed, flags=re.MULTILINE), printed
