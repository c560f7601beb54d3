"""What an archive may be: limits of size and number, clean names, and the guard that refuses everything else."""

from __future__ import annotations

import unicodedata
from dataclasses import dataclass
from typing import Final, NoReturn, Protocol

from racecraft.errors import ArchiveError

MAX_NAME: Final = 500  # characters
MAX_PARTS: Final = 20  # folders deep
CHUNK: Final = 1 << 16  # bytes read at once
_UNSEEN: Final = ("Cc", "Cf", "Cs", "Co", "Cn", "Zl", "Zp")  # Unicode categories that names have no use for


@dataclass(frozen=True, kw_only=True)
class Limits:
    """How much of an archive is read before it is refused. A model with its logs takes a tenth of each."""

    file_bytes: int = 1 << 30
    """Of the archive itself."""
    members: int = 20_000
    """Files and folders."""
    member_bytes: int = 1 << 30
    """Of one member, unpacked."""
    total_bytes: int = 2 << 30
    """Of all members, unpacked."""
    ratio: int = 100
    """Unpacked to packed size; beyond it the archive is a bomb."""
    ratio_grace: int = 1 << 22
    """Unpacked bytes before the ratio counts: padding shrinks to nothing."""
    large_ratio: int = 20
    """The same ratio of what is large: weights hardly shrink, logs to an eighth."""
    large_bytes: int = 1 << 28
    """Unpacked bytes that are large."""


class Member(Protocol):
    """One file of an archive, good until the next one is asked for."""

    @property
    def name(self) -> str:
        """Clean relative path with forward slashes."""

    @property
    def size(self) -> int:
        """Bytes, unpacked."""

    def read(self, count: int) -> bytes:
        """The next bytes, at most ``count``; none at the end."""


class Guard:
    """Counts what is read of an archive and refuses what goes beyond its limits.

    Args:
        archive: What messages call it.
        limits: How much is allowed.
    """

    def __init__(self, archive: str, limits: Limits) -> None:
        self.archive = archive
        self.limits = limits
        self._members = 0
        self._total = 0
        self._kinds: dict[str, tuple[str, bool]] = {}  # folded name -> as written, is it a folder

    def enter(self, name: str, size: int, *, is_folder: bool = False) -> str:
        """A member begins: its clean name, when name, size and number are allowed."""
        self._members += 1
        if self._members > self.limits.members:
            self.refuse(f"has more than {self.limits.members:,} members")
        clean = self._clean(name)
        if size > self.limits.member_bytes:
            self.refuse(f"unpacks {shown(clean)} to {size:,} bytes, more than {self.limits.member_bytes:,}")
        if clean:
            self._remember(clean, is_folder=is_folder)
        elif not is_folder:
            self.refuse(f"has a member without a name, {shown(name)}")
        return clean

    def count(self, unpacked: int, *, packed_so_far: int) -> None:
        """So many bytes came out, after so many of the archive went in."""
        self._total += unpacked
        if self._total > self.limits.total_bytes:
            self.refuse(f"unpacks to more than {self.limits.total_bytes:,} bytes")
        self.check_ratio(self._total, packed_so_far)

    def check_ratio(self, unpacked: int, packed: int) -> None:
        """Refuse what grows more than a model does."""
        limits = self.limits
        ratio = limits.large_ratio if unpacked > limits.large_bytes else limits.ratio
        if unpacked > limits.ratio_grace and unpacked > ratio * packed:
            self.refuse(f"grows to more than {ratio} times its size, as only a bomb does")

    def refuse(self, what: str) -> NoReturn:
        """Raise; ``what`` continues the archive's name to a sentence."""
        raise ArchiveError(f"{self.archive} {what}.", hint="Nothing of it was used.")

    def _clean(self, name: str) -> str:
        """The name without ``./`` and a last ``/``; refused when it could lead elsewhere or be taken for another."""
        if len(name) > MAX_NAME:
            self.refuse(f"has a name of {len(name):,} characters, more than {MAX_NAME}")
        for character in name:
            if unicodedata.category(character) in _UNSEEN:
                self.refuse(f"has a name with a character that cannot be seen, {shown(name)}")
        folded = unicodedata.normalize("NFKC", name)  # full-width dots and slashes become plain ones
        if "\\" in folded:
            self.refuse(f"has a name with a backslash, {shown(name)}")
        if folded.startswith("/") or any(part[1:2] == ":" for part in folded.split("/")):
            self.refuse(f"has an absolute name, {shown(name)}")
        if folded.count("/") != name.count("/"):
            self.refuse(f"has a name with something like a slash, {shown(name)}")
        parts = [part for part in name.split("/") if part not in ("", ".")]
        if len(parts) > MAX_PARTS:
            self.refuse(f"has folders {len(parts)} deep, more than {MAX_PARTS}")
        for part in parts:
            if not unicodedata.normalize("NFKC", part).strip(". "):
                self.refuse(f"has a name that leads out of its folder, {shown(name)}")
        return "/".join(parts)

    def _remember(self, name: str, *, is_folder: bool) -> None:
        """Refuse two members that some system cannot tell apart, and files that are folders elsewhere."""
        parts = name.split("/")
        for depth in range(1, len(parts) + 1):
            prefix = "/".join(parts[:depth])
            is_inner = is_folder or depth < len(parts)
            key = unicodedata.normalize("NFKC", prefix).casefold()
            known = self._kinds.get(key)
            if known is None:
                self._kinds[key] = (prefix, is_inner)
            elif not (is_inner and known[1]):
                self.refuse(f"has {shown(prefix)} twice, the first time as {shown(known[0])}")


def shown(name: str) -> str:
    """A name for a message: printable, shortened."""
    text = ascii(name)
    return text if len(text) <= 80 else f"{text[:60]}...{text[-17:]}"
