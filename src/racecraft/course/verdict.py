"""What an exercise says of an answer."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Verdict:
    """Whether an answer is right, and a sentence that helps."""

    is_right: bool
    sentence: str

    def __str__(self) -> str:
        return f"{'✓ Solved.' if self.is_right else '✗ Not yet.'} {self.sentence}"


def right(sentence: str) -> Verdict:
    """The answer is right, and why."""
    return Verdict(True, sentence)


def wrong(sentence: str) -> Verdict:
    """The answer is wrong: what is amiss, and where to look."""
    return Verdict(False, sentence)
