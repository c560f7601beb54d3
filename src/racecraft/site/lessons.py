"""The lessons as files: what the site's page shows of them, without a server.

lessons/ -> course.page -> *lessons* -> build/site/lessons -> web/src/course/site
"""

from __future__ import annotations

import json
import shutil
from pathlib import Path

from racecraft.course import lessons
from racecraft.course.page import facts_of, page_of
from racecraft.course.shown import Drawn, picture_path


def write_lessons(folder: Path) -> None:
    """A list, and a file and a folder of pictures for each lesson."""
    folder.mkdir(parents=True, exist_ok=True)
    found = lessons()
    _write(folder / "index.json", [facts_of(lesson).model_dump() for lesson in found])
    for lesson in found:
        page = page_of(lesson)
        _write(folder / f"{page.name}.json", page.model_dump())
        for output in (one for cell in page.cells for one in cell.outputs):
            if isinstance(output, Drawn):
                _copy(picture_path(lesson, output.name), folder / page.name)
                if output.german:
                    _copy(picture_path(lesson, output.name, "de"), folder / "de" / page.name)


def _copy(picture: Path, folder: Path) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    shutil.copyfile(picture, folder / picture.name)


def _write(path: Path, document: object) -> None:
    path.write_text(json.dumps(document, separators=(",", ":")), encoding="utf-8")
