"""Worlds that take little of a long training's time."""

from __future__ import annotations

import pytest

import quick_worlds
from racecraft.classic import a3c


@pytest.fixture
def quickly(monkeypatch: pytest.MonkeyPatch) -> None:
    """Gymnasium's classic worlds to the bit, in a fraction of the time, in this process and in those of A3C."""
    quick_worlds.install(monkeypatch.setattr)
    monkeypatch.setattr(a3c, "PROGRAM", f"{quick_worlds.FIRST_LINE}; {a3c.PROGRAM}")
