"""The process of a job: ``python -m racecraft.serve.jobs RUNS LOCK BELL``, with the way to its jobs in the environment.

It loads what jobs need, and waits for a line on its standard input: a job and the name that it was claimed under. After
some kinds of jobs it waits for another line. Without one the server has ended, and so does this. LOCK is an open file,
whose lock says that this process lives; a byte in the pipe BELL says that a job has ended.
"""

from __future__ import annotations

import os
import sys
from contextlib import suppress
from pathlib import Path
from typing import Final

from racecraft.serve.quick import loading
from racecraft.system import lower_priority

NICENESS: Final = 15
"""Jobs leave most of the processor to pages and 3D views, which stay smooth beside a training."""


def main(runs: str, lock: str, bell: str) -> int:
    """Do jobs; the exit status is 0 unless the process itself failed."""
    for file in (int(lock), int(bell)):
        os.set_inheritable(file, False)  # they are to end with this process, not with what that starts
    lower_priority(NICENESS)
    with loading():
        from racecraft.serve.jobs.access import Access
        from racecraft.serve.jobs.worker import do_job, load

        load()

    access = Access.from_environment()
    while len(told := sys.stdin.readline().split()) == 2:
        job_id, owner = told
        try:
            stays = do_job(job_id, owner=owner, runs=Path(runs), access=access)
        finally:
            with suppress(OSError):  # there is no server any more, or it has been told often enough
                os.write(int(bell), b".")
        if not stays:
            break
    return 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
