from __future__ import annotations

from pathlib import Path

import pytest


@pytest.fixture(autouse=True)
def progress_of_its_own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """No test may solve what the user has not solved."""
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "data"))
