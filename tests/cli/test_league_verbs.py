"""What `racecraft submit` says of what a league answers."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from racecraft.cli.entry import every_verb
from racecraft.judging import league
from racecraft.run import RunFolder


class Answers:
    """A league that answers as it is told."""

    def __init__(self, *answers: dict[str, Any]) -> None:
        self._answers = [
            {"id": 7, "ahead": 0, "seconds_left": 2.0, "score": 9.5, "error": None, **one} for one in answers
        ]

    def submit(self, run: RunFolder, race: int, *, checkpoint: str) -> dict[str, Any]:
        self.checkpoint = checkpoint
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
    opened: list[Path] = []
    monkeypatch.setattr(RunFolder, "open", opened.append)
    answers = Answers({"state": "queued"}, {"state": "done", **told})
    monkeypatch.setattr(league, "remembered_league", lambda: answers)
    output = CliRunner().invoke(every_verb(), ["submit", f"{tmp_path}@64", "--race", "1"]).output
    assert (opened, answers.checkpoint) == ([tmp_path], "64")
    assert "Submission 7: 9.500 s." in output
    sentence = "It drives like somebody else's entry, so a person looks at it; it counts meanwhile."
    assert (sentence in output) == is_said


RACE = {"id": 1, "state": "open", "kind": "time-trial", "track": "oval", "title": "Spring \x1b]0;title\x07"}


@pytest.mark.parametrize(
    ("answer", "told"),
    [
        (json.dumps([RACE]), "Spring �]0;title�"),
        (json.dumps([{**RACE, "title": 5}]), "0.title: Input should be a valid string."),
        ("{}", "the answer: Input should be a valid list."),
        ("null", "the answer: Input should be a valid list."),
        ("[1]", "does not answer as a league does: 0: "),
        ("[" * 100_000, "does not answer as a league does: maximum recursion depth"),
        ("<html>", "does not answer as a league does: Expecting value"),
    ],
)
def test_a_league_that_says_anything_is_shown_without_harm_or_refused(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, answer: str, told: str
) -> None:
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))
    league.remember_league(league.League("http://127.0.0.1:1", "rc_token"))
    monkeypatch.setattr(league.League, "_fetch", lambda *_, **__: answer.encode())
    done = CliRunner().invoke(every_verb(), ["races"])
    assert told in (done.output if done.exit_code == 0 else str(done.exception))
    assert "\x1b" not in done.output
    assert done.exit_code == 0 or isinstance(done.exception, league.LeagueRefused)


def test_nobody_at_an_address_is_told_in_words() -> None:
    with pytest.raises(league.LeagueRefused, match=r"does not answer as a league does: Connection refused\.$"):
        league.League("http://127.0.0.1:1").begin_login()


@pytest.mark.parametrize("answer", ["{}", '{"link": 1, "code": "", "secret": ""}', "[]", "NaN"])
def test_what_is_no_league_lets_nobody_in(monkeypatch: pytest.MonkeyPatch, answer: str) -> None:
    monkeypatch.setattr(league.League, "_fetch", lambda *_, **__: answer.encode())
    with pytest.raises(league.LeagueRefused, match="does not answer as a league does"):
        league.League("http://127.0.0.1:1").begin_login()
