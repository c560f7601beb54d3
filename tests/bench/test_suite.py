from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from racecraft.bench import BENCHMARKS, learning, run_benchmarks, suite, walls
from racecraft.errors import ConfigError, RacecraftError
from racecraft.reward import RewardWorker
from racecraft.reward.sandbox import UNCONFINED, Confinement, find_confinement

FIGURES = {
    "simulator": ("camera_steps_per_second", "state_steps_per_second", "bytes_per_car"),
    "races": ("camera_steps_per_second", "six_boxes_in_view_percent"),
    "reward": ("calls_per_second", "microseconds_per_call"),
    "train": ("steps_per_second",),
}


@pytest.fixture(autouse=True)
def _small(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(suite, "CAMERA_CARS", 16)
    monkeypatch.setattr(suite, "STATE_CARS", 64)
    monkeypatch.setattr(suite, "START_SECONDS", 5.0)
    monkeypatch.setattr(suite, "has_numba", lambda: False)  # compiling takes seconds; tests/reward does it
    monkeypatch.setattr("racecraft.bench.machine.COPY_BYTES", 1 << 20)


@pytest.mark.costly
@pytest.mark.parametrize("name", FIGURES)
def test_a_benchmark_alone_gives_its_figures_below_the_machines_limit(name: str) -> None:
    said: list[str] = []
    results = run_benchmarks(only=[name], seconds=0.1, say=said.append)
    assert list(results) == ["machine", name]
    assert name in said[0]
    json.dumps(results, allow_nan=False)
    for figure in FIGURES[name]:
        assert results[name][figure] > 0
    for figure, limit in results[name]["limits"].items():
        assert figure in results[name]
        assert limit["value"] > 0
        assert limit["what"]


@pytest.mark.costly
def test_walls_are_measured_beside_none(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[Confinement] = []

    class Watched(RewardWorker):
        def __init__(self, *arguments: Any, **options: Any) -> None:
            asked.append(options["confinement"])
            super().__init__(*arguments, **options)

    monkeypatch.setattr(walls, "RewardWorker", Watched)
    monkeypatch.setattr(walls, "STARTS", 2)
    found = run_benchmarks(only=["reward"], seconds=0.1)["reward"]["confinement"]
    assert asked == [UNCONFINED, find_confinement()] * 3
    assert found["walls"] == str(find_confinement())
    for figure in ("calls_per_processor_second", "start_ms"):
        assert found[figure] > 0
        assert found[f"unconfined_{figure}"] > 0


def test_memory_of_a_car_is_below_25_kilobytes() -> None:
    assert suite.bytes_per_car(suite.load_track(suite.TRACK)) < 25_000


@pytest.mark.costly
def test_the_machine_names_no_person_or_host() -> None:
    import getpass
    import socket

    described = run_benchmarks(only=["reward"], seconds=0.1)["machine"]
    assert {"processor", "cores", "memory_gib", "instruction_set"} <= described.keys()
    assert socket.gethostname() not in described.values()
    assert getpass.getuser() not in described.values()


def test_skill_counts_every_seed(monkeypatch: pytest.MonkeyPatch) -> None:
    commands: list[list[str]] = []

    def run(command: list[str], **_: Any) -> Any:
        commands.append(command)
        seed = int(command[command.index("--seed") + 1])
        result = {"steps": 100 * seed, "laps_completed": 4 + seed % 2, "best_lap_seconds": 9.0, "parts": {}}
        return type("Done", (), {"returncode": 0, "stdout": json.dumps(result), "stderr": ""})

    monkeypatch.setattr(suite.subprocess, "run", run)
    figures = run_benchmarks(only=["skill"], seeds=3)["skill"]
    assert len(figures["wall_seconds"]) == len(commands) == 3
    assert figures["solved"] == 2
    assert [one["steps"] for one in figures["runs"]] == [100, 200, 300]


def test_a_training_that_fails_is_an_error_and_no_figure(monkeypatch: pytest.MonkeyPatch) -> None:
    failed = type("Done", (), {"returncode": 1, "stdout": "", "stderr": "TrackNotFound: gone"})
    monkeypatch.setattr(suite.subprocess, "run", lambda *_, **__: failed)
    with pytest.raises(RacecraftError, match="TrackNotFound: gone"):
        run_benchmarks(only=["skill"], seeds=1)


@pytest.mark.parametrize(
    ("settings", "says"),
    [
        ({"only": ["simulatr"]}, "simulatr"),
        ({"only": [], "seconds": 0.0}, "seconds"),
        ({"only": [], "seconds": float("nan")}, "seconds"),
        ({"only": [], "seeds": 0}, "seeds"),
        ({"only": [], "seeds": 101}, "seeds"),
    ],
)
def test_bad_input_is_refused_before_anything_is_measured(settings: dict[str, Any], says: str) -> None:
    with pytest.raises(ConfigError, match=says):
        run_benchmarks(**settings, say=lambda _: pytest.fail("it measures"))


def test_a_near_miss_is_recognised() -> None:
    with pytest.raises(ConfigError) as caught:
        run_benchmarks(only=["simulatr"])
    assert caught.value.hint == "Did you mean 'simulator'?"
    assert all(name in str(caught.value) for name in BENCHMARKS)


def test_what_takes_minutes_runs_only_when_it_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    ran: list[str] = []
    measures = {name: lambda seconds, seeds, name=name: ran.append(name) or {} for name in BENCHMARKS}
    monkeypatch.setattr(suite, "BENCHMARKS", measures)
    run_benchmarks(only=[])
    assert ran == [name for name in BENCHMARKS if name not in suite.ON_REQUEST]
    run_benchmarks(only=["learn"])
    assert ran[-1] == "learn"


@pytest.mark.costly
def test_a_learning_command_gives_its_time_and_its_memory(tmp_path: Path) -> None:
    result, wall, peak = learning._command(
        ["--track", "oval", "--until", "512 steps", "--num-threads", "1"], str(tmp_path)
    )
    assert result["reason"] == "steps"
    assert wall > 0
    assert 30 < peak < 500
    with pytest.raises(RacecraftError, match="there_is_none"):
        learning._command(["--track", "there_is_none"], str(tmp_path))
