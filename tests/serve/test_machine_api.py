"""What the settings page says about the machine."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from running_consoles import RunningConsole

from racecraft.reward.sandbox import find_confinement
from racecraft.serve.machine import machine
from racecraft.serve.settings import ServeSettings


@pytest.mark.costly
def test_folders_storage_devices_and_the_sandbox(console: RunningConsole) -> None:
    found = console.client.get("/api/console/machine").json()
    assert found["runs"] == str(console.runs)
    assert found["tracks"].startswith(found["runs"])
    assert found["database"] in ("SQLite", "PostgreSQL")
    assert found["sandbox"] == ("kernel" if find_confinement().is_complete else "process")
    assert 0 <= found["used_bytes"] < found["total_bytes"]
    assert 0 < found["free_bytes"] <= found["total_bytes"]
    assert found["cores"] >= 1
    assert found["instruction_set"] in ("avx512", "avx2", "portable")
    assert found["processor"]


def test_a_folder_is_counted_without_following_links(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    runs = tmp_path / "runs"
    (runs / "a").mkdir(parents=True)
    (runs / "a" / "file").write_bytes(b"x" * 1000)
    (tmp_path / "large").write_bytes(b"x" * 100_000)
    os.symlink(tmp_path / "large", runs / "link")
    os.symlink(runs, runs / "a" / "round")
    found = machine.describe_machine(ServeSettings(runs=runs))
    assert (found.used_bytes, found.is_used_complete) == (1000, True)
    monkeypatch.setattr(machine, "MAX_FILES", 2)
    assert not machine.describe_machine(ServeSettings(runs=runs)).is_used_complete


@pytest.mark.costly
def test_a_databases_password_is_told_to_nobody(tmp_path: Path) -> None:
    settings = ServeSettings(runs=tmp_path, database="postgresql+psycopg://me:secret@host/name")
    found = machine.describe_machine(settings)
    assert found.database == "PostgreSQL"
    assert "secret" not in found.model_dump_json()
