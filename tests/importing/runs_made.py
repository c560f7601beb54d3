"""What an import left behind."""

from __future__ import annotations

import json
from pathlib import Path


def content(folder: Path) -> dict[str, bytes]:
    """Every file of a run, but for what names its source and its time."""
    files = {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}
    files.pop("original/import.json")
    document = json.loads(files.pop("run.json"))
    del document["created"]
    return {**files, "run.json": json.dumps(document).encode()}


def nothing_was_made() -> bool:
    return not Path("runs").exists() or not list(Path("runs").iterdir())
