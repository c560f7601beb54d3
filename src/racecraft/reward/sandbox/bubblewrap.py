"""bubblewrap around the worker, where it works: a file system of its own with what it needs, no network, no host name.

It stands outside of all the other walls, and none of them relies on it. It makes no process numbers of its own: a
process number 1 would ignore the signals by which a hanging worker is asked for its line, and by which an orphan ends.
"""

from __future__ import annotations

import os
import subprocess
from collections.abc import Iterator, Sequence
from typing import Final

SEARCHED: Final = ("/usr/bin/bwrap", "/usr/local/bin/bwrap", "/bin/bwrap")
NAMESPACES: Final = ("--unshare-net", "--unshare-ipc", "--unshare-uts", "--unshare-cgroup-try")
LINKS: Final = ("/lib", "/lib64", "/lib32", "/bin", "/sbin")  # into /usr, on most systems


def find_bubblewrap() -> str:
    """The path of a bubblewrap that works here, or nothing: many systems and containers allow nobody what it does."""
    for path in SEARCHED:
        if os.access(path, os.X_OK):
            command = [path, *NAMESPACES, "--ro-bind", "/", "/", "--", "/bin/true"]
            try:
                tried = subprocess.run(command, stdin=subprocess.DEVNULL, capture_output=True, timeout=10, check=False)
            except (OSError, subprocess.SubprocessError):
                continue
            if tried.returncode == 0:
                return path
    return ""


def around(path: str, readable: Sequence[str], *, info: int) -> list[str]:
    """The command that a worker's own command is appended to.

    Args:
        path: Of bubblewrap.
        readable: Files and folders that exist inside.
        info: File descriptor that it writes the worker's process number to, as JSON.
    """
    return [path, *NAMESPACES, "--info-fd", str(info), *_mounts(readable), "--chdir", "/", "--"]


def _mounts(readable: Sequence[str]) -> Iterator[str]:
    for link in LINKS:
        if os.path.islink(link):
            yield from ("--symlink", os.readlink(link), link)
    for place in sorted(set(readable), key=len):  # a folder before what lies in it
        yield from ("--ro-bind-try", place, place)
    yield from ("--dev-bind", os.devnull, os.devnull)
