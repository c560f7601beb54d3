"""The garage in a real browser, without a mouse: where the keyboard goes on when a field or a card is gone."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from browsers import needs_browser, needs_pages, visiting
from leagues import untrained_run
from running_consoles import running_console

pytestmark = [pytest.mark.slow, needs_pages, needs_browser]


def test_who_renames_or_deletes_a_model_without_a_mouse_goes_on_where_it_was(tmp_path: Path) -> None:
    from playwright.sync_api import expect

    runs = tmp_path / "runs"
    for name in ("left", "right"):
        untrained_run(runs, name)
    with running_console(runs) as console, visiting(console) as visit:
        page = visit.open("/")

        def button(model: str, name: str) -> Any:
            card = page.locator("li.card").filter(has=page.get_by_role("heading", name=model, exact=True))
            return card.get_by_role("button", name=name)

        new = page.get_by_label("New name")
        button("left", "Rename").press("Enter")
        expect(new).to_be_focused()
        new.press("Escape")
        expect(button("left", "Rename")).to_be_focused()
        page.keyboard.press("Enter")
        page.get_by_role("button", name="Cancel").press("Enter")
        expect(button("left", "Rename")).to_be_focused()
        page.keyboard.press("Enter")
        new.fill("twin")
        new.press("Enter")
        expect(button("twin", "Rename")).to_be_focused()
        page.keyboard.press("Enter")
        page.get_by_label("Tags").fill("slow")
        page.get_by_role("button", name="Save").press("Enter")
        page.get_by_text("slow").wait_for()
        expect(button("twin", "Rename")).to_be_focused()
        button("twin", "Delete").press("Enter")
        expect(page.locator("#main")).to_be_focused()
        assert visit.complaints == []
