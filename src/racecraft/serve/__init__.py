"""The console's server: HTTP below /api, live data, jobs in child processes, and the built pages.

    browser ──HTTP, SSE──▶ routes ──▶ garage (run folders), courses (tracks), job queue (database)
                                              supervisor ──starts──▶ work (a child process per job)
                             events ◀── history.jsonl, .live ◀── training

Run folders are the truth about models; the database holds jobs, tags, sessions and races. A room for each subject, with
its messages (schemas.py), its logic, its routes and its jobs (tasks.py).
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from racecraft.serve.app import create_app as create_app
    from racecraft.serve.server import serve as serve
    from racecraft.serve.settings import ServeSettings as ServeSettings

_HOME = {"create_app": "app", "serve": "server", "ServeSettings": "settings"}

__all__ = ["ServeSettings", "create_app", "serve"]


def __getattr__(name: str) -> Any:
    """Import on first use: the workers of jobs do without the web server."""
    if name in _HOME:
        return getattr(import_module(f"racecraft.serve.{_HOME[name]}"), name)
    raise AttributeError(f"module 'racecraft.serve' has no attribute {name!r}")
