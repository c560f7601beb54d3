"""The process of a job: ``python -m racecraft.serve.work RUNS``, with two URLs in the environment.

It loads what jobs need, and waits for one line on its standard input: the job and the name that it was claimed under.
Without a line the server has ended, and so does this.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Final

from racecraft.errors import RunError
from racecraft.serve.quick import loading
from racecraft.serve.settings import ARTIFACTS, DATABASE

NICENESS: Final = 5
"""Jobs leave most of the processor to pages and 3D views, which stay smooth beside a training."""


def main(runs: str) -> int:
    """Do one job; the exit status is 0 unless the process itself failed."""
    if hasattr(os, "nice"):
        os.nice(NICENESS)
    with loading():
        from racecraft.serve.worker import do_job

    told = sys.stdin.readline().split()
    if len(told) != 2:
        return 0
    job_id, owner = told
    database_url, artifacts_url = os.environ.pop(DATABASE), os.environ.pop(ARTIFACTS, "")
    try:
        do_job(job_id, owner=owner, runs=Path(runs), database_url=database_url, artifacts_url=artifacts_url)
    except RunError:
        return 1  # a server is just taking it for dead
    return 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
