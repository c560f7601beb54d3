"""The GPU benchmark: one sentence where there is no GPU, and its parts at work on the CPU's kernels."""

from __future__ import annotations

import importlib.util
import json
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest

from racecraft.errors import ConfigError
from racecraft.gpu import open_device

SCRIPT = Path(__file__).parents[2] / "benchmarks" / "gpu.py"
pytestmark = pytest.mark.skipif(find_spec("torch") is None, reason="torch is not installed")


def load_script():
    spec = importlib.util.spec_from_file_location("gpu_benchmark", SCRIPT)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_without_a_gpu_it_says_so_and_ends():
    try:
        open_device("cuda")
    except ConfigError:
        pass
    else:
        pytest.skip("this machine has a GPU")
    done = subprocess.run([sys.executable, SCRIPT], capture_output=True, text=True, timeout=120, check=True)
    document = json.loads(done.stdout)
    assert list(document) == ["machine"]
    assert "Device 'cuda' was asked for" in document["machine"]["error"]
    assert "trace" in document["machine"]


@pytest.mark.slow
def test_its_parts_work_on_the_kernels_of_the_cpu(monkeypatch):
    monkeypatch.syspath_prepend(str(Path(__file__).parents[1] / "gpu"))
    from host_device import HostDevice

    script = load_script()
    monkeypatch.setattr(script, "open_device", lambda name: HostDevice())
    monkeypatch.setattr(script, "TORCH_DEVICE", "cpu")
    monkeypatch.setattr(script, "BATCHES", (8, 16))
    monkeypatch.setattr(script, "PPO_BATCHES", ((16, 4, 32),))
    monkeypatch.setattr(script, "ITERATIONS", 2)
    for name, found in script.parity(cars=5, steps=9).items():
        assert "error" not in found, name
        assert set(found["different"].values()) == {0}, name
        assert found["saved_bytes_equal"]
    assert script.rewards()["racing"] == "proved"
    assert all(isinstance(pace, int) and pace > 0 for pace in script.simulator(seconds=0.01).values())
    found = script.learner()
    assert found["frames_encoded_alike"]
    assert found["weights_relative_difference"] < 1e-5
    for found in script.ppo().values():
        assert found["steps_per_s"] > 0
