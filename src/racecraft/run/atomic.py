"""Files that are either the old or the new one, whole, whatever happens in between.

Write a temporary file beside the target, fsync it, rename it over the target, fsync the folder.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path
from typing import Any

TEMPORARY = ".tmp"  # suffix of unfinished files


def write_file(path: Path, data: bytes | Iterable[bytes | memoryview], *, durable: bool = True) -> None:
    """Replace a file's content in one step.

    Args:
        path: The file; its folder exists.
        data: The new content, or its pieces.
        durable: Wait until it survives a power cut; a rename alone survives a killed process.

    Raises:
        OSError: Nothing was changed, or only the folder could not be synced; it names the file.
    """
    temporary = path.with_name(f".{path.name}.{os.getpid()}{TEMPORARY}")
    try:
        descriptor = os.open(temporary, os.O_WRONLY | os.O_CREAT | os.O_TRUNC | getattr(os, "O_BINARY", 0), 0o644)
        try:
            for piece in [data] if isinstance(data, bytes) else data:
                rest = memoryview(piece)
                while rest:
                    rest = rest[os.write(descriptor, rest) :]
            if durable:
                os.fsync(descriptor)
        finally:
            os.close(descriptor)
        os.replace(temporary, path)
    except BaseException as error:
        with suppress(OSError):
            temporary.unlink()
        if isinstance(error, OSError):  # of a full disk the system does not say where it was
            error.filename = str(path)
            del error.filename2  # where a rename failed; None would be told as a name
        raise
    if durable:
        sync_folder(path.parent)


def write_json(path: Path, document: Any, *, durable: bool = True) -> None:
    """Replace a file with a document, indented for people; NaN is refused, as JSON has none."""
    text = json.dumps(document, indent=2, allow_nan=False) + "\n"
    write_file(path, text.encode(), durable=durable)


def sync_folder(folder: Path) -> None:
    """Make renames in a folder survive a power cut, where the system can sync folders at all."""
    if os.name == "nt":
        return
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
