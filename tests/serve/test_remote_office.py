"""What a worker with a token says is what the server takes, however much there is to say."""

from __future__ import annotations

from typing import Any, cast

import pytest

from racecraft.serve.jobs.line import Line
from racecraft.serve.jobs.remote import RemoteOffice
from racecraft.serve.workers.schemas import End


class Heard:
    """A line that keeps what was said."""

    def __init__(self) -> None:
        self.told: Any = None

    def ask(self, _method: str, _path: str, told: Any = None) -> None:
        self.told = told


def said(error: dict[str, Any] | None) -> End:
    """What the server understands when a job ends so."""
    line = Heard()
    state = "done" if error is None else "failed"
    assert RemoteOffice(cast(Line, line)).finish("a job", owner="me", state=state, error=error)
    return End.model_validate(line.told)


@pytest.mark.parametrize("length", [4001, 200_000])
def test_a_failure_that_has_much_to_say_is_told(length: int) -> None:
    text = "What is wrong comes first. " + "ä" * length
    error = said({"code": "E" * length, "message": text, "hint": text, "line": 7}).error
    assert error is not None
    assert (len(error.code), len(error.message), len(error.hint), error.line) == (64, 4000, 4000, 7)
    assert error.message[:-1] == text[:3999]
    assert error.message[-1] == error.hint[-1] == "…"


def test_a_failure_that_has_little_to_say_is_told_as_it_is() -> None:
    told = {"code": "RewardError", "message": "x" * 4000, "hint": "", "line": None}
    error = said(told).error
    assert error is not None
    assert error.model_dump() == told
    assert said(None).error is None
