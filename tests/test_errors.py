"""What an error says can be shown anywhere, whatever it quotes."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest

from racecraft.errors import RacecraftError, RewardError, RunError
from racecraft.run import RunFolder
from racecraft.run.folder import checked_name as checked_run
from racecraft.serve.people.names import checked_name


@pytest.mark.parametrize("kind", [RacecraftError, RewardError])
def test_no_error_drives_a_terminal_or_cannot_be_encoded(kind: type[RacecraftError]) -> None:
    error = kind("one\n\x1b]0;title\x07two \ud800\u202e", hint="\x1b[2J\ud800")
    assert str(error) == "one\n�]0;title�two ��"
    assert error.hint == "�[2J�"
    plain = "two lines\nof „Umlauten“, 15 m/s²"
    assert str(kind(plain)) == plain


def test_a_strangers_run_writes_no_escape_sequence(tmp_path: Path) -> None:
    (tmp_path / "run.json").write_text(json.dumps({"format": 1, "\x1b]0;title\x07": 1}))
    with pytest.raises(RunError, match="unexpected keyword") as error:
        RunFolder.open(tmp_path).read_info()
    assert str(error.value).isprintable()


@pytest.mark.parametrize("check", [checked_run, checked_name])
def test_a_name_of_a_joined_emoji_is_shown_without_codes(check: Callable[[str], str]) -> None:
    with pytest.raises(RacecraftError, match="'👨👩👧'"):
        check("👨\u200d👩\u200d👧")


def test_a_joiner_that_joins_nothing_is_shown_as_what_it_is() -> None:
    with pytest.raises(RunError, match=r"'ad\\u200da'"):
        checked_run("ad\u200da")
