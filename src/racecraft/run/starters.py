"""Starters: policies that drive before anybody has trained anything. They ship with the package as small run folders.

    racecraft/starters/<name>/  ──unpack_starter──▶  <runs>/starter-<name>/, a run like any other

`benchmarks/starters.py` trains and writes them.
"""

from __future__ import annotations

import os
import shutil
import tempfile
from pathlib import Path
from typing import Final

from racecraft.errors import RunError, did_you_mean

STARTER: Final = "starter:"
"""A run's address that begins like this names a starter."""
FOLDER: Final = Path(__file__).parent.parent / "starters"


def starter_names() -> list[str]:
    """Those there are, in alphabetical order."""
    return sorted(path.name for path in FOLDER.iterdir() if (path / "run.json").is_file())


def unpack_starter(name: str, runs: str | Path) -> Path:
    """The run folder of a starter, made when it is not there.

    Args:
        name: One of `starter_names`.
        runs: Folder of all runs, made when missing.

    Returns:
        Its folder in there, ``starter-<name>``.

    Raises:
        RunError: There is no such starter, or the folder cannot be written.
    """
    names = starter_names()
    if name not in names:
        raise RunError(f"There is no starter {name[:80]!r}.", hint=did_you_mean(name, names) or _list(names))
    folder = Path(runs) / f"starter-{name}"
    if folder.is_dir():
        return folder
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(prefix=".starter-", dir=folder.parent) as scratch:
            shutil.copytree(FOLDER / name, Path(scratch) / "run", copy_function=shutil.copyfile)
            os.rename(Path(scratch) / "run", folder)  # whole, or not at all
    except OSError as error:
        if not folder.is_dir():  # another process made it meanwhile
            raise RunError(f"{folder} cannot be made: {error.strerror or error}.") from error
    return folder


def _list(names: list[str]) -> str:
    return "There are " + ", ".join(STARTER + name for name in names) + "."
