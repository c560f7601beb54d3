from __future__ import annotations

import pytest
from own_drives import drive


@pytest.fixture(scope="session")
def lines() -> list[list[str]]:
    """Fields of 25 episodes on the oval."""
    return drive(episodes=25)
