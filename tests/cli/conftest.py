"""`racecraft` as a user types it, in this process, and a run that can be evaluated."""

from __future__ import annotations

import sys
import time
from pathlib import Path

import pytest
from command_line import Outcome, Run

from racecraft import cli
from racecraft.learn import PPOConfig


@pytest.fixture
def racecraft(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Run:
    """`racecraft ARGUMENTS` in an empty folder."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "80")

    def run(*arguments: str) -> Outcome:
        with monkeypatch.context() as patch:
            patch.setattr(sys, "argv", ["racecraft", *arguments])
            patch.setattr("racecraft.cli.train.process_start", time.monotonic)  # not when the tests began
            patch.setattr("warnings.showwarning", None)  # restored afterwards, whatever main puts here
            capsys.readouterr()
            with pytest.raises(SystemExit) as ended:
                cli.main()
        printed = capsys.readouterr()
        assert isinstance(ended.value.code, int)
        return Outcome(ended.value.code, printed.out, printed.err)

    return run


@pytest.fixture(scope="session")
def trained(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run that can be evaluated."""
    from racecraft import train

    ppo = PPOConfig(num_envs=8, num_steps=8, minibatch_size=32, update_epochs=1)
    root = tmp_path_factory.mktemp("runs")
    return train(
        "oval", ppo=ppo, until="128 steps", evaluate_every=64, evaluation_trials=2, num_threads=1, root=root
    ).run
