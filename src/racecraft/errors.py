"""Every error a user can meet: one sentence saying what is wrong with which value, what is allowed, what to do next.

The command line prints ``str(error)`` and, where there is one, ``hint``; it never shows a stack trace for these.
"""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterable
from itertools import islice
from typing import Any, Final

MOST_CHARACTERS: Final = 80  # characters of a name, and MOST_NAMES of these, that a suggestion is looked for among
MOST_NAMES: Final = 500


_JOINED: Final = re.compile(r"(?<=[^\x00-\x7f])\u200d(?=[^\x00-\x7f])")  # elsewhere it may be what is wrong


class RacecraftError(Exception):
    """Base of all errors that Racecraft raises on purpose.

    What it says may quote a stranger's file, so nothing in it drives a terminal or cannot be encoded.

    Args:
        message: One sentence with the value at fault and what is allowed.
        hint: What to do next, when the message alone does not say it.
    """

    def __init__(self, message: str, *, hint: str = "") -> None:
        super().__init__(printable_lines(message))
        self.hint = printable_lines(hint)


class TrackError(RacecraftError, ValueError):
    """A track's geometry or file is not drivable."""


class TrackNotFound(RacecraftError, LookupError):
    """No track has this name or path."""


class ShapeError(RacecraftError, ValueError):
    """An array has the wrong shape or type."""


class NonFiniteAction(RacecraftError, ValueError):
    """An action holds NaN or infinity."""


class ResetNeeded(RacecraftError, RuntimeError):
    """An episode is over, or none has begun, and a step was asked for."""


class ConfigError(RacecraftError, ValueError):
    """A setting, or a field of one of AWS's files, is outside what is allowed."""


class RewardError(RacecraftError, ValueError):
    """A reward function is not valid, or failed while it ran.

    Args:
        message: What is wrong, with the line of the user's file.
        hint: What to do next.
        line: Line of the user's file, from 1, where it is known.
        column: Column of that line, from 1, where it is known.
        row_index: Row of the batch whose call failed.
        params: The dict that the failing call was given.
    """

    def __init__(
        self,
        message: str,
        *,
        hint: str = "",
        line: int | None = None,
        column: int | None = None,
        row_index: int | None = None,
        params: dict[str, Any] | None = None,
    ) -> None:
        super().__init__(message, hint=hint)
        self.line = line
        self.column = column
        self.row_index = row_index
        self.params = params


class RewardTimeout(RewardError):
    """A reward function did not return in its time."""


class CheckpointError(RacecraftError, ValueError):
    """A checkpoint is damaged or does not fit what it is loaded into."""


class RunError(RacecraftError, ValueError):
    """A run folder is missing, in use or unreadable."""


class InUse(RunError):
    """Another process, or another part of this one, holds what only one may hold."""


class ReplayError(RacecraftError, ValueError):
    """A replay file is damaged, hostile, of another version, or not what a re-simulation gives."""


class ArchiveError(RacecraftError, ValueError):
    """An archive is damaged, hostile, or of a kind that is not read."""


class SourceError(RacecraftError, ValueError):
    """What is to be imported is not something that is understood."""


class TrainingError(RacecraftError, RuntimeError):
    """Training cannot go on; the last checkpoint is good."""


def printable(text: str) -> str:
    """Somebody else's words for a message, without what could drive a terminal."""
    return "".join(mark if mark.isprintable() else "�" for mark in text)


def printable_lines(text: str) -> str:
    """The same of words that may have several lines."""
    return text if text.isprintable() else "\n".join(map(printable, text.split("\n")))


def typed(path: object) -> str:
    """A path or a name as it is typed into a shell: in quotes where it has spaces or other signs that a shell reads."""
    import shlex  # which few commands need

    return shlex.quote(str(path))


def did_you_mean(name: str, known: Iterable[str]) -> str:
    """A suggestion such as ``Did you mean 'oval'?`` for a misspelt name, or an empty string; capitals do not count.

    Comparing takes the product of their lengths: a stranger's names are compared only where they are short and few.
    """
    if len(name) > MOST_CHARACTERS:
        return ""
    short = list(islice((one for one in known if len(one) <= MOST_CHARACTERS), MOST_NAMES))
    folded = {one.lower(): one for one in reversed(short)}
    close = difflib.get_close_matches(name.lower(), folded, n=1, cutoff=0.5)
    return f"Did you mean '{folded[close[0]]}'?" if close else ""


def quoted(name: str) -> str:
    """Somebody's name for a message, in quotes; of an emoji that is joined of several, these, without codes."""
    return repr(_JOINED.sub("", name))
