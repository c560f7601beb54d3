"""Names of people: as they are shown, and folded, so that no two of them look alike."""

from __future__ import annotations

import unicodedata
from typing import Final

from racecraft.errors import ConfigError

MAX_NAME: Final = 32


def checked_name(name: str) -> str:
    """A name as it is shown: composed, with single spaces.

    Raises:
        ConfigError: It is empty, too long, or has signs that cannot be seen or turn the text around.
    """
    shown = " ".join(unicodedata.normalize("NFC", name).split())
    is_plain = all(unicodedata.category(sign)[0] in "LMNPSZ" for sign in shown)
    if not 1 <= len(shown) <= MAX_NAME or not is_plain or not any(sign.isalnum() for sign in shown):
        raise ConfigError(f"A name has 1 to {MAX_NAME} letters, digits and ordinary signs; {name[:40]!r} is none.")
    return shown


def handle_of(name: str) -> str:
    """What two names that are taken for each other have in common: letters and digits, of one width and case."""
    folded = unicodedata.normalize("NFKC", name).casefold()
    bare = unicodedata.normalize("NFKD", folded)
    return "".join(sign for sign in bare if sign.isalnum()) or folded
