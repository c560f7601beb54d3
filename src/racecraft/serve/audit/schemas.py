"""What the server tells of the audit log."""

from __future__ import annotations

from datetime import datetime
from typing import Any

from racecraft.serve.schemas import Message


class AuditLine(Message):
    """Somebody did something with power."""

    id: int
    when: datetime
    who: int
    name: str
    what: str
    target: str
    details: dict[str, Any]
    is_done: bool
