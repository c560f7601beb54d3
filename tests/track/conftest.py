from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

ROUTES = Path(__file__).parents[3] / "shared" / "tracks"


@pytest.fixture
def routes() -> Path:
    """The folder of AWS's 127 routes."""
    if not ROUTES.is_dir():
        pytest.skip("the folder ../shared/tracks with AWS's routes is not here")
    return ROUTES


@pytest.fixture
def write(tmp_path: Path) -> Callable[..., Path]:
    """Writes rows as an .npy file, or bytes or text as they are."""

    def write(content: np.ndarray | bytes | str, name: str = "track.npy") -> Path:
        path = tmp_path / name
        if isinstance(content, np.ndarray):
            np.save(path, content, allow_pickle=content.dtype.hasobject)
        elif isinstance(content, bytes):
            path.write_bytes(content)
        else:
            path.write_text(content, encoding="utf-8")
        return path

    return write
