"""Where trials are trained: in this process, or in others beside it.

A seat makes one trial at a time. Another process is given a line of JSON for each, `Order` in and `Report` out, and
ends with whoever started it, however that ends.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import threading
from contextlib import suppress
from typing import Any, Protocol

from racecraft import errors, system
from racecraft.errors import RacecraftError
from racecraft.training.job import Training
from racecraft.tuning.trial import Order, Report, run_trial


class SeatLost(Exception):
    """What made the trial died; the trial is not to blame before it has happened again and again."""


class Seat(Protocol):
    """A place for one trial at a time."""

    def run(self, order: Order) -> Report:
        """Make a trial.

        Raises:
            RacecraftError: It cannot be trained.
            SeatLost: Nobody knows how it ended.
        """

    def stop(self) -> None:
        """End the trial under way for good; safe from any thread."""

    def close(self) -> None:
        """Nothing more is to be done."""


class HereSeat:
    """In a thread of this process."""

    def __init__(self) -> None:
        self._training: Training | None = None
        self._is_stopped = False

    def run(self, order: Order) -> Report:
        """See `Seat`."""
        return run_trial(order, on_training=self._begin)

    def _begin(self, training: Training) -> None:
        self._training = training
        if self._is_stopped:  # before there was one to be stopped
            training.stop()

    def stop(self) -> None:
        """See `Seat`."""
        self._is_stopped = True
        if self._training is not None:
            self._training.stop()

    def close(self) -> None:
        """See `Seat`."""


class ProcessSeat:
    """In a process of its own, which is started with the first trial."""

    def __init__(self) -> None:
        self._process: subprocess.Popen[bytes] | None = None
        self._is_stopped = False

    def run(self, order: Order) -> Report:
        """See `Seat`."""
        process = self._started()
        assert process.stdin is not None
        assert process.stdout is not None
        if self._is_stopped:  # before there was a process to be stopped
            process.terminate()
        with suppress(BrokenPipeError):
            process.stdin.write(json.dumps(order.to_dict()).encode() + b"\n")
            process.stdin.flush()
        line = process.stdout.readline()
        if not line.endswith(b"\n"):
            with suppress(subprocess.TimeoutExpired):
                process.wait(5.0)  # it is about to say how it ended
            self.close()
            raise SeatLost(f"The process that trained it ended with status {process.returncode}.")
        answer = json.loads(line)
        if "error" in answer:
            raise error_of(answer["error"])
        return Report.from_dict(answer)

    def _started(self) -> subprocess.Popen[bytes]:
        if self._process is None:
            self._process = subprocess.Popen(
                [sys.executable, "-P", "-m", "racecraft.tuning"],  # -P: no random.py of the user's instead of Python's
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                **system.apart(),  # Ctrl-C is for who searches
            )
        return self._process

    def stop(self) -> None:
        """See `Seat`."""
        self._is_stopped = True
        process = self._process
        if process is not None:
            process.terminate()  # a training saves itself and ends; before one has begun the process just ends

    def close(self) -> None:
        """See `Seat`."""
        process, self._process = self._process, None
        if process is not None:
            process.kill()
            process.wait()
            for pipe in (process.stdin, process.stdout):
                assert pipe is not None
                with suppress(OSError):
                    pipe.close()


def serve_seat() -> None:
    """The work of a `ProcessSeat`'s process: a trial for every line on stdin, until that is closed."""
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # whatever prints is not to be taken for an answer
    orders, arrived = [], threading.Semaphore(0)

    def listen() -> None:
        for line in sys.stdin.buffer:
            orders.append(line)
            arrived.release()
        system.end(os.getpid())  # who searches is gone, and begins this trial again

    threading.Thread(target=listen, name="orders", daemon=True).start()
    while arrived.acquire():
        try:
            answer = run_trial(Order.from_dict(json.loads(orders.pop()))).to_dict()
        except RacecraftError as error:
            answer = {"error": told(error)}
        answers.write(json.dumps(answer).encode() + b"\n")
        answers.flush()


def told(error: RacecraftError) -> dict[str, Any]:
    """An error for another process."""
    return {"kind": type(error).__name__, "message": str(error), "hint": error.hint}


def error_of(document: dict[str, Any]) -> RacecraftError:
    """The error that another process met."""
    kind = getattr(errors, document["kind"], RacecraftError)
    error: RacecraftError = kind(document["message"], hint=document["hint"])
    return error
