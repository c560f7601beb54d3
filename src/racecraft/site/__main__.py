"""`python -m racecraft.site SITE`: writes what the page in a tab is told beside the page, and what it keeps offline."""

from __future__ import annotations

import ast
import hashlib
import json
import sys
from pathlib import Path
from typing import Any, Final

from racecraft.reward import load_preset, preset_names
from racecraft.reward.numeric import NotNumeric
from racecraft.site.javascript import javascript
from racecraft.site.plan import plan, track_file
from racecraft.track import track_names

FALLBACKS: Final = ("core/exact.wasm", "core/scalar.wasm")  # that few browsers need: not kept by all


def main(site: Path) -> None:
    """Write data/plan.json, data/rewards.js, a file a track, and files.js."""
    write_data(site / "data")
    write_files(site)


def write_files(site: Path) -> None:
    """What offline.js keeps in the browser, and a version that changes where one of them does."""
    names = sorted(path.relative_to(site).as_posix() for path in site.rglob("*") if path.is_file())
    kept = [name for name in names if name not in ("files.js", *FALLBACKS)]
    digest = hashlib.sha256()
    for name in kept:
        digest.update(name.encode() + b"\0" + hashlib.sha256((site / name).read_bytes()).digest())
    version = f"racecraft-{digest.hexdigest()[:16]}"
    (site / "files.js").write_text(f"self.VERSION = {json.dumps(version)};\nself.FILES = {json.dumps(kept)};\n")


def write_data(folder: Path) -> None:
    """Plan, tracks and rewards."""
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
