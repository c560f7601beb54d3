"""What an exercise says of an answer."""

from __future__ import annotations

from dataclasses import dataclass

from racecraft.course.phrases import learner_language, said_in

MARKS = {True: "✓ Solved.", False: "✗ Not yet."}
"""What a verdict begins with, by whether the answer is right."""


@dataclass(frozen=True)
class Verdict:
    """Whether an answer is right, and a sentence that helps."""

    is_right: bool
    sentence: str
    """In English."""

    def __str__(self) -> str:
        language = learner_language()
        return f"{said_in(language, MARKS[self.is_right])} {said_in(language, self.sentence)}"


def right(sentence: str) -> Verdict:
    """The answer is right, and why."""
    return Verdict(True, sentence)


def wrong(sentence: str) -> Verdict:
    """The answer is wrong: what is amiss, and where to look."""
    return Verdict(False, sentence)
