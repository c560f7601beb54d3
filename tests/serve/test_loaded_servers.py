"""A forked server is what one that is started would be."""

from __future__ import annotations

import json
import os
from contextlib import ExitStack
from pathlib import Path

import pytest
from loaded_servers import CAN_FORK, Forked
from running_consoles import PATIENCE, end

pytestmark = [pytest.mark.costly, pytest.mark.skipif(not CAN_FORK, reason="servers are forked on Linux alone")]
WORDS = ("serve", "--json", "--no-browser", "--port", "0", "--runs", "here")


def test_it_has_a_folder_an_environment_and_an_end_of_its_own(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    with ExitStack() as stack:

        def forked(*words: str) -> Forked:
            server = Forked(words, os.environ)
            stack.callback(end, server)
            return server

        monkeypatch.setenv("RACECRAFT_DATABASE", f"sqlite:///{tmp_path / 'own.db'}")
        first = forked(*WORDS)
        monkeypatch.delenv("RACECRAFT_DATABASE")
        second = forked(*WORDS)
        for server in (first, second):
            assert json.loads(server.stdout.readline())["link"].startswith("http://127.0.0.1:")
            assert server.poll() is None
        assert first.pid != second.pid
        assert (tmp_path / "own.db").exists()
        assert (tmp_path / "here" / ".racecraft" / "console.db").exists()
        first.kill()
        first.wait(PATIENCE)
        assert first.poll() is not None
        assert second.poll() is None, "one that is killed takes nobody with it"
        mistaken = forked("serve", "--port", "many")
        mistaken.wait(PATIENCE)
        assert mistaken.stdout.read() == ""
        assert "many" in capfd.readouterr().err
