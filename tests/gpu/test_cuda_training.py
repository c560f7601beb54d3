"""A whole training on the device `cuda`: refused where there is no GPU, and run with the kernels on the CPU."""

from __future__ import annotations

import json
from importlib.util import find_spec

import pytest
from host_device import HostDevice
from typer.testing import CliRunner

from racecraft.cli.entry import every_verb
from racecraft.errors import ConfigError
from racecraft.gpu import open_device
from racecraft.learn import PPOConfig
from racecraft.run import RunFolder
from racecraft.training import resume, train
from racecraft.training.regimes import CUDA
from racecraft.training.settings import TrainSettings, make_settings

pytestmark = pytest.mark.skipif(find_spec("torch") is None, reason="torch is not installed")


def has_gpu() -> bool:
    try:
        open_device("cuda")
    except ConfigError:
        return False
    return True


@pytest.fixture
def device_on_the_cpu(monkeypatch):
    """The name `cuda` means the same kernels, compiled for the CPU."""
    from racecraft.learn.torch_cuda_learner import CudaLearner

    device = HostDevice()
    monkeypatch.setattr("racecraft.gpu.open_device", lambda name: device)
    monkeypatch.setattr("racecraft.sim.cuda_simulation.open_device", lambda name: device)
    monkeypatch.setattr(
        "racecraft.race.seeing.make_learner",
        lambda spec, *, seed, device, **_: CudaLearner(spec, seed=seed, device="cpu"),
    )
    return device


@pytest.mark.skipif(has_gpu(), reason="this machine has a GPU")
def test_without_a_gpu_nothing_is_begun(tmp_path):
    result = CliRunner().invoke(every_verb(), ["train", "--device", "cuda", "--runs", str(tmp_path / "runs"), "--json"])
    assert result.exit_code != 0
    assert isinstance(result.exception, ConfigError)
    assert "Device 'cuda' was asked for" in str(result.exception)
    assert not (tmp_path / "runs").exists()


def test_settings_know_the_device():
    from racecraft.agent import ModelMetadata, action_space

    metadata = ModelMetadata(action_space=action_space("default"), neural_network="RACECRAFT_SMALL")
    settings = make_settings(metadata=metadata, device="cuda")
    assert settings.ppo == CUDA.ppo
    assert settings.evaluate_every == 100_000
    document = settings.to_dict()
    assert TrainSettings.from_dict(document) == settings
    del document["device"]  # a run of an older version
    with pytest.raises(ConfigError):
        TrainSettings.from_dict({**document, "device": "gpu"})
    assert make_settings(metadata=metadata, device="cuda", num_envs=20000).ppo.num_envs == 20000
    for bad in ("gpu", "cuda:", "cuda:x", 1, None):
        with pytest.raises(ConfigError, match="allowed are 'cpu', 'cuda'"):
            TrainSettings(device=bad)


@pytest.mark.slow
def test_a_training_on_the_device_keeps_its_run_folder(tmp_path, device_on_the_cpu):
    settings = {
        "ppo": PPOConfig(num_envs=32, num_steps=8, minibatch_size=64),
        "evaluate_every": 1000,
        "device": "cuda",
        "root": tmp_path,
        "name": "run",
    }
    result = train("oval", until="1500 steps", **settings)
    assert result.reason == "steps"
    run = RunFolder.open(result.run)
    assert run.checkpoints.last is not None
    assert run.read_info().settings["device"] == "cuda"
    names = {kernel for kernel, _, _ in device_on_the_cpu.launches}
    assert {"step_cars", "reset_finished", "draw_frames", "pay_cars"} <= names
    again = resume(result.run, until="2500 steps")
    assert again.steps >= 2500
    metrics = json.loads(run.training_metrics.read_text())
    assert len(metrics["metrics"]) > 5


@pytest.mark.slow
def test_ppo_on_the_device_learns_to_drive():
    from test_cuda_learner import open_ppo

    ppo, environment = open_ppo(config=PPOConfig(num_envs=64, num_steps=8, minibatch_size=128))
    progress = []
    for _ in range(60):
        ppo.iterate()
        progress += [episode.progress for episode in environment.take_finished()]
    first, last = progress[:100], progress[-100:]
    assert sum(last) / len(last) > 2 * sum(first) / len(first)
