"""What a teacher prints says what the page for teachers says, and fits the minutes and the slides."""

from __future__ import annotations

import html
import re
from pathlib import Path

import pytest

DOCS = Path(__file__).parents[2] / "docs"


def words(text: str) -> str:
    """Letters and digits alone: neither marks of Markdown nor tags, nor places to write in."""
    return " ".join(re.findall(r"\w+", html.unescape(re.sub(r"<[^>]*>", " ", text)).replace("____", " ")))


def section(title: str) -> list[str]:
    """Lines of a section of the page for teachers."""
    text = (DOCS / "teaching.md").read_text(encoding="utf-8")
    return text.partition(f"\n## {title}\n")[2].partition("\n## ")[0].strip().splitlines()


SHEET = (DOCS / "lab-sheet.html").read_text(encoding="utf-8")
SLIDES = (DOCS / "slides.html").read_text(encoding="utf-8")


@pytest.mark.parametrize("title", ["Answers", "Rubric"])
def test_tables_are_printed_as_they_stand(title: str) -> None:
    rows = [[words(cell) for cell in line.strip("|").split("|")] for line in section(title) if "--" not in line]
    rows = [row for row in rows if row[0][:3] != "The" and any(row)]
    assert len(rows) >= 5
    printed = re.findall(r"<tr>(.*?)</tr>", SHEET, re.DOTALL)
    found = [[words(cell) for cell in re.findall(r"<t[dh]>(.*?)</t[dh]>", row, re.DOTALL)] for row in printed]
    for row in rows:
        assert row in found


def test_the_lab_sheet_asks_what_the_page_says() -> None:
    asked = [line.partition(". ")[2] for line in section("Lab sheet") if re.match(r"\d\. ", line)]
    items = re.findall(r"<li>(.*?)</li>", SHEET, re.DOTALL)
    assert len(asked) == len(items) == 6
    for line, item in zip(asked[:5], items[:5], strict=True):
        assert words(line) == words(item)
    assert words(asked[5])[:60] == words(items[5])[:60]  # its lap times go into a table


def test_the_plan_adds_up_to_ninety_minutes_and_the_slides_keep_it() -> None:
    plan = [
        (int(start), int(end), words(what))
        for line in section("Ninety minutes")
        for start, end, what in re.findall(r"^\| (\d+)–(\d+) \| ([^|]+) \|", line)
    ]
    assert [start for start, _, _ in plan] == [0, *(end for _, end, _ in plan[:-1])]
    assert plan[-1][1] == 90
    assert [end - start for start, end, _ in plan] == [10, 15, 20, 20, 15, 10]
    for start, end, what in plan:
        printed = re.search(rf"<td>{start}–{end}</td><td>([^<]+)</td>", SHEET)
        assert printed
        assert words(printed[1]) == what
        assert f"{start}–{end} minutes" in SLIDES
    assert SLIDES.count("<section>") == 12


@pytest.mark.parametrize("name", ["slides", "lab-sheet"])
def test_what_is_printed_in_german_is_the_same(name: str) -> None:
    """Page for page and line for line: tags, code that is typed, minutes and numbers of slides and questions."""
    english, german = ((DOCS / f"{name}{ending}.html").read_text(encoding="utf-8") for ending in ("", ".de"))
    assert tags(german) == tags(english)
    for kept in (r"<style>.*?</style>", r"<pre>((?:def|return|if|racecraft).*?)</pre>", r"<code>(\W+?)</code>", r"\d+"):
        assert re.findall(kept, german, re.DOTALL) == re.findall(kept, english, re.DOTALL)
    assert [text for text in texts(german) if text in texts(english)] == []


def tags(page: str) -> list[str]:
    """Its elements, in their order, without their attributes."""
    return re.findall(r"</?(\w+)", page)


def texts(page: str) -> list[str]:
    """What is written in it in words, but for code."""
    body = re.sub(r"<(pre|code)>.*?</\1>", "", page.partition("<body>")[2], flags=re.DOTALL)
    return [text for text in re.findall(r">([^<>]+)<", body) if re.search("[a-z]{2} ", text)]
