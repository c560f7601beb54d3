"""What `racecraft lessons` shows: the list, a quiz, how a lesson ended."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Final

import typer
from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table
from rich.text import Text

from racecraft.cli.tables import show_table

if TYPE_CHECKING:
    from racecraft.course import Lesson
    from racecraft.course.progress import Progress
    from racecraft.course.quiz import Question

WORDS: Final[dict[str, dict[str, str]]] = {
    "en": {
        "headings": "lesson runs exercises quiz",
        "of": "of",
        "begin": "Begin with ",
        "otherwise": ", or without notebooks ",
        "option": "",
        "to": "to",
        "letter": "A letter from {} to {}, please.",
        "right": "{} of {} right.",
        "ran": "Lesson {} took {} s; its pictures are in {}.",
        "stopped": "Lesson {} stopped with exit status {}; what it said stands above.",
    },
    "de": {
        "headings": "Lektion läuft Übungen Fragen",
        "of": "von",
        "begin": "Beginne mit ",
        "otherwise": ", oder ohne Notebooks mit ",
        "option": " --language de",
        "to": "bis",
        "letter": "Bitte einen Buchstaben von {} bis {}.",
        "right": "{} von {} richtig.",
        "ran": "Lektion {} brauchte {} s; ihre Bilder sind in {}.",
        "stopped": "Lektion {} endete mit dem Status {}; was sie sagte, steht darüber.",
    },
}
"""What is said around the lessons' own words."""


def say_lessons(lessons: Sequence[Lesson], progress: Progress, language: str) -> None:
    """A line for each lesson."""
    from racecraft.course import checks_of

    console, words = Console(), WORDS[language]
    table = Table(header_style="bold", box=SIMPLE_HEAD, pad_edge=False)
    table.add_column("", justify="right", style="bold")
    first, *others = words["headings"].split()
    table.add_column(first)
    for heading in others:
        table.add_column(heading, justify="right", no_wrap=True)
    for lesson in lessons:
        facts = lesson.facts
        names = {f"{lesson.number}.{name}" for name in checks_of(lesson.number)}
        solved = len(names & progress.exercises)
        share = progress.quizzes.get(lesson.number)
        table.add_row(
            str(lesson.number),
            Text.assemble((facts.title[language], "bold"), "\n", (facts.goal[language], "dim")),
            f"~{facts.seconds:.0f} s",
            Text(f"{solved} {words['of']} {len(names)}", "green" if solved == len(names) else ""),
            Text("–" if share is None else f"{100 * share:.0f} %", "green" if share == 1.0 else ""),
        )
    show_table(console, table)
    open_it, run_it = (f"racecraft lessons {verb} 1{words['option']}" for verb in ("open", "run"))
    line = Text.assemble(words["begin"], (open_it, "bold"), words["otherwise"], (run_it, "bold"))
    console.print(line, soft_wrap=True)


def ask(question: Question, place: int, count: int, language: str) -> int:
    """Put a question; the index of the choice."""
    console, words = Console(), WORDS[language]
    console.print(Text(f"\n{place + 1} {words['of']} {count}  {question.text[language]}", "bold"))
    letters = [chr(ord("a") + index) for index in range(len(question.choices))]
    for letter, choice in zip(letters, question.choices, strict=True):
        console.print(Text(f"  {letter})  {choice.text[language]}"))
    while (given := typer.prompt(f"{letters[0]} {words['to']} {letters[-1]}").strip().lower()) not in letters:
        console.print(Text(words["letter"].format(letters[0], letters[-1])))
    return letters.index(given)


def say_answered(question: Question, index: int, language: str) -> None:
    """Whether a choice was right, and why."""
    console, choice = Console(), question.choices[index]
    mark = ("✓ ", "bold green") if choice.right else ("✗ ", "bold red")
    console.print(Text.assemble(mark, choice.text[language], " ", (choice.why[language], "dim")))
    if not choice.right:
        best = question.choices[question.answer]
        console.print(Text.assemble("  ", (best.text[language], "bold"), " ", (best.why[language], "dim")))


def say_score(right: int, count: int, language: str) -> None:
    """The end of a quiz."""
    Console().print(Text(WORDS[language]["right"].format(right, count), "bold green" if right == count else "bold"))
