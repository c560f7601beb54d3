"""A tab whose server is away for a time, in real headless Chromium: when it is back, the graph has no gap."""

from __future__ import annotations

import time
from itertools import pairwise
from pathlib import Path

import pytest
from browsers import needs_browser, needs_pages, visiting
from running_consoles import running_console

pytestmark = [pytest.mark.slow, needs_pages, needs_browser]

AWAY = 8.0  # s; it was 60 when it was looked at
LEISURELY = "import time\n\n\ndef reward_function(params):\n    time.sleep(0.001)\n    return 1.0\n"
"""A reward under which a training goes on and leaves most of the processor to others."""
USUAL = 5.0  # s between two points of the graph, at most; the machine may be busy


def test_a_graph_has_no_gap_after_a_time_without_server(runs: Path) -> None:
    with running_console(runs) as first, visiting(first) as visit:
        first.create(name="away", track="oval", until="20 minutes", reward=LEISURELY)
        page = visit.open("/models/away/watch")
        page.get_by_text("learning at once").wait_for()

        def seconds() -> list[float]:
            """Of the points in the table behind the graph."""
            cells = page.get_by_role("region", name="Learning curve").locator("tbody tr td:first-child")
            return [float(text) for text in cells.all_inner_texts()]

        page.get_by_label("Keep as a file, or see the table: Learning curve").click()
        page.get_by_role("button", name="As a table").click()
        first.wait_for(lambda: len(seconds()) > 3)
        port = first.client.base_url.port
        first.kill()  # the training goes on without it
        before = seconds()[-1]
        time.sleep(AWAY)
        assert seconds()[-1] == before
        with running_console(runs, "--port", str(port)) as second:
            second.wait_for(lambda: seconds()[-1] > before + AWAY)
            points = seconds()
            assert max(after - at for at, after in pairwise(points)) < USUAL
            page.get_by_text("learning at once").wait_for()
            second.client.post("/api/models/away/stop")
