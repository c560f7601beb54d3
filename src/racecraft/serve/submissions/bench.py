"""The judges' bench: the process of `racecraft.serve.submissions.judge` as those see it who ask it for verdicts."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import IO, Any, Final

from racecraft import system
from racecraft.errors import RunError
from racecraft.serve.submissions.judge import DIFFERED, DROVE, JUDGED, REFUSED

RESULTS: Final = "judging-"
"""How the folders begin that judgings have for themselves."""
PATIENCE: Final = 600.0  # s
MOST: Final = 1 << 23  # bytes of an answer
BUG: Final = "This is a bug in Racecraft; please report it."
MOST_SHOWN: Final = 1000  # characters of a sentence
CALM: Final[dict[str, str]] = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
"""The whole environment of a judge."""


class DriverFailed(RunError):
    """It was the entry's own fault that it was not judged to the end: one that costs an attempt."""


class Bench:
    """Asks a judge's process, which it starts when it is needed; for one thread at a time."""

    def __init__(self) -> None:
        self._process: subprocess.Popen[bytes] | None = None
        self._lock = threading.Lock()

    @contextmanager
    def asked(self, told: dict[str, Any], *, folder: Path) -> Iterator[tuple[dict[str, Any], Path]]:
        """What the judge says of a submission, and the file of what was driven, until the block ends.

        It has nothing but the folder and what it is told. What it writes lies in a folder of this judging alone: a
        worker that was taken for dead may still have the same submission judged.

        Raises:
            DriverFailed: It cannot drive, or did not end; the message says why.
            RunError: It drove differently the second time, the judge failed, or there is no room.
        """
        try:
            results = TemporaryDirectory(prefix=RESULTS, dir=folder.resolve(), ignore_cleanup_errors=True)
        except OSError as error:
            raise RunError(f"The file cannot be kept: {error.strerror or error}.") from error
        with results as name:
            yield self._ask({**told, "folder": str(folder.resolve()), "results": name}), Path(name) / JUDGED

    def _ask(self, told: dict[str, Any]) -> dict[str, Any]:
        """A child that was got the better of says what it likes: what is not as it has to be is no verdict."""
        with self._lock:
            answer = self._answer(told)
        if answer["status"] == DIFFERED:
            raise RunError("It drove differently the second time.", hint=BUG)
        try:
            said = dict(json.loads(answer["said"])) if answer["status"] in (DROVE, REFUSED) else {}
        except (ValueError, TypeError, RecursionError):
            said = {}
        if answer["status"] == REFUSED and said:
            raise DriverFailed(str(said.get("message"))[:MOST_SHOWN], hint=str(said.get("hint"))[:MOST_SHOWN])
        if not said:
            raise RunError("The judge's process failed.", hint="The server's jobs.log says why.")
        return said

    def _answer(self, told: dict[str, Any]) -> dict[str, Any]:
        process = self._process if self._process is not None and self._process.poll() is None else self._start()
        asked, answers = _pipes(process)
        try:
            asked.write(json.dumps(told).encode() + b"\n")
            asked.flush()
            answer: dict[str, Any] = json.loads(_line(answers))
        except TimeoutError as error:
            self.close()
            raise DriverFailed(f"It drove for more than {PATIENCE:.0f} s and was stopped.") from error
        except (OSError, ValueError) as error:
            self.close()
            raise RunError("The judge's process failed.", hint="The server's jobs.log says why.") from error
        return answer

    def _start(self) -> subprocess.Popen[bytes]:
        self._process = subprocess.Popen(
            [sys.executable, "-P", "-m", "racecraft.serve.submissions.judge"],
            cwd="/",
            env=CALM,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            **system.apart(),  # so that a child which hangs ends with it
        )
        return self._process

    def close(self) -> None:
        """End the judge's process with all that it has begun."""
        if self._process is not None:
            system.end(self._process.pid, with_group=True)
            self._process.wait()
            for pipe in _pipes(self._process):
                with suppress(OSError):
                    pipe.close()
            self._process = None


def clear(folder: Path) -> None:
    """Remove what judgings in a folder have left whose workers were killed; for whoever has their job now."""
    for left in folder.glob(f"{RESULTS}*"):
        shutil.rmtree(left, ignore_errors=True)


def _line(pipe: IO[bytes]) -> bytes:
    """The next line, within the time there is."""
    read, deadline = b"", time.monotonic() + PATIENCE
    while not read.endswith(b"\n"):
        if not system.can_be_read(pipe.fileno(), deadline - time.monotonic()):
            raise TimeoutError
        if not (part := os.read(pipe.fileno(), 1 << 16)) or len(read) > MOST:
            raise ValueError("no answer")
        read += part
    return read


def _pipes(process: subprocess.Popen[bytes]) -> tuple[IO[bytes], IO[bytes]]:
    assert process.stdin is not None
    assert process.stdout is not None
    return process.stdin, process.stdout
