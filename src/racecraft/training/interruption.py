"""Ctrl-C: once for a clean end, twice for an immediate one."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType

from racecraft import system


@contextmanager
def interruptible(stopping: threading.Event, stop: Callable[[], None]) -> Iterator[None]:
    """Turn the first Ctrl-C or SIGTERM into a clean end; a second Ctrl-C interrupts at once.

    Args:
        stopping: Set once the end is near, by `stop` or by others.
        stop: Asks for the end. A thread other than the main one gets no signals, and runs without.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def handle(number: int, frame: FrameType | None) -> None:
        if stopping.is_set() and number == signal.SIGINT:
            raise KeyboardInterrupt
        stop()

    before = {number: signal.signal(number, handle) for number in system.STOPS}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
