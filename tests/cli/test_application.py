"""The application that is built for what was typed."""

from __future__ import annotations

from typing import Any

import pytest
from typer.main import get_command

from racecraft.cli.entry import application, every_verb

WHOLE: Any = get_command(every_verb())
VERBS = sorted(WHOLE.commands)


def explained(application: Any, verb: str) -> str:
    """All options of a verb and all verbs below it."""
    command = application.commands[verb]
    return str(command.get_help(command.context_class(command, info_name=verb)))


@pytest.mark.parametrize("verb", VERBS)
def test_for_a_verb_that_one_is_built_and_takes_what_it_always_takes(verb: str) -> None:
    built: Any = get_command(application([verb, "--json"]))
    assert list(built.commands) == [verb]
    assert explained(built, verb) == explained(WHOLE, verb)


@pytest.mark.parametrize("arguments", [[], ["--help"], ["--json", "train"], ["trian"], ["--", "train"]])
def test_for_anything_else_every_verb_is_built(arguments: list[str]) -> None:
    built: Any = get_command(application(arguments))
    assert sorted(built.commands) == VERBS
    assert len(VERBS) > 20


def test_the_version_asks_for_no_verb(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("racecraft.cli.entry.VERBS", ("no_file_of_this_name",))
    application(["--version", "--json"])
    with pytest.raises(ModuleNotFoundError, match="no_file_of_this_name"):
        application(["tracks"])
