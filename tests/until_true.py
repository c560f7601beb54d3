"""Waiting in a page whose content policy forbids `eval`, which Playwright's `wait_for_function` uses to look again."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from playwright.sync_api import Page

PATIENCE = 120  # s; the machine may be busy
OFTEN = 100  # ms


def until_true(page: Page, expression: str, arg: Any = None) -> Any:
    """What an expression of JavaScript, or a function called with `arg`, is in a page as soon as that is true."""
    began = time.monotonic()
    while not (value := page.evaluate(expression, arg)):
        assert time.monotonic() - began < PATIENCE, f"it never became true: {expression}"
        page.wait_for_timeout(OFTEN)
    return value
