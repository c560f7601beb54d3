"""`python -m racecraft.site FOLDER`: writes what the page in a tab is told."""

from __future__ import annotations

import ast
import json
import sys
from pathlib import Path
from typing import Any

from racecraft.reward import load_preset, preset_names
from racecraft.reward.numeric import NotNumeric
from racecraft.site.javascript import javascript
from racecraft.site.plan import plan, track_file
from racecraft.track import track_names


def main(folder: Path) -> None:
    """Write plan.json, rewards.js and a file a track."""
    (folder / "tracks").mkdir(parents=True, exist_ok=True)
    sources = {name: load_preset(name) for name in preset_names()}
    offered = {name: source for name, source in sources.items() if _is_translated(source)}
    rewards = [
        {"name": name, "description": (ast.get_docstring(ast.parse(source)) or "").split("\n")[0], "source": source}
        for name, source in offered.items()
    ]
    write(folder / "plan.json", {**plan(), "tracks": track_names(), "rewards": rewards})
    for name in track_names():
        write(folder / "tracks" / f"{name}.json", track_file(name))
    (folder / "rewards.js").write_text(javascript(offered), encoding="utf-8")


def write(path: Path, document: dict[str, Any]) -> None:
    """A JSON file without blanks."""
    path.write_text(json.dumps(document, separators=(",", ":")), encoding="utf-8")


def _is_translated(source: str) -> bool:
    try:
        javascript({"it": source})
    except NotNumeric:
        return False
    return True


if __name__ == "__main__":
    main(Path(sys.argv[1]))
