"""The course's parts: cells, notebooks, exercises, quizzes, progress, pictures."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image
from pydantic import ValidationError
from said_in_lessons import FIGURES, STATEMENTS

from racecraft.course import check, checks_of, find_lesson, lessons, read_cells, read_progress, show, to_notebook
from racecraft.course import progress as progress_file
from racecraft.course.lesson import Facts, Lesson
from racecraft.course.phrases import Phrases, german_label
from racecraft.course.pictures import bar_chart, line_chart
from racecraft.course.quiz import LANGUAGES
from racecraft.course.show import Picture
from racecraft.course.shown import Shown, digest_of, keep_shown, picture_path, read_shown, shown_path
from racecraft.errors import ConfigError

TEXT = """\
import sys

# %% [markdown]
# # A title
#
# Text with `code`.

# %% exercise one

def answer():
    # %% is no mark here
    return 1


# %%

# %%
print(answer())
"""


def test_cells_are_read() -> None:
    cells = read_cells(TEXT)
    assert [(cell.kind, cell.title) for cell in cells] == [
        ("code", ""),
        ("markdown", ""),
        ("code", "exercise one"),
        ("code", ""),
    ]
    assert cells[1].source == "# A title\n\nText with `code`."
    assert cells[2].source == "def answer():\n    # %% is no mark here\n    return 1"
    for cell in cells:
        first = TEXT.splitlines()[cell.line - 1]
        assert first.removeprefix("# ") == cell.source.splitlines()[0]


def test_a_notebook_holds_the_cells() -> None:
    cells = read_cells(TEXT)
    document = json.loads(json.dumps(to_notebook(cells)))
    assert (document["nbformat"], document["nbformat_minor"]) == (4, 5)
    assert ["".join(cell["source"]) for cell in document["cells"]] == [cell.source for cell in cells]
    assert len({cell["id"] for cell in document["cells"]}) == len(cells)


@pytest.mark.parametrize("number", [lesson.number for lesson in lessons()])
def test_a_lesson_is_complete(number: int) -> None:
    lesson = find_lesson(number)
    cells, facts = lesson.cells(), lesson.facts
    assert cells[0].kind == "markdown"
    title = cells[0].source.splitlines()[0]
    assert title == f"# Lesson {number} · {facts.title.en}"
    assert f"**Goal.** {facts.goal.en}" in " ".join(cells[0].source.split())
    assert f"`racecraft lessons quiz {number}`" in " ".join(cells[-1].source.split())
    assert 0 < facts.seconds <= 150
    assert len(facts.questions) >= 3
    for question in facts.questions:
        assert len({choice.text.en for choice in question.choices}) == len(question.choices)
        assert all(question.text[language] for language in LANGUAGES)
    assert len({question.answer for question in facts.questions}) > 1, "always the same letter"
    exercises = [cell.title.removeprefix("exercise ") for cell in cells if cell.title.startswith("exercise ")]
    assert exercises == list(checks_of(number)) != []
    assert any("show(" in cell.source for cell in cells if cell.kind == "code")
    for cell in cells:
        if cell.kind == "code":
            compile(cell.source, lesson.path.name, "exec")


@pytest.mark.costly
@pytest.mark.parametrize("number", [lesson.number for lesson in lessons()])
def test_answers_are_judged(number: int) -> None:
    """The lesson's own cell that asks is run after each answer."""
    lesson = find_lesson(number)
    code = [cell for cell in lesson.cells() if cell.kind == "code"]
    asks = {
        cell.title.removeprefix("exercise "): code[place + 1].source
        for place, cell in enumerate(code)
        if cell.title.startswith("exercise ")
    }
    refused: dict[str, list[str]] = {name: [] for name in asks}
    accepted = set()
    for answer in read_cells(lesson.answers.read_text(encoding="utf-8")):
        kind, name = answer.title.partition(":")[0].split()
        names: dict[str, Any] = {"check": check}
        exec(compile(answer.source, f"{kind} {name}", "exec"), names)
        exec(compile(asks[name], f"check of {name}", "exec"), names)
        verdict = names["verdict"]
        assert verdict.is_right == (kind == "right"), f"{answer.title}: {verdict}"
        assert Phrases.of("de", "verdicts").translated(verdict.sentence), f"not in German: {verdict.sentence}"
        if kind == "wrong":
            assert len(verdict.sentence) > 30
            refused[name].append(verdict.sentence)
        else:
            accepted.add(name)
    assert accepted == set(asks)
    for name, sentences in refused.items():
        assert len(set(sentences)) >= 3, f"{name} has fewer than three hints"
    assert read_progress().exercises == {f"{number}.{name}" for name in asks}


