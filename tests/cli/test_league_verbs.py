"""What `racecraft submit` says of what a league answers."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from racecraft.cli import every_verb
from racecraft.judging import league
from racecraft.run import RunFolder


class Answers:
    """A league that answers as it is told."""

    def __init__(self, *answers: dict[str, Any]) -> None:
        self._answers = [
            {"id": 7, "ahead": 0, "seconds_left": 2.0, "score": 9.5, "error": None, **one} for one in answers
        ]

    def submit(self, run: RunFolder, race: int, *, checkpoint: str) -> dict[str, Any]:
        return self._answers.pop(0)

    def submission(self, race: int, number: int) -> dict[str, Any]:
        return self._answers.pop(0)


@pytest.mark.parametrize(
    ("told", "is_said"), [({"is_looked_at": True}, True), ({"is_looked_at": False}, False), ({}, False)]
)
def test_who_drives_like_somebody_else_is_told(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, told: dict[str, Any], is_said: bool
) -> None:
    monkeypatch.setattr("time.sleep", lambda _: None)
    monkeypatch.setattr(RunFolder, "open", lambda path: None)
    answers = Answers({"state": "queued"}, {"state": "done", **told})
    monkeypatch.setattr(league, "remembered_league", lambda: answers)
    output = CliRunner().invoke(every_verb(), ["submit", str(tmp_path), "--race", "1"]).output
    assert "Submission 7: 9.500 s." in output
    sentence = "It drives like somebody else's entry, so a person looks at it; it counts meanwhile."
    assert (sentence in output) == is_said
