"""The files of a heat or a ladder.

.racecraft/contests/<job>/race.replay    a heat, to be driven again by anybody
                          ghosts/0.replay  ghosts of its film that drove before, by their places among its ghosts
                          ghosts.json    where all its ghosts were, beside the cars of the heat
                          video.mp4      of its winner, the others beside it
                          matches.zip    what both cars of every race of a ladder drove, a JSON document each

They are removed with it.
"""

from __future__ import annotations

import struct
import zipfile
import zlib
from pathlib import Path
from typing import Any, Final

from racecraft.json_file import parse_json_object
from racecraft.serve.problems import NotFound

FOLDER: Final = "contests"
REPLAY, VIDEO, MATCHES = "race.replay", "video.mp4", "matches.zip"
MAX_MATCH: Final = 16 << 20
"""Bytes of what is told of one race of a ladder; three minutes among 32 objects have three million."""
MAX_CONTENTS: Final = 8 << 20
"""The same for the archive's table of contents, which is read at once; that of a hundred thousand races has six."""
_END, _LOCATOR, _LONG_END = 22, 20, 56  # bytes of the records that end a zip archive
DRIVEN: Final = "driven.txt"
"""How many races of a ladder are decided."""


def contest_folder(state: Path, contest: str) -> Path:
    """Where they lie."""
    return state / FOLDER / contest


def count_matches(folder: Path) -> int:
    """Races of a ladder that are decided while it is under way."""
    try:
        return int((folder / DRIVEN).read_text(encoding="ascii") or 0)
    except (OSError, ValueError):
        return 0


def read_match(path: Path, number: int) -> dict[str, Any]:
    """One race of a ladder: its track, and of both cars what `ReplayCar` tells.

    A worker may have written the file, so it is read as a stranger's.

    Raises:
        NotFound: It was not driven, or cannot be read.
    """
    try:
        _require_short_contents(path)
        with zipfile.ZipFile(path) as archive, archive.open(f"{number}.json") as file:
            data = file.read(MAX_MATCH + 1)  # whatever the archive says of its size
        if len(data) > MAX_MATCH:
            raise ValueError("too large")
        document = parse_json_object(data, name=path.name)
        if not isinstance(document["track"], str) or not isinstance(document["cars"], list):
            raise ValueError("no race")
        return document
    except (OSError, LookupError, ValueError, EOFError, RuntimeError, zlib.error, zipfile.BadZipFile) as error:
        raise NotFound(f"The ladder has no race {number}.") from error


def _require_short_contents(path: Path) -> None:
    """Refuse an archive whose table of contents would fill the memory; it stands at the end, without a comment.

    Raises:
        ValueError: Its is too long, or there is none.
    """
    with path.open("rb") as file:
        size = file.seek(0, 2)
        file.seek(max(0, size - _END - _LOCATOR - _LONG_END))
        tail = file.read()
    end = tail[-_END:]
    if end[:4] != b"PK\5\6" or end[-2:] != b"\0\0":
        raise ValueError("no archive of ours")
    (length,) = struct.unpack_from("<L", end, 12)
    if tail[-_END - _LOCATOR :].startswith(b"PK\6\7") and len(tail) == _END + _LOCATOR + _LONG_END:  # of many members
        (length,) = struct.unpack_from("<Q", tail, 40)
    if length > MAX_CONTENTS:
        raise ValueError("too large")
