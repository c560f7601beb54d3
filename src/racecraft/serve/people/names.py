"""Names of people: as they are shown, and folded, so that no two of them look alike."""

from __future__ import annotations

import re
import unicodedata
from typing import Final

from racecraft.errors import ConfigError, quoted
from racecraft.serve.naming import plain_text

MAX_NAME: Final = 32
ALIKE: Final = ("LATIN", "CYRILLIC", "GREEK")
"""Scripts whose letters are taken for each other: no name has those of two."""
_GONE: Final = re.compile(r"gone\d+")


def checked_name(name: str) -> str:
    """A name as it is shown: composed, with single spaces.

    Raises:
        ConfigError: It is empty, too long, mixes scripts, or is no plain text (`racecraft.serve.naming`).
    """
    shown, told = plain_text(name), quoted(name[:40])
    scripts = {unicodedata.name(sign, "").split(" ")[0] for sign in shown if sign.isalpha()}
    if len(scripts.intersection(ALIKE)) > 1:
        raise ConfigError(f"A name has letters of one script; {told} has some that are taken for others.")
    if not 1 <= len(shown) <= MAX_NAME or not any(sign.isalnum() for sign in shown):
        raise ConfigError(f"A name has 1 to {MAX_NAME} letters, digits and ordinary signs; {told} is none.")
    return shown


def handle_of(name: str) -> str:
    """What two names that are taken for each other have in common: letters and digits, of one width and case."""
    folded = unicodedata.normalize("NFKC", name).casefold()
    bare = unicodedata.normalize("NFKD", folded)
    return "".join(sign for sign in bare if sign.isalnum()) or folded


def gone_name(user_id: int) -> str:
    """What who has deleted their account is called, which the pages say in the reader's language."""
    return f"(gone {user_id})"


def is_gone_name(name: str) -> bool:
    """Whether a name is taken for such a one: with it somebody could pass for gone, or keep another from going."""
    return _GONE.fullmatch(handle_of(name)) is not None
