"""What checks and pictures say in German: each of their sentences, nothing that none says, and in whose language."""

from __future__ import annotations

import ast
import json
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from racecraft.course import check, exercises
from racecraft.course.lesson import lessons, lessons_folder
from racecraft.course.phrases import LANGUAGE, Phrases, german_label, label_in, said_in
from racecraft.course.pictures import bar_chart
from racecraft.course.pictures.sheet import spelled
from racecraft.course.show import NOT_KEPT
from racecraft.course.shown import read_shown
from racecraft.course.verdict import MARKS, right, wrong

BORROWED = {  # what other rooms say, and a check passes on
    "The reward callable returned None; every path through the function must return a number.",
    "The reward callable returned the text {}; a reward is a number.",
    "The reward callable returned {}; a reward is a finite number within ±100000.",
    "It was called with params = {}",
    "Did you mean {}?",
}
GERMAN = json.loads((lessons_folder() / "de/verdicts.json").read_text(encoding="utf-8"))
LABELS = json.loads((lessons_folder() / "de/labels.json").read_text(encoding="utf-8"))


def sentence(node: ast.expr) -> str:
    """A text of the source, with ``{}`` for what is filled in."""
    match node:
        case ast.Constant(value=str(text)):
            return text
        case ast.JoinedStr(values=parts):
            return "".join(str(part.value) if isinstance(part, ast.Constant) else "{}" for part in parts)
    return ""