def test_an_answer_that_fails_is_told_why() -> None:
    verdict = check("1.inside", lambda params: params["spede"])
    assert not verdict.is_right
    assert "Did you mean 'speed'?" in verdict.sentence
    assert not check("1.inside", lambda params: 1.0).is_right
    assert "cannot be tried" in check("1.inside", lambda params: "much").sentence
    assert not read_progress().exercises


@pytest.mark.parametrize("name", ["1.outside", "99.inside", "inside", "1", "x.y", "01.inside", "\u0661.inside"])
def test_an_exercise_that_is_none(name: str) -> None:
    with pytest.raises(ConfigError, match="There is no exercise"):
        check(name, None)


def test_a_lesson_that_is_none() -> None:
    with pytest.raises(ConfigError, match="There is no lesson 77; there are 1"):
        find_lesson(77)


def words(text: str) -> dict[str, str]:
    return {"en": text, "de": text}


@pytest.mark.parametrize(
    "choices",
    [
        [("a", True)],
        [("a", True), ("b", True)],
        [("a", False), ("b", False)],
        [(str(place), place == 0) for place in range(6)],
        [("", True), ("b", False)],
    ],
)
def test_a_quiz_that_is_none(choices: list[tuple[str, bool]]) -> None:
    question = {
        "text": words("?"),
        "choices": [{"text": words(text), "why": words("so"), "right": right} for text, right in choices],
    }
    with pytest.raises(ValidationError):
        Facts.model_validate({"title": words("t"), "goal": words("g"), "seconds": 1, "questions": [question]})


def test_progress_is_kept() -> None:
    assert read_progress().exercises == set()
    progress_file.record_exercise("1.inside")
    progress_file.record_quiz(3, 0.75)
    os.utime(progress_file.progress_path(), (0, 0))
    progress_file.record_exercise("1.inside")
    progress_file.record_quiz(3, 0.25)
    assert progress_file.progress_path().stat().st_mtime == 0  # nothing new: what is written is left
    assert read_progress().to_dict() == {"exercises": ["1.inside"], "quizzes": {"3": 0.75}}


