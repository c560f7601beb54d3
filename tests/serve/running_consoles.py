"""A real console in its own process, and a client that came with its link."""

from __future__ import annotations

import json
import os
import signal
import ssl
import subprocess
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import httpx
from loaded_servers import Forked, started

PATIENCE = 300.0  # s; the machine may be busy, and a film takes twenty of a core of its own

_TRUSTS_NOBODY = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
"""Loading the certificates of a machine's authorities is 34 ms of CPU a client, and these servers speak plain HTTP."""

LEISURELY = "import time\n\n\ndef reward_function(params):\n    time.sleep(0.001)\n    return 1.0\n"
"""A reward under which a training goes on and leaves most of the processor to others."""


@dataclass
class RunningConsole:
    """A console's process and a signed-in client."""

    process: subprocess.Popen[str] | Forked
    link: str
    client: httpx.Client
    runs: Path

    def kill(self) -> None:
        os.kill(self.process.pid, signal.SIGKILL)
        self.process.wait()

    def create(self, **settings: Any) -> str:
        reply = self.client.post("/api/models", json=settings)
        assert reply.status_code == 201, reply.text
        return str(reply.json()["name"])

    def wait_for(self, ready: Callable[[], Any]) -> Any:
        deadline = time.monotonic() + PATIENCE
        while time.monotonic() < deadline:
            if value := ready():
                return value
            time.sleep(0.1)
        raise AssertionError("waited in vain")

    def job_ended(self, job_id: str) -> Callable[[], Any]:
        def ended() -> Any:
            job = self.client.get(f"/api/jobs/{job_id}").json()
            return job if job["state"] in ("done", "failed", "cancelled") else None

        return ended


def plain_client(base_url: httpx.URL | str = "", **settings: Any) -> httpx.Client:
    """A patient client of a server on this machine, with `settings` of `httpx.Client`."""
    return httpx.Client(base_url=base_url, timeout=PATIENCE, verify=_TRUSTS_NOBODY, **settings)


@contextmanager
def running_console(runs: Path, *options: str) -> Iterator[RunningConsole]:
    process = started("serve", "--json", "--no-browser", "--port", "0", "--runs", str(runs), *options)
    try:
        assert process.stdout is not None
        line = process.stdout.readline()
        document = json.loads(line)
        link = document["link"]
        with plain_client(link.split("/?")[0]) as client:
            assert client.get(link).status_code == 303
            yield RunningConsole(process, link, client, runs)
    finally:
        end(process)


def end(process: subprocess.Popen[str] | Forked) -> None:
    """Ask a process to stop, and kill one that does not."""
    if process.poll() is None:
        process.terminate()
        try:
            process.wait(PATIENCE)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
    assert process.stdout is not None
    process.stdout.close()
