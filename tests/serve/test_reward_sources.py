"""A stranger's reward function keeps nobody else waiting, whatever its source is made of."""

from __future__ import annotations

import threading
import time
from pathlib import Path

import pytest
from running_consoles import PATIENCE, plain_client, running_console

DEPTH = 16
BLOCKS = "".join(f"{' ' * level}try: 0\n{' ' * level}finally:\n" for level in range(1, DEPTH + 1))
SLOW = f"def reward_function(params):\n    return 1.0\ndef nest():\n{BLOCKS}{' ' * (DEPTH + 1)}0\n"
"""600 characters on which Python's compiler is busy for seconds, with all else of its process waiting."""


@pytest.mark.costly
@pytest.mark.parametrize("what", ["checked", "saved"])
def test_others_are_answered_while_a_source_is_looked_at(tmp_path: Path, what: str) -> None:
    with running_console(tmp_path / "runs") as console:

        def send() -> None:
            with plain_client(console.client.base_url, cookies=console.client.cookies) as client:
                if what == "checked":
                    client.post("/api/rewards/check", json={"source": SLOW, "track": "hairpin"})
                else:
                    client.post("/api/models", json={"reward": SLOW, "track": "hairpin", "train": False})

        console.client.get("/api/models")  # a first answer takes longer
        sending = threading.Thread(target=send)
        sending.start()
        waits, deadline = [0.0], time.monotonic() + PATIENCE
        while sending.is_alive() and time.monotonic() < deadline:
            begun = time.monotonic()
            assert console.client.get("/api/health").status_code == 204
            waits.append(time.monotonic() - begun)
            time.sleep(0.02)
        sending.join()
        assert max(waits) < 1.0, "it was looked at in the server's own process"
