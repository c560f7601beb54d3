"""The page of a training whose teacher learns first, in a real browser: it says how far the teacher is."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from browsers import Visit, needs_browser, needs_pages, visiting
from running_consoles import LEISURELY, running_console

pytestmark = [pytest.mark.slow, needs_pages, needs_browser]


def _told(visit: Visit) -> int:
    """What the page says that the teacher has learned, in percent."""
    text = visit.page.get_by_text("of its lessons; the curve begins").inner_text()
    return int(text.split("has learned ")[1].split(" ")[0].rstrip("%"))


def test_how_far_a_teacher_is_until_its_student_drives(tmp_path: Path) -> None:
    with running_console(tmp_path / "runs") as console, visiting(console) as visit:
        settings = {"track": "oval", "algorithm": "distill", "reward": LEISURELY, "until": "10 minutes", "seed": 1}
        console.create(name="pupil", **settings)
        history = console.runs / "pupil" / "metrics" / "history.jsonl"
        console.wait_for(lambda: history.exists() and b'"lesson"' in history.read_bytes())
        page = visit.open("/models/pupil")
        page.get_by_text("A teacher, told where everything is, learns first: ").wait_for()
        first = _told(visit)
        pace = page.locator(".figures div", has=page.get_by_text("Steps per second")).locator("dd")
        assert pace.inner_text() == "–", "of the cars that wait for it, which drive no steps"
        console.wait_for(lambda: _told(visit) > first)
        page.reload()
        page.get_by_text("of its lessons; the curve begins").wait_for()
        assert first < _told(visit) < 100

        job = console.client.get("/api/jobs").json()[0]["id"]
        assert console.client.post("/api/models/pupil/stop").status_code == 202
        console.wait_for(console.job_ended(job))
        page.reload()
        page.get_by_text("of its lessons; the curve begins").wait_for()
        assert _told(visit) > first
        assert page.get_by_text("learns first").count() == 0

        last = json.loads(history.read_text().splitlines()[-1])
        del last["lesson"]  # as of a student's, and of every run that is older than it
        with history.open("a") as file:
            file.write(json.dumps({**last, "step": 512}) + "\n")
        page.reload()
        page.get_by_role("heading", name="Learning curve").wait_for()
        page.locator(".figures dd").get_by_text("512", exact=True).wait_for()
        assert page.get_by_text("of its lessons").count() == 0
        assert visit.complaints == []
