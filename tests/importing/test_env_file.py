"""`run.env` as people write it: quotes, comments, exports, Windows line ends, variables that stay what they are."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import settings as hypothesis_settings
from hypothesis import strategies as st

from racecraft.errors import ConfigError
from racecraft.importing.env_file import MAX_VALUE, parse_env


@pytest.mark.parametrize(
    ("line", "value"),
    [
        ("X=reinvent_base", "reinvent_base"),
        ("  X = reinvent_base  ", "reinvent_base"),
        ("export X=1", "1"),
        ("export\tX=1", "1"),
        ("X=", ""),
        ("X= # nothing", ""),
        ("X=#nothing", ""),
        ("X=5.0 # seconds", "5.0"),
        ("X=a#b", "a#b"),
        ("X=My fast car", "My fast car"),
        ('X="0.23,-1;0.46,1"', "0.23,-1;0.46,1"),
        ('X="a # b" # c', "a # b"),
        ("X='a \"b\" # c'", 'a "b" # c'),
        (r'X="a \"b\" \\ \$HOME"', r'a "b" \ $HOME'),
        ("X='$HOME'", "$HOME"),
        ("X=5$", "5$"),
        ("X=a=b", "a=b"),
        ("X=[1, 2]", "[1, 2]"),
        ("X=Müller", "Müller"),
    ],
)
def test_values(line: str, value: str) -> None:
    for text in (line, f"\n# comment\r\n{line}\r\nY=2", f"  \n{line}\n"):
        read = parse_env(text, name="run.env")
        assert (read.settings["X"].value, read.settings["X"].is_variable) == (value, False)
        assert read.notes == ()


@pytest.mark.parametrize(
    "value", ["$HOME", "${HOME}/x", '"a/$HOME"', "$(rm -rf /)", "`id`", '"`id`"', "a/$1", "${X:-a}"]
)
def test_variables_and_commands_stay_text(value: str) -> None:
    setting = parse_env(f"X={value}", name="run.env").settings["X"]
    assert setting.is_variable
    assert setting.value == value.strip('"')


@pytest.mark.parametrize(
    ("line", "says"),
    [
        ("source evil.sh", "is not NAME=VALUE"),
        ("rm -rf /", "is not NAME=VALUE"),
        ("1X=2", "is not NAME=VALUE"),
        ("export X", "is not NAME=VALUE"),
        ("=1", "is not NAME=VALUE"),
        ('X="open', "where its quote ends"),
        ("X='open", "where its quote ends"),
        ('X="a"b', "where its quote ends"),
        ("X='a'\"b\"", "where its quote ends"),
        ('X="a\\"', "where its quote ends"),
        (f"X={'a' * (MAX_VALUE + 1)}", "is longer than"),
    ],
)
def test_lines_that_cannot_be_used_are_named_and_the_rest_is_read(line: str, says: str) -> None:
    read = parse_env(f"A=1\n{line}\nB=2", name="run.env")
    assert {name: setting.value for name, setting in read.settings.items()} == {"A": "1", "B": "2"}
    (note,) = read.notes
    assert note.startswith("run.env, line 2: ")
    assert says in note
    assert len(note) < 200


def test_the_last_assignment_counts() -> None:
    read = parse_env("X=1\nX=2", name="run.env")
    assert (read.settings["X"].value, read.settings["X"].line) == ("2", 2)
    assert read.notes == ("run.env, line 2: X is set again; line 1 has no effect.",)


@pytest.mark.parametrize(("text", "says"), [("X=1\0", "NUL"), ("\n" * 6000, "5,000 lines")])
def test_what_is_no_settings_file(text: str, says: str) -> None:
    with pytest.raises(ConfigError, match=says):
        parse_env(text, name="run.env")


@hypothesis_settings(deadline=None)
@given(st.text(st.sampled_from("ABX_=\"'\\$`{}() #\t\n\rexport 1.0,é"), max_size=200))
def test_any_text_is_settings_and_notes(text: str) -> None:
    read = parse_env(text, name="run.env")
    used = [line for line in text.replace("\r", "\n").split("\n") if line.strip() and not line.strip().startswith("#")]
    assert len(read.settings) + len(read.notes) == len(used)
    for name, setting in read.settings.items():
        assert name.isidentifier()
        assert "\n" not in setting.value
