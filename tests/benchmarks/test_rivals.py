"""The rivals can be measured; each script prints one JSON object."""

from __future__ import annotations

import importlib.util
import json
import subprocess
import sys
from pathlib import Path

import pytest

RIVALS = Path(__file__).resolve().parents[2] / "benchmarks" / "rivals"
KEYS = {"name", "version", "steps_per_second", "steps", "observation", "num_envs"}


def measure(name, seconds, *options):
    """A rival's figures, from a process of its own: other projects' warnings are none of ours."""
    process = subprocess.run(
        [sys.executable, RIVALS / f"{name}.py", "--seconds", str(seconds), *options],
        capture_output=True,
        text=True,
        timeout=240,
        env={"OMP_NUM_THREADS": "1"},
        check=False,
    )
    assert process.returncode == 0, process.stderr
    return json.loads(process.stdout.splitlines()[-1])


@pytest.mark.costly
def test_carracing():
    pytest.importorskip("pygame")
    if importlib.util.find_spec("Box2D") is None:
        pytest.skip("Box2D is not installed: pip install 'gymnasium[box2d]'")
    figures = measure("carracing", 0.5)
    assert figures.keys() >= KEYS
    assert figures["steps_per_second"] > 1
    assert figures["steps"] > 0


@pytest.mark.slow
def test_sb3_ppo_measures_whole_iterations():
    pytest.importorskip("stable_baselines3")
    figures = measure("sb3_ppo", 0.1, "--rollout-steps", "4")
    assert figures.keys() >= KEYS
    assert figures["steps"] == 16
    assert figures["steps_per_second"] > 1
