"""What an import left behind."""

from __future__ import annotations

import json
from pathlib import Path

from racecraft.run import RunFolder


def content(folder: Path) -> dict[str, bytes]:
    """Every file of a run, but for what names its source and its time; of checkpoints the arrays."""
    files = {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}
    files.pop("original/import.json")
    files.pop("model/deepracer_checkpoints.json", None)
    store = RunFolder.open(folder).checkpoints
    if store.folder.is_dir():
        files = {name: data for name, data in files.items() if not name.startswith("checkpoints/")}
        saved = store.load()
        files |= {f"checkpoint {saved.step}/{name}": array.tobytes() for name, array in saved.arrays.items()}
        files["checkpoint"] = json.dumps(saved.metadata).encode()
    document = json.loads(files.pop("run.json"))
    del document["created"]
    return {**files, "run.json": json.dumps(document).encode()}


def nothing_was_made() -> bool:
    return not Path("runs").exists() or not list(Path("runs").iterdir())
