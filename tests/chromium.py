"""The Chromium that tests look at pages with: its shell where there is one, the same engine with no window to draw."""

from __future__ import annotations

import shutil
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Playwright

NAMES: Final = ("chromium-headless-shell", "chromium", "chromium-browser")
CHROMIUM: Final = next(filter(None, map(shutil.which, NAMES)), None)
"""Where it is."""
# WebGL is drawn by the processor; the page around it in another way, or it costs ten times as much.
SOFTWARE_3D: Final = (
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--disable-gpu-compositing",
    "--no-sandbox",
)
PATIENCE: Final = 300_000  # ms


def launched(playwright: Playwright) -> Browser:
    """A browser of its own; what is expected of its pages is waited for, as the machine may be busy."""
    from playwright.sync_api import expect

    expect.set_options(timeout=PATIENCE)
    return playwright.chromium.launch(executable_path=CHROMIUM, args=SOFTWARE_3D)
