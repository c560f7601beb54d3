"""`python -m racecraft.site SITE PYODIDE`: what a page in a tab is told, its Python, what it keeps offline."""

from __future__ import annotations

import ast
import hashlib
import json
import shutil
import sys
from pathlib import Path
from typing import Any, Final

from racecraft.reward import load_preset, preset_names
from racecraft.site.calls import SHIPPED
from racecraft.site.javascript import javascript
from racecraft.site.lessons import write_lessons
from racecraft.site.plan import plan, told_medals, track_file
from racecraft.site.starter import told_starter
from racecraft.track import track_names
from racecraft.track.library import course

GENERATED: Final = tuple(f"generated:{seed}" for seed in range(1, 13))
"""Tracks of the generator that the page has beside the library's: it cannot draw others itself."""

PYTHON: Final = ("pyodide.mjs", "pyodide.asm.mjs", "pyodide.asm.wasm", "python_stdlib.zip")


def main(site: Path, pyodide: Path) -> None:
    """Write data/plan.json, data/rewards.js, data/starter.bin, a file a track, the lessons, python/, and files.js."""
    write_data(site / "data")
    write_lessons(site / "lessons")
    write_python(site / "python", pyodide)
    write_files(site)


def write_files(site: Path) -> None:
    """What offline.js keeps in the browser, and a version that changes where one of them does."""
    names = sorted(path.relative_to(site).as_posix() for path in site.rglob("*") if path.is_file())
    kept = [name for name in names if name != "files.js"]
    digest = hashlib.sha256()
    for name in kept:
        digest.update(name.encode() + b"\0" + hashlib.sha256((site / name).read_bytes()).digest())
    version = f"racecraft-{digest.hexdigest()[:16]}"
    (site / "files.js").write_text(f"self.VERSION = {json.dumps(version)};\nself.FILES = {json.dumps(kept)};\n")


def write_data(folder: Path) -> None:
    """Plan, tracks, rewards, and a policy to look at."""
    (folder / "tracks").mkdir(parents=True, exist_ok=True)
    sources = {name: load_preset(name) for name in preset_names()}
    rewards = [
        {
            "name": name,
            "description": (ast.get_docstring(ast.parse(source)) or "").split("\n")[0],
            "source": source,
            "seesObjects": '"objects_' in source,
        }
        for name, source in sources.items()
    ]
    starter, weights = told_starter()
    (folder / "starter.bin").write_bytes(weights.astype("<f2").tobytes())
    tracks = [*track_names(), *GENERATED]
    medals = {name: told_medals(name) for name in track_names()}
    titles = {name: course(name).display_name for name in track_names()}
    told = {"starter": starter, "tracks": tracks, "titles": titles, "medals": medals, "rewards": rewards}
    write(folder / "plan.json", {**plan(), **told})
    for name in tracks:
        write(folder / "tracks" / f"{name.replace(':', '-')}.json", track_file(name))
    (folder / "rewards.js").write_text(javascript(sources), encoding="utf-8")


def write_python(folder: Path, pyodide: Path) -> None:
    """The interpreter, without the list of packages that it could load, and our files that it runs."""
    folder.mkdir(exist_ok=True)
    for name in PYTHON:
        shutil.copy(pyodide / name, folder / name)
    lock = json.loads((pyodide / "pyodide-lock.json").read_text(encoding="utf-8"))
    write(folder / "pyodide-lock.json", {**lock, "packages": {}})
    write(folder / "racecraft.json", python_files())


def python_files() -> dict[str, str]:
    """The part of Racecraft that a page runs, by path; packages are empty, as theirs import all that a page has not."""
    source = Path(__file__).parents[1]
    packages = sorted({Path(name).parent.as_posix() for name in SHIPPED})
    files = {Path("racecraft", name, "__init__.py").as_posix(): "" for name in packages}
    return files | {f"racecraft/{name}": (source / name).read_text(encoding="utf-8") for name in SHIPPED}


def write(path: Path, document: dict[str, Any]) -> None:
    """A JSON file without blanks."""
    path.write_text(json.dumps(document, separators=(",", ":")), encoding="utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
