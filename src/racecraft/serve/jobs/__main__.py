"""The process of a job: ``python -m racecraft.serve.jobs RUNS LOCK``, with two URLs in the environment.

It loads what jobs need, and waits for one line on its standard input: the job and the name that it was claimed under.
Without a line the server has ended, and so does this. LOCK is an open file, whose lock says that this process lives.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Final

from racecraft.serve.quick import loading
from racecraft.serve.settings import ARTIFACTS, DATABASE

NICENESS: Final = 15
"""Jobs leave most of the processor to pages and 3D views, which stay smooth beside a training."""


def main(runs: str, lock: str) -> int:
    """Do one job; the exit status is 0 unless the process itself failed."""
    os.set_inheritable(int(lock), False)  # it is to end with this process, not with what that starts
    if hasattr(os, "nice"):
        os.nice(NICENESS)
    with loading():
        from racecraft.serve.jobs.worker import do_job, load

        load()

    told = sys.stdin.readline().split()
    if len(told) != 2:
        return 0
    job_id, owner = told
    database_url, artifacts_url = os.environ.pop(DATABASE), os.environ.pop(ARTIFACTS, "")
    do_job(job_id, owner=owner, runs=Path(runs), database_url=database_url, artifacts_url=artifacts_url)
    return 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
