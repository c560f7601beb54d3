"""Reads sources in processes of their own, with limits of time and memory, for a process that others wait for.

    with read_by(Aside()):
        check_reward(source)  # by a child; so do `keeps_state` and all others that are marked with `reads`

What the children are asked and what they find is in `racecraft.reward.reading_process`.
"""

from __future__ import annotations

import json
import subprocess
import sys
import threading
from collections import OrderedDict
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

from racecraft.errors import RewardError
from racecraft.reward.check import Problem
from racecraft.reward.launch import INTERPRETER_OPTIONS, bare_environment
from racecraft.reward.literals import Literal

PROGRAM: Final = Path(__file__).resolve().with_name("reading_process.py")
AT_ONCE: Final = 4
"""Children at a time, of a gigabyte each at most; who waits for one keeps nobody else waiting."""
PATIENCE: Final = 60.0  # s of the wall: the machine may be busy
KEPT: Final = 8
"""Sources whose readings are kept: whatever is done about one asks several times."""
MOST_CPU: Final = 6
"""s of a core for one source; the slowest that people write, 140,000 characters, takes less than one."""
Reading = Mapping[str, Any]


class Aside:
    """A reader for `racecraft.reward.reading.read_by`, for any number of threads.

    Args:
        seconds: Of a core, that the reading of a source may take.
    """

    def __init__(self, *, seconds: int = MOST_CPU) -> None:
        self._seconds = seconds
        self._kept: OrderedDict[str, Reading] = OrderedDict()
        self._lock = threading.Lock()
        self._places = threading.BoundedSemaphore(AT_ONCE)

    def __call__(self, name: str, source: str) -> Any:
        """What the function of this name finds in the source.

        Raises:
            ValueError: The function finds no Python there.
            RewardError: No child can be started.
        """
        with self._lock:
            found = self._kept.get(source)
        if found is None:
            with self._places:
                found = _read(source, self._seconds)
            with self._lock:
                self._kept[source] = found
                while len(self._kept) > KEPT:
                    self._kept.popitem(last=False)
        if name not in found:
            raise ValueError("it cannot be read")
        return found[name]


def _read(source: str, seconds: int) -> Reading:
    """By a child."""
    command = [sys.executable, *INTERPRETER_OPTIONS, str(PROGRAM), str(seconds)]
    try:
        ended = subprocess.run(
            command,
            input=json.dumps(source).encode(),
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            cwd="/",
            env=bare_environment(),
            timeout=PATIENCE,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return _too_much(seconds)
    except OSError as error:
        raise RewardError(f"The source cannot be read now: {error.strerror or error}.", hint="Try again.") from error
    if ended.returncode != 0:
        return _too_much(seconds)
    found: dict[str, Any] = json.loads(ended.stdout)
    found["check_reward"] = [Problem(*values) for values in found["check_reward"]]
    if "find_literals" in found:
        found["find_literals"] = {name: Literal(*values) for name, values in found["find_literals"].items()}
    return found


def _too_much(seconds: int) -> Reading:
    """Where a child was ended: the worker that runs such a source all the same is to say so itself."""
    problem = Problem(
        1,
        1,
        f"Python takes more than {seconds} s, or too much memory, to read this source.",
        "Make it shorter, and nest and repeat less in it.",
    )
    return {"check_reward": [problem], "keeps_state": True, "needed_modules": [], "used_words": []}