def sentences(path: Path) -> Iterator[str]:
    """What a module of checks says: its texts of several words, but for keys and docstrings."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    left: set[ast.AST] = set()
    for node in ast.walk(tree):
        match node:
            case ast.Subscript(slice=inner) | ast.Expr(value=ast.Constant() as inner):
                left.update(ast.walk(inner))
            case ast.JoinedStr():
                left.update(inner for inner in ast.walk(node) if isinstance(inner, ast.Constant))
            case ast.Raise(exc=ast.Call() as inner):
                left.update(ast.walk(inner))
    nodes = (node for node in ast.walk(tree) if isinstance(node, ast.expr) and node not in left)
    yield from (text for node in nodes if " " in (text := sentence(node)))


def test_every_sentence_of_a_check_is_there_in_german_and_no_other() -> None:
    modules = Path(exercises.__file__).parent.glob("*.py")
    said = {text for path in modules for text in sentences(path)} | set(MARKS.values()) | {NOT_KEPT} | BORROWED
    assert len(said) > 130
    assert sorted(said - set(GERMAN)) == []
    assert sorted(set(GERMAN) - said) == []


@pytest.mark.parametrize(
    ("filled_in", "german"),
    [("0.02, 0.5, 1,000.25", "0,02; 0,5; 1.000,25"), ("3, 4, 5", "3, 4, 5"), ("0.5", "0,5"), ("a, 0.5", "a, 0.5")],
)
def test_several_numbers_are_written_as_germans_do(filled_in: str, german: str) -> None:
    assert Phrases({"It pays {}.": "Sie zahlt {}."}).translated(f"It pays {filled_in}.") == f"Sie zahlt {german}."


@pytest.mark.parametrize("english", GERMAN)
def test_what_is_filled_in_is_filled_in_there_too(english: str) -> None:
    german = GERMAN[english]
    assert german.count("{}") == english.count("{}")
    assert german.endswith(" ") == english.endswith(" ")
    begun = english.endswith(" ")
    told = Phrases.of("de", "verdicts").translated(filled(english) + "The original has 147." * begun)
    assert told == filled(german) + "Das Original hat 147." * begun


def filled(text: str) -> str:
    """With 0 in its first gap, 1 in the second."""
    return text.replace("{}", "{:d}").format(*range(9))


def test_a_verdict_is_said_in_the_language_of_the_notebook(monkeypatch: pytest.MonkeyPatch) -> None:
    verdict = wrong("It finds 2 of 8. It always returns 3: look at the pictures, images[i] is the i-th of them.")
    german = "✗ Noch nicht. Sie findet 2 von 8. Sie gibt immer 3 zurück: Sieh dir die Bilder an, "
    german += "images[i] ist das i-te davon."
    monkeypatch.delenv("JPY_SESSION_NAME", raising=False)
    monkeypatch.delenv(LANGUAGE, raising=False)
    assert str(verdict).startswith("✗ Not yet. It finds 2 of 8. It always")
    monkeypatch.setenv(LANGUAGE, "de")
    assert str(verdict) == german
    assert str(right("Something that nobody has translated.")) == "✓ Gelöst. Something that nobody has translated."
    monkeypatch.setenv("JPY_SESSION_NAME", "/home/ada/lessons/02_three_kinds.ipynb")
    assert str(verdict).startswith("✗ Not yet."), "an English notebook beside German ones"
    monkeypatch.setenv("JPY_SESSION_NAME", "/home/ada/lessons/02_three_kinds.de.ipynb")
    assert str(verdict) == german
    assert str(check("2.odd", lambda _: "none")).startswith("✗ Noch nicht. Sie gab 'none' zurück;")


def test_what_stands_in_a_gap_is_german_too() -> None:
    told = said_in("de", "Now the right way earns -0.25 a second, too: nothing is left to drive for.")
    assert (
        told == "Jetzt bringt auch die richtige Richtung -0,25 je Sekunde: Es bleibt nichts, wofür man fahren könnte."
    )
    assert said_in("en", "The original has 147.") == "The original has 147."


def test_every_word_on_a_picture_is_there_in_german_and_no_other() -> None:
    words = {word for lesson in lessons() for word in read_shown(lesson).words}
    assert len(words) > 200
    assert [word for word in words if german_label(word) is None] == []
    gaps = {gap for word in words for label in LABELS for gap in found_in(label, word)}
    unused = [label for label in LABELS if not any(matches(label, word) for word in words | gaps)]
    # how a learner's own car fares may be any of these, and not how ours did
    assert [label for label in unused if not label.startswith("{} of {} laps")] == []
    for english, german in LABELS.items():
        assert german.count("{}") == english.count("{}"), english


def matches(label: str, word: str) -> re.Match[str] | None:
    return re.fullmatch("(.*)".join(map(re.escape, label.split("{}"))), word)


def found_in(label: str, word: str) -> tuple[str, ...]:
    found = matches(label, word)
    return found.groups() if found else ()


@pytest.mark.parametrize(
    ("english", "german"),
    [
        ("1,234.5", "1.234,5"),
        ("-0.25", "-0,25"),
        ("12,000", "12.000"),
        ("74.0", "74,0"),
        ("7", "7"),
        ("12 of 12 laps, 8.4 s a lap", "12 von 12 Runden, 8,4 s die Runde"),
        ("many tracks, as always", "viele Strecken, wie immer"),
        ("λ = 0.95", "λ = 0,95"),
        ("v1.2.3", "v1.2.3"),
        ("what nobody has translated", "what nobody has translated"),
    ],
)
def test_numbers_and_labels_are_written_as_germans_do(english: str, german: str) -> None:
    assert label_in("de", english) == german
    assert label_in("en", english) == english


def test_a_picture_is_drawn_in_the_learners_language(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("JPY_SESSION_NAME", raising=False)
    drawn = {}
    for language in ("en", "de"):
        monkeypatch.setenv(LANGUAGE, language)
        drawn[language] = bar_chart("Your car", {"laps": 12.5, "reward": 3.0})
    assert drawn["en"].encoded() != drawn["de"].encoded()
    assert drawn["en"].words == drawn["de"].words == ["Your car", "laps", "12.5", "reward", "3.0"]
    monkeypatch.setenv(LANGUAGE, "en")
    assert bar_chart("Dein Auto", {"Runden": 12.5, "Belohnung": 3.0}).encoded() != drawn["de"].encoded(), "its numbers"
    assert bar_chart("Your car", {"laps": 12.5, "reward": 3.0}).encoded() == drawn["en"].encoded()


def test_there_is_a_letter_for_everything_that_is_written() -> None:
    from PIL import ImageFont

    font = ImageFont.load_default(size=40)
    missing = bytes(font.getmask("\uffff"))
    words = [*(word for lesson in lessons() for word in read_shown(lesson).words), *LABELS.values()]
    letters = set(spelled("".join(words))) - set("äöüÄÖÜ")  # which the canvas puts dots on
    assert [letter for letter in letters if letter != " " and bytes(font.getmask(letter)) == missing] == []
