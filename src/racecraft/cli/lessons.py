"""`racecraft lessons`: the course, in files, notebooks and questions."""

from __future__ import annotations

import os
import subprocess
import sys
import time
import warnings
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, cast

import typer

from racecraft.cli.app import INTERRUPTED, Json, app, print_json

if TYPE_CHECKING:
    from racecraft.course import Lesson
    from racecraft.course.quiz import Language

lessons_app = typer.Typer(help="Learn reinforcement learning by racing.", rich_markup_mode=None)
app.add_typer(lessons_app, name="lessons")

Number = Annotated[int, typer.Argument(metavar="LESSON", help="Its number.")]
LanguageOption = Annotated[str, typer.Option("--language", "-l", help="en or de.")]


@lessons_app.callback(invoke_without_command=True)
def lessons(context: typer.Context, language: LanguageOption = "en", as_json: Json = False) -> None:
    """List the lessons, their run times and what is solved."""
    if context.invoked_subcommand is not None:
        return
    from racecraft.checks import check_choice
    from racecraft.course import lessons, read_progress
    from racecraft.course.quiz import LANGUAGES

    check_choice("language", language, LANGUAGES)
    found, progress = lessons(), read_progress()
    if as_json:
        print_json({"lessons": [_facts(lesson) for lesson in found], "progress": progress.to_dict()})
        return
    from racecraft.cli.lessons_text import say_lessons

    say_lessons(found, progress, language)


@lessons_app.command("run")
def run_lesson(number: Number, language: LanguageOption = "en", as_json: Json = False) -> None:
    """Run a lesson from top to bottom; its pictures go to runs/."""
    from racecraft.checks import check_choice
    from racecraft.cli.lessons_text import WORDS
    from racecraft.course import find_lesson
    from racecraft.course.phrases import LANGUAGE
    from racecraft.course.quiz import LANGUAGES
    from racecraft.course.show import picture_folder
    from racecraft.errors import TrainingError

    check_choice("language", language, LANGUAGES)
    lesson = find_lesson(number)
    words, folder = WORDS[language], picture_folder(lesson.path.stem)  # before minutes of learning
    begun = time.perf_counter()
    command = [sys.executable, str(lesson.path)]
    environment = os.environ | {LANGUAGE: language}
    output = subprocess.PIPE if as_json else None
    done = subprocess.run(command, check=False, stdout=output, text=True, env=environment)
    seconds = round(time.perf_counter() - begun, 3)
    if done.returncode in (-2, INTERRUPTED):
        raise typer.Exit(INTERRUPTED)
    if done.returncode:
        raise TrainingError(words["stopped"].format(number, done.returncode))
    if as_json:
        pictures = sorted(str(path) for path in folder.glob("*") if path.suffix in (".png", ".webp"))
        print_json({"lesson": number, "wall_seconds": seconds, "pictures": pictures, "output": done.stdout})
    else:
        told = f"{seconds:.1f}"
        typer.echo(words["ran"].format(number, told.replace(".", ",") if language == "de" else told, folder))


@lessons_app.command("open")
def open_lessons(
    number: Annotated[int | None, typer.Argument(metavar="[LESSON]", help="Its number; none opens the folder.")] = None,
    folder: Annotated[Path, typer.Option("--folder", help="Where the notebooks are kept.")] = Path("lessons"),
    browser: Annotated[bool, typer.Option("--browser/--no-browser", help="Open a browser.")] = True,
    start: Annotated[bool, typer.Option("--start/--no-start", help="Start JupyterLab.")] = True,
    language: LanguageOption = "en",
    as_json: Json = False,
) -> None:
    """Make the notebooks, where they are missing, and open them in JupyterLab."""
    from racecraft.checks import check_choice
    from racecraft.course import find_lesson, lessons, write_notebook
    from racecraft.course.quiz import LANGUAGES
    from racecraft.extras import check_installed

    check_choice("language", language, LANGUAGES)
    chosen = lessons() if number is None else [find_lesson(number)]
    paths = [write_notebook(lesson, folder, cast("Language", language)) for lesson in chosen]
    if as_json:
        print_json({"notebooks": [str(path) for path in paths]})
    else:
        typer.echo(f"Notebooks: {', '.join(str(path) for path in paths)}")
    if not start:
        return
    check_installed("jupyterlab", "The notebooks are made; to open one")
    target = paths[0] if number is not None else folder
    command = [sys.executable, "-m", "jupyterlab", "--ip=127.0.0.1", str(target)]
    raise typer.Exit(subprocess.run([*command, *([] if browser else ["--no-browser"])], check=False).returncode)


@lessons_app.command("quiz")
def take_quiz(
    number: Number,
    answers: Annotated[
        str, typer.Option("--answers", "-a", help="Letters of all answers, such as 'bacb', instead of being asked.")
    ] = "",
    language: LanguageOption = "en",
    as_json: Json = False,
) -> None:
    """Answer a lesson's questions."""
    from racecraft.checks import check_choice
    from racecraft.cli.lessons_text import ask, say_answered, say_score
    from racecraft.course import find_lesson, record_quiz
    from racecraft.course.quiz import LANGUAGES
    from racecraft.errors import ConfigError

    check_choice("language", language, LANGUAGES)
    questions = find_lesson(number).facts.questions
    letters = answers.replace(" ", "").lower()
    if as_json and not letters:
        print_json({"lesson": number, "questions": [question.model_dump() for question in questions]})
        return
    if letters:
        allowed = [[chr(ord("a") + index) for index in range(len(question.choices))] for question in questions]
        fits = len(letters) == len(questions) and all(a in b for a, b in zip(letters, allowed, strict=True))
        if not fits:
            raise ConfigError(
                f"--answers is {answers!r}; lesson {number} has {len(questions)} questions, a letter for each."
            )
    chosen = []
    for place, question in enumerate(questions):
        index = ord(letters[place]) - ord("a") if letters else ask(question, place, len(questions), language)
        chosen.append(index)
        if not as_json:
            say_answered(question, index, language)
    right = sum(question.answer == index for question, index in zip(questions, chosen, strict=True))
    try:
        record_quiz(number, right / len(questions))
    except (OSError, ConfigError) as error:  # the answers are told all the same
        why = f"{error.strerror or error}." if isinstance(error, OSError) else str(error)
        warnings.warn(f"The score cannot be kept: {why}", stacklevel=2)
    if as_json:
        print_json({"lesson": number, "right": right, "of": len(questions)})
    else:
        say_score(right, len(questions), language)


def _facts(lesson: Lesson) -> dict[str, Any]:
    from racecraft.course import checks_of

    facts = lesson.facts
    return {
        "number": lesson.number,
        "path": str(lesson.path),
        "title": facts.title.model_dump(),
        "goal": facts.goal.model_dump(),
        "seconds": facts.seconds,
        "exercises": [f"{lesson.number}.{name}" for name in checks_of(lesson.number)],
        "questions": len(facts.questions),
    }
