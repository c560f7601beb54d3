"""The files of a heat or a ladder.

.racecraft/contests/<job>/race.replay    a heat, to be driven again by anybody
                          ghosts/0.replay  ghosts of its film that drove before, by their places among its ghosts
                          ghosts.json    where all its ghosts were, beside the cars of the heat
                          video.mp4      of its winner, the others beside it
                          matches.zip    what both cars of every race of a ladder drove, a JSON document each

They are removed with it.
"""

from __future__ import annotations

import json
import zipfile
from pathlib import Path
from typing import Any, Final

from racecraft.serve.problems import NotFound

FOLDER: Final = "contests"
REPLAY, VIDEO, MATCHES = "race.replay", "video.mp4", "matches.zip"
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

    Raises:
        NotFound: It was not driven.
    """
    try:
        with zipfile.ZipFile(path) as archive:
            document: dict[str, Any] = json.loads(archive.read(f"{number}.json"))
            return document
    except (OSError, KeyError, zipfile.BadZipFile) as error:
        raise NotFound(f"The ladder has no race {number}.") from error
