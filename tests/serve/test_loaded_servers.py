"""Forked servers and jobs are what those that are started would be."""

from __future__ import annotations

import json
import os
from contextlib import ExitStack
from pathlib import Path

import pytest
from loaded_servers import CAN_FORK, Forked
from running_consoles import PATIENCE, end, running_console
from running_workers import processes_on

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


def test_a_forked_job_has_a_session_of_its_own_and_ends_with_a_server_that_is_killed(tmp_path: Path) -> None:
    with running_console(tmp_path) as console:
        assert console.client.get("/").status_code == 200
        console.wait_for(lambda: processes_on(tmp_path))
        (waiting,) = processes_on(tmp_path)
        assert b"loaded_servers.py" in Path(f"/proc/{waiting}/cmdline").read_bytes(), "it is forked"
        assert os.getsid(waiting) == waiting != os.getsid(console.process.pid)
        console.create(name="some", track="oval", until="128 steps")
        (job,) = console.client.get("/api/jobs").json()
        assert console.wait_for(console.job_ended(job["id"]))["state"] == "done"
        console.wait_for(lambda: waiting not in processes_on(tmp_path))
        console.wait_for(lambda: processes_on(tmp_path))
        console.kill()
        console.wait_for(lambda: not processes_on(tmp_path))
