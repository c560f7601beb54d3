"""A preset's name or a small JSON file of numbers: how cars and randomisations are given."""

from __future__ import annotations

import json
from collections.abc import Iterable
from pathlib import Path
from typing import Any, Final

from racecraft.errors import ConfigError, did_you_mean

MAX_FILE_BYTES: Final = 100_000


def read_parameters(name_or_path: str | Path, *, kind: str, presets: Iterable[str]) -> dict[str, Any]:
    """The JSON object in a file that somebody names where a preset could stand, too.

    Args:
        name_or_path: Of the file.
        kind: What it describes, for messages: ``"Vehicle"``.
        presets: Names that would have been understood instead.

    Raises:
        ConfigError: No such file, too large, or not one JSON object.
    """
    name, path, known = str(name_or_path), Path(name_or_path), list(presets)
    if not path.is_file():
        raise ConfigError(
            f"{kind} {name!r} is neither a preset ({', '.join(known)}) nor a file.", hint=did_you_mean(name, known)
        )
    try:
        if path.stat().st_size > MAX_FILE_BYTES:
            raise ConfigError(
                f"{kind} file {name!r} has more than {MAX_FILE_BYTES} bytes; it should hold a few numbers."
            )
        data = json.loads(path.read_text(encoding="utf-8"))
    except (ValueError, RecursionError) as error:
        raise ConfigError(f"{kind} file {name!r} is not JSON: {error}.") from error
    except OSError as error:
        raise ConfigError(f"{kind} file {name!r} cannot be read: {error.strerror or error}.") from error
    if not isinstance(data, dict):
        raise ConfigError(f"{kind} file {name!r} must hold one JSON object, not {type(data).__name__}.")
    return data
