"""What people call themselves and their things: text on one line that harms no text beside it, in any script.

Refused are signs that nobody sees or that turn the text around, accents piled over the lines above and below, and signs
as wide as a line. Joiners stay where a script or an emoji needs them: Sinhala's Sri, Persian, a family.
"""

from __future__ import annotations

import unicodedata
from typing import Final

from pydantic import AfterValidator

from racecraft.errors import ConfigError

UNSEEN: Final = frozenset("\u034f\u115f\u1160\u17b4\u17b5\u180b\u180c\u180d\u180f\u2800\u3164\uffa0")
"""Letters, marks and signs that show nothing, beside those that Unicode calls formats and controls."""
JOINER, SEPARATOR, STYLES = "\u200d", "\u200c", "\ufe0e\ufe0f"
"""Zero-width joiner and non-joiner; whether an emoji is coloured."""
WIDE: Final = frozenset("\u2e3a\u2e3b\ufdfd")
CUNEIFORM: Final = range(0x12000, 0x12550)
"""Some of its signs are ten letters wide, and nobody's name has any."""
MOST_ABOVE: Final = 2
"""Accents on a letter that every script shares: Vietnamese has two, where they are not part of the letter."""
MOST_MARKS: Final = 5
"""Of a script's own: Burmese has as many in a syllable."""
VIRAMA: Final = 9  # Unicode's class of signs that take the vowel from a consonant


def plain_text(text: str) -> str:
    """The text as it is shown: composed, with single spaces.

    Raises:
        ConfigError: It has what is refused.
    """
    shown = " ".join(unicodedata.normalize("NFC", text).split())
    for place, sign in enumerate(shown):
        if not (_is_seen(sign) or _joins(shown, place)):
            raise ConfigError(
                f"{shown[:40]!r} has a sign that nobody sees, or that turns the text around.", hint="Type it anew."
            )
        if sign in WIDE or ord(sign) in CUNEIFORM or len(unicodedata.normalize("NFKC", sign)) > 4:
            raise ConfigError(f"{shown[:40]!r} has a sign that is as wide as many letters.", hint="Leave it out.")
    run: list[str] = []
    for sign in shown:
        run = [*run, sign] if unicodedata.category(sign).startswith("M") and sign not in STYLES else []
        shared = sum(unicodedata.combining(mark) >= 200 for mark in run)
        if len(run) > MOST_MARKS or shared > MOST_ABOVE or len(set(run)) < len(run):
            raise ConfigError(
                f"{shown[:40]!r} has more accents on a letter than any script.", hint="Leave some of them out."
            )
    return shown


def _is_seen(sign: str) -> bool:
    return unicodedata.category(sign)[0] in "LMNPSZ" and sign not in UNSEEN and not 0xE0100 <= ord(sign) <= 0xE01EF


def _joins(text: str, place: int) -> bool:
    """Whether a joiner is where a script or an emoji has one."""
    sign, before, after = text[place], text[:place].rstrip(STYLES)[-1:], text[place + 1 : place + 2]
    if sign not in (JOINER, SEPARATOR) or not before or not after:
        return False
    if unicodedata.combining(before) == VIRAMA:
        return after.isalpha()
    if sign == SEPARATOR:
        return all(unicodedata.name(letter, "").startswith("ARABIC LETTER") for letter in (before, after))
    return unicodedata.category(before) in ("So", "Sk") and unicodedata.category(after) == "So"


PLAIN: Final = AfterValidator(plain_text)
"""In a message's type behind what limits the text: it is such a one."""
