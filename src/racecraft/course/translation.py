"""A lesson's text in another language: a file beside it, with a block for each of its cells of text.

    <!-- 3f9a2c71 -->
    # Lektion 1 · Belohnung formt Verhalten

What stands in a block's first line is a digest of the English text that it translates, so a cell whose English has
changed since is shown in English again, and a test says that its block is old. The code is the lesson's own.
`python -m racecraft.course.untranslated 4` prints the cells that have no block yet.
"""

from __future__ import annotations

import hashlib
import re
from pathlib import Path
from typing import Final

_MARK: Final = re.compile(r"^<!-- ([0-9a-f]{8}) -->$\n?", re.MULTILINE)


def text_digest(source: str) -> str:
    """Of a cell's English text."""
    return hashlib.sha256(source.encode()).hexdigest()[:8]


def translation_path(lesson: Path, language: str) -> Path:
    """Where the text of a lesson's file is kept in another language."""
    return lesson.parent / language / f"{lesson.stem}.md"


def read_translation(path: Path) -> dict[str, str]:
    """Texts by the digest of the English ones, in the order of the file; nothing where there is no file.

    Raises:
        OSError: It cannot be read.
    """
    if not path.is_file():
        return {}
    _, *parts = _MARK.split(path.read_text(encoding="utf-8"))
    return {digest: text.strip("\n") for digest, text in zip(parts[::2], parts[1::2], strict=True)}
