"""Settings files of shells, such as deepracer-for-cloud's ``run.env``: read, never sourced.

    DR_WORLD_NAME=reinvent_base          # a comment
    export DR_DISPLAY_NAME="My car"
    DR_LOCAL_S3_REWARD_KEY=$DR_LOCAL_S3_CUSTOM_FILES_PREFIX/reward_function.py

Nothing is expanded or run: a value with a variable or a command in it is marked, and its text stays as it stands.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import Final

from racecraft.errors import ConfigError

MAX_BYTES: Final = 1 << 18
MAX_LINES: Final = 5_000
MAX_VALUE: Final = 4_096  # characters
_ASSIGNMENT: Final = re.compile(r"(?:export\s+)?([A-Za-z_][A-Za-z0-9_]*)\s*=\s*(.*)", re.DOTALL)
_VARIABLE: Final = re.compile(r"\$[A-Za-z_{(0-9?@*#!-]|`")
_DOUBLE: Final = re.compile(r'"((?:[^"\\]|\\.)*)"(.*)', re.DOTALL)
_SINGLE: Final = re.compile(r"'([^']*)'(.*)", re.DOTALL)
_COMMENT: Final = re.compile(r"\s+#.*|\s*", re.DOTALL)


@dataclass(frozen=True)
class EnvSetting:
    """One assignment."""

    name: str
    value: str
    """Without its quotes."""
    line: int
    """From 1."""
    is_variable: bool
    """The value names a variable or runs a command, which only a shell could resolve."""


@dataclass(frozen=True)
class EnvFile:
    """What a settings file says."""

    settings: dict[str, EnvSetting] = field(default_factory=dict)
    """By name, in the file's order; the last assignment counts, as in a shell."""
    notes: tuple[str, ...] = ()
    """Sentences about lines that say nothing that can be used."""


def parse_env(text: str, *, name: str) -> EnvFile:
    """The assignments of a settings file.

    Args:
        text: Its content.
        name: What messages call it.

    Raises:
        ConfigError: It is too long, or holds what no text file holds.
    """
    if "\0" in text:
        raise ConfigError(f"{name} is no text file: it holds a NUL.")
    lines = text.replace("\r\n", "\n").replace("\r", "\n").split("\n")
    if len(lines) > MAX_LINES:
        raise ConfigError(f"{name} has more than {MAX_LINES:,} lines, too many for a settings file.")
    settings: dict[str, EnvSetting] = {}
    notes = []
    for number, line in enumerate(lines, 1):
        stripped = line.strip()
        if not stripped or stripped.startswith("#"):
            continue
        assignment = _ASSIGNMENT.fullmatch(stripped)
        if assignment is None:
            notes.append(f"{name}, line {number}: {_shown(stripped)} is not NAME=VALUE and was left out.")
            continue
        key, rest = assignment[1], assignment[2]
        read = _value(rest)
        if read is None or len(read[0]) > MAX_VALUE:
            problem = (
                "does not end where its quote ends" if read is None else f"is longer than {MAX_VALUE:,} characters"
            )
            notes.append(f"{name}, line {number}: the value of {key[:80]} {problem}; it was left out.")
            continue
        if key in settings:
            notes.append(
                f"{name}, line {number}: {key[:80]} is set again; line {settings.pop(key).line} has no effect."
            )
        settings[key] = EnvSetting(key, read[0], number, read[1])
    return EnvFile(settings, tuple(notes))


def _value(text: str) -> tuple[str, bool] | None:
    """A value and whether it holds a variable; None when its quotes do not go together."""
    if text.startswith('"'):
        quoted = _DOUBLE.fullmatch(text)
        if quoted is None or not _COMMENT.fullmatch(quoted[2]):
            return None
        plain = re.sub(r"\\.", "", quoted[1])
        return re.sub(r'\\(["\\$`])', r"\1", quoted[1]), bool(_VARIABLE.search(plain))
    if text.startswith("'"):
        quoted = _SINGLE.fullmatch(text)
        if quoted is None or not _COMMENT.fullmatch(quoted[2]):
            return None
        return quoted[1], False
    plain = "" if text.startswith("#") else re.split(r"\s#", text, maxsplit=1)[0].strip()
    return plain, bool(_VARIABLE.search(plain))


def _shown(text: str) -> str:
    return ascii(text if len(text) <= 60 else f"{text[:57]}...")
