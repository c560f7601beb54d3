"""`racecraft doctor` and `racecraft bench`: what this machine can do."""

from __future__ import annotations

import pytest
from command_line import Run

from racecraft.bench import suite
from racecraft.errors import RacecraftError


@pytest.mark.costly
def test_the_doctor(racecraft: Run) -> None:
    outcome = racecraft("doctor")
    assert outcome.status == 0, outcome.out
    assert "native core" in outcome.out
    assert racecraft("doctor", "--json").document["ok"]


def test_the_doctor_warns_and_is_content(racecraft: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    from racecraft.bench import doctor

    def lacking() -> str:
        raise doctor.Lacking("no walls", hint="Read what you run.")

    monkeypatch.setattr(doctor, "CHECKS", [("reward sandbox", lacking, "")])
    outcome = racecraft("doctor")
    assert outcome.status == 0
    assert outcome.out.split() == ["warn", "reward", "sandbox", "no", "walls", "Read", "what", "you", "run."]
    assert racecraft("doctor", "--json").document["checks"][0]["warns"]


def test_the_doctor_finds_what_is_broken(racecraft: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    from racecraft.bench import doctor

    def broken() -> str:
        raise RacecraftError("gone")

    monkeypatch.setattr(doctor, "CHECKS", [("learner", broken, "Install it again.")])
    outcome = racecraft("doctor")
    assert outcome.status == 1
    assert "RacecraftError: gone" in outcome.out
    assert "Install it again." in outcome.out
    assert not racecraft("doctor", "--json").document["ok"]


@pytest.mark.costly
def test_bench(racecraft: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(suite, "CAMERA_CARS", 16)
    monkeypatch.setattr(suite, "STATE_CARS", 64)
    outcome = racecraft("bench", "--only", "simulator", "--seconds", "0.1", "--json")
    assert (outcome.status, outcome.err) == (0, "")
    assert outcome.document.keys() == {"machine", "simulator"}
    assert outcome.document["simulator"]["camera_steps_per_second"] > 0
    assert outcome.document["simulator"]["state_steps_per_second"] > 0
    shown = racecraft("bench", "--only", "simulator", "--only", "reward", "--seconds", "0.1")
    assert "camera_steps_per_second" in shown.out
    assert "calls_per_second" in shown.out
    assert all(len(line) <= 80 for line in shown.out.splitlines())
