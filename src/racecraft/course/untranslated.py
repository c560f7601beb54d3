"""What of a lesson is still to be translated: its cells of text without a block, as blocks to be filled in.

python -m racecraft.course.untranslated 4
"""

from __future__ import annotations

import argparse

from racecraft.course.lesson import Lesson, find_lesson
from racecraft.course.translation import read_translation, text_digest, translation_path


def untranslated(lesson: Lesson, language: str) -> list[str]:
    """Blocks that a lesson's file lacks, with the English text in them."""
    there = read_translation(translation_path(lesson.path, language))
    texts = [cell.source for cell in lesson.cells() if cell.kind == "markdown"]
    return [f"<!-- {text_digest(text)} -->\n{text}\n" for text in texts if text_digest(text) not in there]


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("lesson", type=int)
    parser.add_argument("--language", default="de")
    given = parser.parse_args()
    for block in untranslated(find_lesson(given.lesson), given.language):
        print(block)  # noqa: T201
