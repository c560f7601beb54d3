"""Files that are either the old or the new one, and what is said where they cannot be written."""

from __future__ import annotations

import errno
import os
from pathlib import Path

import pytest

from racecraft.run.atomic import write_file


def test_a_disk_that_is_full_keeps_the_old_file_and_is_told_with_its_path(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(descriptor: int, data: memoryview) -> int:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    write_file(tmp_path / "a", b"old")
    monkeypatch.setattr(os, "write", full)
    with pytest.raises(OSError, match="No space left") as told:
        write_file(tmp_path / "a", b"new")
    assert (told.value.filename, told.value.errno) == (str(tmp_path / "a"), errno.ENOSPC)
    assert [path.read_bytes() for path in tmp_path.iterdir()] == [b"old"]


def test_a_folder_in_the_way_is_told_by_its_own_name(tmp_path: Path) -> None:
    (tmp_path / "a").mkdir()
    with pytest.raises(OSError, match="directory") as told:
        write_file(tmp_path / "a", b"new")
    assert (told.value.filename, told.value.filename2) == (str(tmp_path / "a"), None)
    assert str(told.value).endswith(f": {str(tmp_path / 'a')!r}")  # without "-> None" behind it
    assert [path.name for path in tmp_path.iterdir()] == ["a"]