@pytest.mark.costly
def test_two_processes_keep_what_both_solve() -> None:
    solves = "import sys; from racecraft.course.progress import record_exercise, record_quiz\n"
    solves += "print(flush=True); input()\n"
    solves += "for number in range(100): record_exercise(f'{number}.{sys.argv[1]}'); record_quiz(number, 0.5)"
    both = [
        subprocess.Popen([sys.executable, "-c", solves, name], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        for name in ("ada", "bob")
    ]
    for process in both:
        assert process.stdout is not None
        assert process.stdout.readline() == "\n"
    for process in both:
        print(file=process.stdin, flush=True)
    for process in both:
        process.communicate()
        assert process.returncode == 0
    kept = read_progress()
    assert len(kept.exercises) == 200
    assert len(kept.quizzes) == 100


@pytest.mark.parametrize("text", ["", "[]", '{"exercises": 3}', '{"exercises": [], "more": 1}', "\xff"])
def test_damaged_progress_is_told(text: str) -> None:
    path = progress_file.progress_path()
    path.parent.mkdir(parents=True)
    path.write_bytes(text.encode("latin-1"))
    with pytest.raises(ConfigError, match="no progress that can be read"):
        read_progress()


def test_progress_that_cannot_be_read_is_told() -> None:
    path = progress_file.progress_path()
    path.mkdir(parents=True)
    with pytest.raises(ConfigError, match=r"lessons\.json cannot be read: Is a directory\."):
        read_progress()
    path.rmdir()
    if hasattr(os, "mkfifo"):
        os.mkfifo(path)
        with pytest.raises(ConfigError, match="no regular file"):
            read_progress()


def test_an_answer_is_right_even_where_that_cannot_be_kept() -> None:
    def backup(table: dict[int, list[tuple[float, int, float, bool]]], values: Any, gamma: float) -> float:
        worth = [sum(p * (pay + gamma * values[to] * (not over)) for p, to, pay, over in table[a]) for a in table]
        return max(worth)

    path = progress_file.progress_path()
    path.parent.mkdir(parents=True)
    path.write_text("{")
    with pytest.warns(UserWarning, match="It is right, but that cannot be kept: .*no progress that can be read"):
        assert check("4.bellman", backup).is_right
    path.unlink()
    path.mkdir()
    with pytest.warns(UserWarning, match="It is right, but that cannot be kept: .*Is a directory"):
        assert check("4.bellman", backup).is_right


def test_pictures_are_saved_where_the_script_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("sys.argv", ["/somewhere/09_some_lesson.py"])
    still = show(line_chart("A curve", {"rising": np.arange(5.0)}, subtitle="ε is 0.1"), "curve")
    assert still == Path("runs/09_some_lesson/curve.png")
    with Image.open(tmp_path / still) as image:
        assert image.size == (1200, 680)
    frames = [Image.new("RGB", (32, 16), color) for color in ("red", "green", "blue")]
    moving = show(Picture(frames, seconds=0.2), "film")
    with Image.open(tmp_path / moving) as image:
        assert (moving.suffix, image.n_frames) == (".webp", 3)
    for name in ("", "a/b", "../up", "a b"):
        with pytest.raises(ConfigError, match="picture's name"):
            show(Picture(frames), name)
    (tmp_path / "runs/09_some_lesson/taken.webp").mkdir()
    monkeypatch.setenv("RACECRAFT_LANGUAGE", "de")
    with pytest.warns(UserWarning, match=r"^Das Bild runs/.*/taken\.webp lässt sich nicht aufheben: Is a directory\.$"):
        assert show(Picture(frames), "taken") is None
    (tmp_path / "runs/09_some_lesson/full.webp").symlink_to("/dev/full")
    with pytest.warns(UserWarning, match="No space left on device"):
        show(Picture(frames), "full")


def colored(picture: Picture, color: tuple[int, int, int]) -> int:
    """Pixels of a colour."""
    return int((np.asarray(picture.frames[0]) == color).all(axis=-1).sum())


def test_charts_show_what_they_are_given() -> None:
    from racecraft.course.pictures.sheet import COLORS

    small, large = bar_chart("Bars", {"a": 1.0, "b": 4.0}), bar_chart("Bars", {"a": 4.0, "b": 4.0})
    assert colored(large, COLORS[0]) / colored(small, COLORS[0]) == pytest.approx(8 / 5, rel=0.02)
    chart = line_chart("Curve", {"a": np.array([0.0, np.nan, 1.0, 1.0]), "b": ([0, 3], [0.5, 0.5])})
    assert colored(chart, COLORS[0]) > 200
    assert colored(chart, COLORS[1]) > 1000


@pytest.mark.parametrize("number", [lesson.number for lesson in lessons()])
def test_what_a_lesson_showed_is_of_the_code_that_it_has(number: int) -> None:
    lesson = find_lesson(number)
    shown = Shown.model_validate_json(shown_path(lesson).read_bytes())
    assert read_shown(lesson) == shown, "a picture is missing"
    assert shown.digest == digest_of(lesson.cells()), f"run python -m racecraft.course.shown {number}"
    printed = "\n".join(one.text for outputs in shown.outputs.values() for one in outputs if one.kind == "text")
    learned = [float(seconds) for seconds in re.findall(r"\b(?:in|for) ([\d.]+) s\b", printed)]
    assert sum(learned) <= lesson.facts.seconds, "its parts took longer than it is said to"
    drawn = [one for outputs in shown.outputs.values() for one in outputs if one.kind == "picture"]
    for one in drawn:
        assert one.german, f"run python -m racecraft.course.shown {number} --language de"
        assert one.german.description == german_label(one.description) != one.description
        for language, sight in (("en", one), ("de", one.german)):
            with Image.open(picture_path(lesson, one.name, language)) as image:
                assert image.size == (sight.width, sight.height)
    for language in ("en", "de"):
        kept = {path.name for path in picture_path(lesson, "", language).parent.iterdir()}
        assert kept == {f"{one.name}.webp" for one in drawn}
    written = {picture_path(lesson, one.name, language).read_bytes() for one in drawn for language in ("en", "de")}
    assert len(written) == 2 * len(drawn), "one with the words of the other language"


@pytest.mark.parametrize("number", [lesson.number for lesson in lessons()])
def test_what_the_text_says_of_the_run_is_so(number: int) -> None:
    lesson = find_lesson(number)
    text = " ".join(" ".join(cell.source for cell in lesson.cells() if cell.kind == "markdown").split())
    shown = [one for outputs in read_shown(lesson).outputs.values() for one in outputs]
    printed = "\n".join(one.text for one in shown if one.kind == "text")
    for figure in (one for one in FIGURES if one.lesson == number):
        said, came = re.search(figure.text, text), re.search(figure.printed, printed)
        assert said, figure.text
        assert came, figure.printed
        assert said.groups() == came.groups()
    statements = [one for one in STATEMENTS if one.lesson == number]
    assert statements or any(one.lesson == number for one in FIGURES)
    for statement in statements:
        assert statement.text in text
        assert statement.holds(printed), statement.text


def test_german_pictures_of_other_code_than_was_shown_are_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    lesson = Lesson(number=4, path=tmp_path / "04_tiny.py")
    code = """# %%
from racecraft.course import show
from racecraft.course.pictures import bar_chart

show(bar_chart("Laps", {"hole": 1.0}), "before")
"""
    lesson.path.write_text(code)
    shown_path(lesson).parent.mkdir()
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("sys.argv", [str(lesson.path)])
    (one,) = keep_shown(lesson).outputs[0]
    assert (one.kind, one.name, one.german is not None) == ("picture", "before", True)
    lesson.path.write_text(code.replace("before", "after"))
    with pytest.raises(ConfigError, match="lesson 4 showed in English is of other code") as refused:
        keep_shown(lesson, ("de",))
    assert refused.value.hint == "First run python -m racecraft.course.shown 4 without --language."
    assert not picture_path(lesson, "after", "de").exists()
    (one,) = keep_shown(lesson, ("en",)).outputs[0]
    assert (one.name, one.german) == ("after", None)
    (one,) = keep_shown(lesson, ("de",)).outputs[0]
    assert (one.name, one.german is not None) == ("after", True)
    named = one.model_copy(update={"name": "renamed"})
    shown = Shown(digest=digest_of(lesson.cells()), outputs={0: [named]})
    shown_path(lesson).write_text(shown.model_dump_json())
    shutil.copyfile(picture_path(lesson, "after"), picture_path(lesson, "renamed"))
    with pytest.raises(ConfigError, match="of other code"):
        keep_shown(lesson, ("de",))


def test_without_its_pictures_a_lesson_shows_its_words(tmp_path: Path) -> None:
    """As in a wheel."""
    lesson = find_lesson(4)
    here = replace(lesson, path=tmp_path / lesson.path.name)
    shown_path(here).parent.mkdir()
    shown_path(here).write_bytes(shown_path(lesson).read_bytes())
    kinds = {one.kind for outputs in read_shown(here).outputs.values() for one in outputs}
    assert kinds == {"text"}
    picture_path(here, "lake").parent.mkdir()
    shutil.copyfile(picture_path(lesson, "lake"), picture_path(here, "lake"))  # and none with German words
    drawn = [one for outputs in read_shown(here).outputs.values() for one in outputs if one.kind == "picture"]
    assert [(one.name, one.german) for one in drawn] == [("lake", None)]
