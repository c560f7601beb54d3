"""A preset's name or a small JSON file of numbers: how cars and randomisations are given."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any, Final

from racecraft.errors import ConfigError, did_you_mean
from racecraft.json_file import read_json_object

MAX_FILE_BYTES: Final = 100_000
"""They hold a few numbers."""


def read_parameters(name_or_path: str | Path, *, kind: str, presets: Iterable[str]) -> dict[str, Any]:
    """The JSON object in a file that somebody names where a preset could stand, too.

    Args:
        name_or_path: Of the file.
        kind: What it describes, for messages: ``"Vehicle"``.
        presets: Names that would have been understood instead.

    Raises:
        ConfigError: No such file, too large, or not one strict JSON object.
    """
    name, path, known = str(name_or_path), Path(name_or_path), list(presets)
    if not path.is_file():
        raise ConfigError(
            f"{kind} {name!r} is neither a preset ({', '.join(known)}) nor a file.", hint=did_you_mean(name, known)
        )
    return read_json_object(path, max_bytes=MAX_FILE_BYTES)
