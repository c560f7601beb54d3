"""Where files lie on this machine that a run's settings name by their path on another one.

A process that does a job for another machine says so once; its children inherit it. The settings stay as they are, so
a run that comes home is to the byte what it would have been there.
"""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from typing import Final

_VARIABLE: Final = "RACECRAFT_MOVED"


def move(places: Mapping[str, Path]) -> None:
    """Say where files and folders lie here, by the paths that settings name; this takes the place of what was said."""
    os.environ[_VARIABLE] = json.dumps({path: str(place) for path, place in places.items()})


def place_of(path: str | Path) -> Path:
    """Where something lies: as it is named, unless it was moved."""
    return Path(_places(os.environ.get(_VARIABLE, "")).get(str(path), path))


@lru_cache(maxsize=8)
def _places(text: str) -> dict[str, str]:
    places: dict[str, str] = json.loads(text) if text else {}
    return places
