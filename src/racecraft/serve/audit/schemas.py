"""What the server tells of the audit log."""

from __future__ import annotations

from datetime import datetime
from typing import Any

from racecraft.serve.schemas import Message


class AuditLine(Message):
    """Somebody did something with power."""

    id: int
    when: datetime
    who: int | None
    name: str
    """As they are called now; empty of who was not let in under any name that there is."""
    what: str
    """The operation of the API, such as ``print_cards``."""
    target: str
    """Its address, which holds the numbers of what it was done to."""
    details: dict[str, Any]
    is_done: bool
    """False for one that is under way, or that a killed server left."""
