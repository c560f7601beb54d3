"""Archives of strangers as a stream of bounded members: tar, tar.gz and zip, never unpacked to where they ask.

    for member in read_archive(path):
        if member.name == "reward_function.py":
            source = member.read(1 << 20)

A member is a clean relative name and bytes to read; nothing else of an archive exists here: no owners, modes, links or
times. Whatever a member's reader leaves is read past and checked, so an archive is whole when the loop ends.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO, Final

from racecraft.checks import check_type
from racecraft.errors import ArchiveError
from racecraft.importing.archive_guard import Guard, Limits, Member
from racecraft.importing.tar_reader import read_tar
from racecraft.importing.zip_reader import read_zip
from racecraft.json_file import open_regular

DEFAULT_LIMITS: Final = Limits()
_OTHERS: Final = {
    b"BZh": "bzip2",
    b"\xfd7zXZ\x00": "xz",
    b"\x28\xb5\x2f\xfd": "zstandard",
    b"7z\xbc\xaf\x27\x1c": "7z",
    b"Rar!": "rar",
}


def read_archive(path: str | Path, *, limits: Limits = DEFAULT_LIMITS) -> Iterator[Member]:
    """The files of a tar, tar.gz or zip archive, in the archive's order.

    Raises:
        ConfigError: It is no path.
        ArchiveError: Not readable, of another kind, damaged, or with anything in it that a download of a model does not
            have: names that lead elsewhere, links, devices, bombs. What was read until then is not to be believed.
    """
    check_type("path", path, (str, os.PathLike), "use the path of an archive")
    path = Path(path)
    with _opened(path, limits) as file:
        start = file.read(512)
        file.seek(0)
        try:
            if start.startswith((b"PK\x03\x04", b"PK\x05\x06")):
                yield from read_zip(file, Guard(path.name, limits))
            else:
                _refuse_others(path, start)
                yield from read_tar(file, Guard(path.name, limits), is_gzip=start.startswith(b"\x1f\x8b"))
        except OSError as error:
            raise ArchiveError(f"{path.name} cannot be read: {error.strerror or error}.") from error


def is_archive_name(name: str) -> bool:
    """Whether a file's name says that it is an archive, of whatever kind."""
    return name.lower().endswith((".tar", ".gz", ".tgz", ".zip", ".bz2", ".xz", ".zst", ".7z", ".rar"))


def _opened(path: Path, limits: Limits) -> BinaryIO:
    """The archive, when it is a regular file of an allowed size; never waits on a pipe."""
    try:
        file = open_regular(path)
    except (OSError, ValueError) as error:
        raise ArchiveError(f"{path} cannot be read: {getattr(error, 'strerror', None) or error}.") from error
    size = os.fstat(file.fileno()).st_size  # the caller's with statement closes it
    if size > limits.file_bytes:
        file.close()
        raise ArchiveError(f"{path.name} has {size:,} bytes; archives of at most {limits.file_bytes:,} are read.")
    return file


def _refuse_others(path: Path, start: bytes) -> None:
    for magic, kind in _OTHERS.items():
        if start.startswith(magic):
            raise ArchiveError(
                f"{path.name} is an archive of the kind {kind}; tar, tar.gz and zip are read.",
                hint="Unpack it, import the folder.",
            )
