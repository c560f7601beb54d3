"""What the console's server refuses, each kind with the status of its reply (`racecraft.serve.replies`).

Without a word of HTTP: jobs know these too, and would load the whole server for them.
"""

from __future__ import annotations

from racecraft.errors import RunError


class NotFound(RunError):
    """There is no such thing; 404."""


class Conflict(RunError):
    """It exists already, or is in use; 409."""


class NotLetIn(RunError):
    """A password, a card or a code that is not good; 401."""


class TooMany(RunError):
    """Too many failures; 429."""


class Unreachable(RunError):
    """Another machine, on which this depends, does not answer as it should; 502."""
