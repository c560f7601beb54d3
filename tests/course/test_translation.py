"""The lessons in German: a block for every cell of text, of the English that is there now, and the same code."""

from __future__ import annotations

import re
import shutil
from dataclasses import replace
from pathlib import Path

import pytest

from racecraft.course import Lesson, checks_of, lessons
from racecraft.course.page import page_of
from racecraft.course.translation import read_translation, text_digest, translation_path
from racecraft.course.untranslated import untranslated


@pytest.fixture(params=lessons(), ids=lambda lesson: lesson.path.stem)
def lesson(request: pytest.FixtureRequest) -> Lesson:
    return request.param


def test_every_text_has_its_german_in_the_same_order(lesson: Lesson) -> None:
    english, german = lesson.cells(), lesson.cells("de")
    texts = [cell.source for cell in english if cell.kind == "markdown"]
    assert untranslated(lesson, "de") == []
    assert list(read_translation(translation_path(lesson.path, "de"))) == [text_digest(text) for text in texts]
    assert [cell for cell in german if cell.kind == "code"] == [cell for cell in english if cell.kind == "code"]
    assert [(cell.kind, cell.title, cell.line) for cell in german] == [
        (one.kind, one.title, one.line) for one in english
    ]
    page = page_of(lesson).cells
    assert [cell.german for cell in page if cell.kind == "text"] == [
        cell.source for cell in german if cell.kind == "markdown"
    ]
    verdicts = [cell.german.split(".")[0] for cell in page if cell.kind == "code" and cell.german]
    assert verdicts == ["✗ Noch nicht"] * len(checks_of(lesson.number))


def test_the_german_begins_and_ends_as_the_lesson_does(lesson: Lesson) -> None:
    german, facts = lesson.cells("de"), lesson.facts
    title, _, goal = german[0].source.partition("\n")
    assert title == f"# Lektion {lesson.number} · {facts.title.de}"
    assert " ".join(goal.split()).startswith(f"**Ziel.** {facts.goal.de}")
    assert f"`racecraft lessons quiz {lesson.number} --language de`" in " ".join(german[-1].source.split())


def signs(text: str) -> dict[str, list[str]]:
    """What is the same in both languages: code, formulas, numbers, addresses, headings, rows and items."""
    text = text.replace(" --language de", "")
    plain = re.sub(r"\\text\{[^}]*\}", "", text)  # words in formulas
    formulas = re.findall(r"\$\$.+?\$\$|\$[^$\n]+\$", plain, re.DOTALL)
    return {
        "code": sorted(" ".join(one.split()) for one in re.findall(r"`([^`]+)`", text)),
        "formulas": sorted(" ".join(one.split()) for one in formulas),
        "numbers": sorted(re.sub(r"[.,]", "", one) for one in re.findall(r"\d+(?:[.,]\d+)*", plain)),
        "addresses": re.findall(r"\]\((\S+)\)", text),
        "lines": re.findall(r"^(?:#+|\||>|-|\d+\.) ", text, re.MULTILINE),
    }


def test_code_formulas_and_numbers_are_those_of_the_english(lesson: Lesson) -> None:
    for english, german in zip(lesson.cells(), lesson.cells("de"), strict=True):
        assert signs(german.source) == signs(english.source)


def test_a_text_that_has_changed_since_is_english(tmp_path: Path) -> None:
    lesson = lessons()[0]
    here = replace(lesson, path=tmp_path / lesson.path.name)
    target = translation_path(here.path, "de")
    target.parent.mkdir()
    shutil.copyfile(translation_path(lesson.path, "de"), target)
    here.path.write_text(lesson.path.read_text().replace("A dog is not told", "A cat is not told"))
    (block,) = untranslated(here, "de")
    assert "A cat is not told" in block
    first, *others = here.cells("de")
    assert first == here.cells()[0]
    assert others == lesson.cells("de")[1:]
    target.unlink()
    assert here.cells("de") == here.cells()
