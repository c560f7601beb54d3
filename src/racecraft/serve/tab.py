"""The page in which cars learn in the browser's own tab, at /tab, where `make site` has built it beside these sources.

A wheel does not bring it: with Python for browsers it is three times as large as all of Racecraft.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import Final

from fastapi import FastAPI
from fastapi.staticfiles import StaticFiles
from starlette.datastructures import Headers
from starlette.responses import RedirectResponse, Response
from starlette.types import Scope

CHECKOUT: Final = Path(__file__).parents[3]
SITE: Final = CHECKOUT / "build" / "site"


def offer(app: FastAPI) -> None:
    """Let the application have the page, if it is there."""
    if (CHECKOUT / "pyproject.toml").is_file() and (SITE / "files.js").is_file():
        app.add_route("/tab", lambda _: RedirectResponse("/tab/"))
        app.mount("/tab", _Files(directory=SITE, html=True))


class _Files(StaticFiles):
    """The page's files. They reach nothing of the console: a reward from a link runs in it, and it needs no server."""

    def file_response(
        self, full_path: str | os.PathLike[str], stat_result: os.stat_result, scope: Scope, status_code: int = 200
    ) -> Response:
        response = super().file_response(full_path, stat_result, scope, status_code)
        response.headers["Content-Security-Policy"] = _policy(Headers(scope=scope).get("host", ""))
        response.headers["Cross-Origin-Opener-Policy"] = "same-origin"  # with the next one: threads over one memory
        response.headers["Cross-Origin-Embedder-Policy"] = "require-corp"
        response.headers["Cache-Control"] = "no-cache"  # ask whether it has changed
        return response


def _policy(host: str) -> str:
    return (
        "default-src 'none'; script-src 'self' 'wasm-unsafe-eval'; style-src 'self' 'unsafe-inline'; "
        f"img-src 'self' data: blob:; connect-src {host}/tab/; worker-src 'self' blob:; manifest-src 'self'; "
        "base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
    )
