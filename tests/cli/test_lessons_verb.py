"""`racecraft lessons` as it is typed: the list, a quiz, notebooks, a lesson that stops."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest
from command_line import Run

from racecraft.course import find_lesson, lessons, record_quiz


@pytest.fixture(autouse=True)
def progress_of_its_own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "data"))


def letters(number: int, *, is_right: bool = True) -> str:
    questions = find_lesson(number).facts.questions
    places = [question.answer if is_right else (question.answer + 1) % len(question.choices) for question in questions]
    return "".join("abcde"[place] for place in places)


def test_the_list(racecraft: Run) -> None:
    record_quiz(1, 0.5)
    told = racecraft("lessons", "--json").document
    assert [one["number"] for one in told["lessons"]] == [lesson.number for lesson in lessons()]
    assert told["lessons"][0]["exercises"][0] == "1.inside"
    assert told["progress"]["quizzes"] == {"1": 0.5}
    listed = racecraft("lessons", "--language", "de").out
    assert "Belohnung formt Verhalten" in listed
    assert "50 %" in listed
    assert "0 von 5" in listed
    assert "racecraft lessons run 1 --language de" in listed
    assert "0 of 5" in racecraft("lessons").out
    assert racecraft("lessons", "--language", "fr").status == 1


def test_a_quiz_says_why(racecraft: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    right, wrong = letters(1), letters(1, is_right=False)
    count = len(right)
    assert racecraft("lessons", "quiz", "1", "--answers", wrong, "--json").document == {
        "lesson": 1, "right": 0, "of": count
    }  # fmt: skip
    outcome = racecraft("lessons", "quiz", "1", "-a", right)
    question = find_lesson(1).facts.questions[0]
    assert question.choices[question.answer].why.en in " ".join(outcome.out.split())
    assert f"{count} of {count} right." in outcome.out
    assert "✗" not in outcome.out
    typed = iter(["?", *wrong])
    monkeypatch.setattr("typer.prompt", lambda _: next(typed))
    asked = " ".join(racecraft("lessons", "quiz", "1", "-l", "de").out.split())
    assert f"1 von {count} {question.text.de}" in asked
    assert "Bitte einen Buchstaben von a bis c." in asked
    assert f"0 von {count} richtig." in asked
    assert question.choices[question.answer].why.de in asked, "the right answer is told after a wrong one"
    assert racecraft("lessons", "--json").document["progress"]["quizzes"] == {"1": 1.0}, "the best counts"
    assert len(racecraft("lessons", "quiz", "1", "--json").document["questions"]) == count
    for mistake in (right[:-1], right + "a", "z" * count):
        outcome = racecraft("lessons", "quiz", "1", "-a", mistake)
        assert (outcome.status, "a letter for each" in outcome.err) == (1, True)


@pytest.mark.filterwarnings("default")  # no errors, which they are in tests alone
def test_a_quiz_is_told_where_its_score_cannot_be_kept(
    racecraft: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "taken").write_text("mine")
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "taken"))
    outcome = racecraft("lessons", "quiz", "1", "-a", letters(1))
    assert outcome.status == 0
    assert "right." in outcome.out
    assert outcome.err == "warning: The score cannot be kept: Not a directory.\n"
    (tmp_path / "racecraft").mkdir()
    (tmp_path / "racecraft" / "lessons.json").write_text("{")
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path))
    outcome = racecraft("lessons", "quiz", "1", "-a", letters(1), "--json")
    assert outcome.document["right"] == outcome.document["of"]
    assert "The score cannot be kept: " in outcome.err
    assert "holds no progress that can be read." in outcome.err


def test_notebooks_are_made_once(racecraft: Run, tmp_path: Path) -> None:
    told = racecraft("lessons", "open", "--no-start", "--json").document
    assert len(told["notebooks"]) == len(lessons())
    notebook = tmp_path / told["notebooks"][0]
    assert json.loads(notebook.read_text())["cells"][0]["source"][0].startswith("# Lesson 1")
    notebook.write_text("mine")
    assert racecraft("lessons", "open", "1", "--no-start", "--folder", "lessons").status == 0
    assert notebook.read_text() == "mine"
    assert "no lesson 88" in racecraft("lessons", "open", "88").err


def test_a_notebook_in_german_has_the_same_code(racecraft: Run, tmp_path: Path) -> None:
    made = [
        racecraft("lessons", "open", "1", "--no-start", "--json", "--language", language).document["notebooks"][0]
        for language in ("en", "de")
    ]
    assert [Path(one).name for one in made] == ["01_reward.ipynb", "01_reward.de.ipynb"]
    english, german = (json.loads((tmp_path / one).read_text())["cells"] for one in made)
    assert german[0]["source"][0] == "# Lektion 1 · Belohnung formt Verhalten\n"
    assert [one["cell_type"] for one in german] == [one["cell_type"] for one in english]
    for one, other in zip(english, german, strict=True):
        assert (one["source"] == other["source"]) == (one["cell_type"] == "code")
    assert racecraft("lessons", "open", "1", "--no-start", "--language", "fr").status == 1


def test_opening_starts_the_server(racecraft: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    started: list[list[str]] = []

    class Done:
        returncode = 0

    monkeypatch.setattr("racecraft.extras.importlib.util.find_spec", lambda name: object())
    monkeypatch.setattr("subprocess.run", lambda command, **_: started.append(command) or Done())
    assert racecraft("lessons", "open", "1", "--no-browser").status == 0
    (command,) = started
    assert command[1:4] == ["-m", "jupyterlab", "--ip=127.0.0.1"]
    assert command[4:] == [f"lessons/{find_lesson(1).path.stem}.ipynb", "--no-browser"]
    monkeypatch.setattr("racecraft.extras.importlib.util.find_spec", lambda name: None)
    outcome = racecraft("lessons", "open", "1")
    assert outcome.status == 1
    assert "needs jupyterlab" in outcome.err
    assert "racecraft[lessons]" in outcome.err


def test_a_lesson_that_stops_is_told(racecraft: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "course").mkdir()
    (tmp_path / "course" / "01_stops.py").write_text("print('here')\nraise SystemExit(3)\n")
    monkeypatch.setattr("racecraft.course.lesson.lessons_folder", lambda: tmp_path / "course")
    outcome = racecraft("lessons", "run", "1", "--json")
    assert outcome.status == 1
    assert "Lesson 1 stopped with exit status 3" in outcome.document["error"]["message"]
    (tmp_path / "course" / "01_stops.py").write_text("import os\nprint(os.environ['RACECRAFT_LANGUAGE'])\n")
    told = racecraft("lessons", "run", "1", "--language", "de", "--json").document
    assert (told["output"], told["pictures"]) == ("de\n", [])
    assert re.search(r"^Lektion 1 brauchte \d+,\d s; ihre Bilder", racecraft("lessons", "run", "1", "-l", "de").out)
    assert re.search(r"^Lesson 1 took \d+\.\d s; its pictures", racecraft("lessons", "run", "1").out)
    assert racecraft("lessons", "run", "1", "--json").document["output"] == "en\n"
    assert racecraft("lessons", "run", "1", "--language", "fr").status == 1


def test_where_a_file_lies_in_the_way_is_told_before_a_lesson_begins(racecraft: Run, tmp_path: Path) -> None:
    (tmp_path / "runs").write_text("mine")
    outcome = racecraft("lessons", "run", "1", "--json")
    assert outcome.status == 1
    says = f"The folder runs/{find_lesson(1).path.stem} for pictures cannot be made: Not a directory."
    assert outcome.document["error"]["message"] == says
    assert "Traceback" not in outcome.err
    opened = racecraft("lessons", "open", "1", "--no-start", "--folder", "runs")
    assert (opened.status, opened.err) == (1, "FileExistsError: runs cannot be used: File exists.\n")
    assert (tmp_path / "runs").read_text() == "mine"
