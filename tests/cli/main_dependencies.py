"""A folder that holds racecraft and its main dependencies only, and what runs many commands of it in one process."""

from __future__ import annotations

import shutil
import sysconfig
from importlib import metadata
from pathlib import Path

from packaging.requirements import Requirement

import racecraft

RUNNER = """
import contextlib, io, json, sys
from racecraft import cli
told = []
for arguments in json.load(sys.stdin):
    sys.argv, out = ["racecraft", *arguments], io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(out):
        try:
            cli.main()
        except SystemExit as ended:
            status = ended.code
    told.append([status, out.getvalue()])
print(json.dumps(told))
"""
"""Takes lists of arguments as JSON; prints the status and the words of each."""


def main_packages(*more: str) -> set[str]:
    """Names of the distributions that racecraft needs without extras, and some more, and of all that those need."""
    found: set[str] = set()
    waiting = ["racecraft", *more]
    while waiting:
        name = waiting.pop()
        if name in found:
            continue
        found.add(name)
        for text in metadata.requires(name) or ():
            requirement = Requirement(text)
            if requirement.marker is None or requirement.marker.evaluate({"extra": ""}):
                waiting.append(requirement.name.lower().replace("_", "-"))
    return found


def link_main_packages(folder: Path) -> None:
    """Make the folder; the interpreter that is to see only it is started with ``-S`` and this as its ``PYTHONPATH``."""
    site = Path(sysconfig.get_paths()["purelib"])
    for name in main_packages() - {"racecraft"}:
        for file in metadata.files(name) or ():
            top = file.parts[0]
            if top not in ("..", "bin", "__pycache__") and not (folder / top).exists():
                (folder / top).symlink_to(site / top)
    for place in (Path(racecraft.__file__).parent, site / "racecraft"):  # sources, and what was built
        unwanted = shutil.ignore_patterns("__pycache__", "pages")
        shutil.copytree(place, folder / "racecraft", ignore=unwanted, dirs_exist_ok=True)
    about = next(site.glob("racecraft-*.dist-info"))
    (folder / about.name).symlink_to(about)
