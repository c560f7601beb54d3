"""Live streams: gaps are filled, readers that sleep cost nothing, and twenty viewers see the same as one."""

from __future__ import annotations

import json
import re
import socket
import sys
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import pytest
from running_consoles import LEISURELY, RunningConsole

pytestmark = pytest.mark.costly


@pytest.fixture(scope="module")
def training(console: RunningConsole) -> Iterator[str]:
    """A model that is being trained."""
    name = console.create(name="streamed", until="20 minutes", reward=LEISURELY)
    console.wait_for(lambda: len(console.client.get(f"/api/models/{name}/history").json()["points"]) > 3)
    yield name
    console.client.post(f"/api/models/{name}/stop")


def watch(
    console: RunningConsole, name: str, *, points: int, last: str = "", looks: int = 0
) -> tuple[list[Any], str, int]:
    """What comes until there are so many points and looks at the cars: points, the last one's id, number of looks."""
    found: list[Any] = []
    kind, live = "", 0
    headers = {"Last-Event-ID": last} if last else {}
    with console.client.stream("GET", f"/api/events/{name}", headers=headers) as stream:
        for line in stream.iter_lines():
            if line.startswith("event: "):
                kind = line.removeprefix("event: ")
            elif line.startswith("id: "):
                last = line.removeprefix("id: ")
            elif line.startswith("data: "):
                live += kind == "live"
                found += json.loads(line.removeprefix("data: ")) if kind == "points" else []
            elif not line and len(found) >= points and live >= looks:
                break
    return found, last, live


def test_a_gap_is_filled_without_a_point_twice(console: RunningConsole, training: str) -> None:
    before, last, _ = watch(console, training, points=4)
    seen = len(console.client.get(f"/api/models/{training}/history").json()["points"])
    console.wait_for(  # offline, while the training goes on
        lambda: len(console.client.get(f"/api/models/{training}/history").json()["points"]) > seen + 5
    )
    after, end, _ = watch(console, training, points=6, last=last)
    whole, _, _ = watch(console, training, points=len(before) + len(after))
    joined = before + after
    assert joined == whole[: len(joined)]
    assert int(end) > int(last)


@pytest.mark.parametrize("last", ["-5", "x", "9" * 30, "0", "²"])
def test_a_made_up_event_id_is_no_harm(console: RunningConsole, training: str, last: str) -> None:
    headers = {"last-event-id": last.encode("latin-1")}
    with console.client.stream("GET", f"/api/events/{training}", headers=headers) as stream:
        assert stream.status_code == 200
        assert next(line for line in stream.iter_lines() if line.startswith("event: points"))


def test_many_viewers_see_the_cars(console: RunningConsole, training: str) -> None:
    with ThreadPoolExecutor(8) as pool:
        seen = list(pool.map(lambda _: watch(console, training, points=5, looks=3), range(8)))
    assert all(live >= 3 for _, _, live in seen)
    assert all(points[:5] == seen[0][0][:5] for points, _, _ in seen)


SLEEPERS = 60  # tabs that never read
WARM = 0.3e6  # bytes that one which reads is sent before memory is measured
MISSED = 0.5e6  # bytes that the others are not sent meanwhile, each


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="reads the size of a process from /proc")
def test_a_tab_that_never_reads_costs_no_memory(console: RunningConsole, training: str) -> None:
    host, port = str(console.client.base_url.host), console.client.base_url.port
    cookie = f"racecraft_session={console.client.cookies['racecraft_session']}"
    request = f"GET /api/events/{training}?eye=true HTTP/1.1\r\nHost: {host}:{port}\r\nCookie: {cookie}\r\n\r\n"
    with ExitStack() as stack:
        for _ in range(SLEEPERS):
            sleeper = stack.enter_context(socket.socket())
            # Small packets and little room, or the system itself keeps 3 MB for each of them.
            sleeper.setsockopt(socket.IPPROTO_TCP, socket.TCP_MAXSEG, 536)
            sleeper.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
            sleeper.connect((host, port))
            sleeper.sendall(request.encode())
        stream = stack.enter_context(console.client.stream("GET", f"/api/events/{training}?eye=true"))
        awake = (len(part) for part in stream.iter_raw())
        _read(awake, WARM)
        before = _resident(console.process.pid)
        _read(awake, MISSED)
        assert _resident(console.process.pid) - before < 0.4 * SLEEPERS * MISSED
        assert console.client.get("/api/console").status_code == 200


def _read(sizes: Iterator[int], count: float) -> None:
    """Until so many bytes have come."""
    while count > 0:
        count -= next(sizes)


def _resident(process: int) -> float:
    """Bytes."""
    found = re.search(r"VmRSS:\s+(\d+) kB", Path(f"/proc/{process}/status").read_text())
    assert found is not None
    return 1000 * float(found[1])
