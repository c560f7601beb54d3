"""Whether a process lives, for tests that kill some."""

from __future__ import annotations

import os


def is_alive(process_id: int) -> bool:
    """Whether there is a process of that number, even one that nobody has waited for yet."""
    try:
        os.kill(process_id, 0)
    except ProcessLookupError:
        return False
    return True
