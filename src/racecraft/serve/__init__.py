"""The console's server: HTTP below /api, live data, jobs in child processes, and the built pages.

    browser ──HTTP, SSE──▶ routes ──▶ garage (run folders), courses (tracks), job queue (database)
                                              supervisor ──starts──▶ work (a child process per job)
                             events ◀── history.jsonl, .live ◀── training

Run folders are the truth about models; the database holds jobs, tags, sessions and races.
"""

from racecraft.serve.app import create_app
from racecraft.serve.server import serve
from racecraft.serve.settings import ServeSettings

__all__ = ["ServeSettings", "create_app", "serve"]
