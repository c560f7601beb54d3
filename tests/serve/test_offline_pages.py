"""A tab whose server is away for a time, in real headless Chromium: when it is back, the graph has no gap."""

from __future__ import annotations

import json
import time
from pathlib import Path

import pytest
from browsers import needs_browser, needs_pages, visiting
from running_consoles import LEISURELY, running_console

from free_ports import free_port

pytestmark = [pytest.mark.slow, needs_pages, needs_browser]

AWAY = 8.0  # s; it was 60 when it was looked at


def test_a_graph_has_no_gap_after_a_time_without_server(runs: Path) -> None:
    port = str(free_port())
    with running_console(runs, "--port", port) as first, visiting(first) as visit:
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
        first.kill()  # the training goes on without it
        page.get_by_text("The console does not answer.").wait_for()
        before = seconds()[-1]
        time.sleep(AWAY)
        assert seconds()[-1] == before
        with running_console(runs, "--port", port) as second:
            second.wait_for(lambda: seconds()[-1] > before + AWAY)
            points = seconds()
            written = map(json.loads, (runs / "away" / "metrics" / "history.jsonl").read_text().splitlines())
            driven = [point["seconds"] for point in written if point["kind"] in ("iteration", "evaluation")]
            assert points == pytest.approx(driven[: len(points)], abs=0.01)  # the table has five digits
            page.get_by_text("learning at once").wait_for()
            second.client.post("/api/models/away/stop")
