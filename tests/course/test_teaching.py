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


ENDINGS = ("", ".de")
"""Of the pages in English and in German."""
SECTIONS = {
    "": {"plan": "Ninety minutes", "sheet": "Lab sheet", "answers": "Answers", "rubric": "Rubric"},
    ".de": {"plan": "Neunzig Minuten", "sheet": "Arbeitsblatt", "answers": "Antworten", "rubric": "Bewertung"},
}


def document(name: str) -> str:
    return (DOCS / name).read_text(encoding="utf-8")


def section(name: str, ending: str) -> list[str]:
    """Lines of a section of the page for teachers."""
    text = document(f"teaching{ending}.md")
    return text.partition(f"\n## {SECTIONS[ending][name]}\n")[2].partition("\n## ")[0].strip().splitlines()


@pytest.mark.parametrize("ending", ENDINGS)
@pytest.mark.parametrize("name", ["answers", "rubric"])
def test_tables_are_printed_as_they_stand(name: str, ending: str) -> None:
    rows = [[words(cell) for cell in line.strip("|").split("|")] for line in section(name, ending) if line[:1] == "|"]
    rows = [row for row in rows if any(row)]
    assert len(rows) >= 5
    printed = re.findall(r"<tr>(.*?)</tr>", document(f"lab-sheet{ending}.html"), re.DOTALL)
    found = [[words(cell) for cell in re.findall(r"<t[dh]>(.*?)</t[dh]>", row, re.DOTALL)] for row in printed]
    for row in rows:
        assert row in found


@pytest.mark.parametrize("ending", ENDINGS)
def test_the_lab_sheet_asks_what_the_page_says(ending: str) -> None:
    asked = [line.partition(". ")[2] for line in section("sheet", ending) if re.match(r"\d\. ", line)]
    items = re.findall(r"<li>(.*?)</li>", document(f"lab-sheet{ending}.html"), re.DOTALL)
    assert len(asked) == len(items) == 6
    for line, item in zip(asked[:5], items[:5], strict=True):
        assert words(line) == words(item)
    assert words(asked[5])[:60] == words(items[5])[:60]  # its lap times go into a table


@pytest.mark.parametrize("ending", ENDINGS)
def test_the_plan_adds_up_to_ninety_minutes_and_the_slides_keep_it(ending: str) -> None:
    plan = [
        (int(start), int(end), words(what))
        for line in section("plan", ending)
        for start, end, what in re.findall(r"^\| (\d+)–(\d+) \| ([^|]+) \|", line)
    ]
    assert [start for start, _, _ in plan] == [0, *(end for _, end, _ in plan[:-1])]
    assert plan[-1][1] == 90
    assert [end - start for start, end, _ in plan] == [10, 15, 20, 20, 15, 10]
    sheet, slides = document(f"lab-sheet{ending}.html"), document(f"slides{ending}.html")
    for start, end, what in plan:
        printed = re.search(rf"<td>{start}–{end}</td><td>([^<]+)</td>", sheet)
        assert printed
        assert words(printed[1]) == what
        assert re.search(rf"{start}–{end} (minutes|Minuten)", slides)
    assert slides.count("<section>") == 12


def test_the_page_for_teachers_is_the_same_in_german() -> None:
    """Section for section and row for row: what is typed, minutes, weeks and lessons."""
    english, german = (document(f"teaching{ending}.md") for ending in ENDINGS)
    for kept in (r"^#+ ", r"^```text\n(.*?)^```", r"^\| ([\d–]+(?:, |\b))", r"^\d\. ", r"____"):
        found = [re.findall(kept, text, re.DOTALL | re.MULTILINE) for text in (english, german)]
        assert found[0] == found[1]
    assert [line.count("|") for line in german.splitlines() if "|" in line] == [
        line.count("|") for line in english.splitlines() if "|" in line
    ]
    typed = [sorted(set(re.findall(r"`([^`\n]+)`", text.replace(" --language de", "")))) for text in (english, german)]
    assert typed[0] == typed[1]


@pytest.mark.parametrize("name", ["slides", "lab-sheet"])
def test_what_is_printed_in_german_is_the_same(name: str) -> None:
    """Page for page and line for line: tags, code that is typed, minutes and numbers of slides and questions."""
    english, german = (document(f"{name}{ending}.html") for ending in ENDINGS)
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
