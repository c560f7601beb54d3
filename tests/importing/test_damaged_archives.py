"""Archives that are damaged, cut off or contradict themselves, and any bytes at all."""

from __future__ import annotations

import gzip
import tarfile
from collections.abc import Callable
from pathlib import Path

import pytest
from archives_made import FILES, make_tar, make_zip, member, patched, read
from hypothesis import given, settings
from hypothesis import strategies as st

from racecraft.errors import ArchiveError
from racecraft.importing.archive import read_archive
from racecraft.importing.archive_guard import Limits


@pytest.mark.parametrize("pack", [make_tar, lambda files: gzip.compress(make_tar(files)), make_zip])
def test_cut_off_anywhere(pack: Callable[[dict[str, bytes]], bytes], tmp_path: Path) -> None:
    data = pack({"a": bytes(range(256)) * 4, "b": b"1"})
    whole = data.rstrip(b"\0") if pack is make_tar else data
    for length in range(0, len(whole) - 1, max(1, len(whole) // 97)):
        with pytest.raises(ArchiveError):
            read(data[:length], tmp_path)


def test_wrong_checksums(tmp_path: Path) -> None:
    tar = bytearray(make_tar({"a": b"1", "b": b"2"}))
    tar[1024 + 5] ^= 1  # the name in the second header
    with pytest.raises(ArchiveError, match="checksum of a header"):
        read(bytes(tar), tmp_path)
    packed = bytearray(gzip.compress(make_tar({"a": b"1"})))
    packed[-6] ^= 1
    with pytest.raises(ArchiveError, match="CRC check failed"):
        read(bytes(packed), tmp_path)
    stored = make_zip({"a": b"content"}, 0).replace(b"content", b"CONTENT", 1)
    with pytest.raises(ArchiveError, match="checksum of 'a' is wrong"):
        read(stored, tmp_path)


def test_something_behind_the_end(tmp_path: Path) -> None:
    with pytest.raises(ArchiveError, match="behind its end"):
        read(make_tar({"a": b"1"}) + b"more", tmp_path)
    with pytest.raises(ArchiveError, match=r"damaged|behind"):
        read(gzip.compress(make_tar({"a": b"1"})) + b"more", tmp_path)
    with pytest.raises(ArchiveError, match="missing"):
        read(make_zip({"a": b"1"}) + b"more", tmp_path)


@pytest.mark.parametrize(
    ("offset", "value", "says"),
    [
        (8, b"\x01\x00", "is encrypted"),
        (8, b"\x41\x00", "is encrypted"),
        (10, b"\x0c\x00", "method 12"),
        (10, b"\x00\x00", "something else"),
        (24, b"\x09\x00\x00\x00", "another length"),
        (24, b"\x07\x00\x00\x00", "another length|checksum"),
        (20, b"\x05\x00\x00\x00", "another length|unpacked"),
        (20, b"\xff\xff\xff\xff", "zip64"),
        (42, b"\x01\x00\x00\x00", "something else"),
        (42, b"\x00\x00\x00\x7f", "cut off|something else"),
        (46, b"b", "something else"),
        (0, b"QK", "something else"),
    ],
)
def test_a_zip_that_contradicts_itself(offset: int, value: bytes, says: str, tmp_path: Path) -> None:
    data = make_zip({"a": b"content!"})
    assert read(data, tmp_path) == {"a": b"content!"}
    with pytest.raises(ArchiveError, match=says):
        read(patched(data, offset, value), tmp_path)


def test_zip64_and_several_parts(tmp_path: Path) -> None:
    data = make_zip({"a": b"1"})
    end = data.rindex(b"PK\x05\x06")
    for place, value, says in (
        (8, b"\xff\xff", "one part of several|zip64"),
        (4, b"\x01\x00", "one part"),
        (10, b"\xff\xff", "zip64"),
        (12, b"\xff\xff\xff\xff", "zip64"),
        (12, b"\xff\xff\xff\x00", "where it should be"),
    ):
        with pytest.raises(ArchiveError, match=says):
            read(data[: end + place] + value + data[end + place + len(value) :], tmp_path)


@pytest.mark.parametrize(
    ("data", "says"),
    [
        (b"", "is empty"),
        (b"hello", "no archive"),
        (b"hello" * 1000, "no archive"),
        (b"\x1f\x8b", "cut off"),
        (b"\x1f\x8bnonsense" * 100, "damaged"),
        (gzip.compress(b"episode,steps\n" * 100), "no archive"),
        (gzip.compress(gzip.compress(make_tar(FILES))), "compressed twice"),
        (b"BZh91AY&SY", "bzip2"),
        (b"\xfd7zXZ\x00\x00", "xz"),
        (b"7z\xbc\xaf\x27\x1c\x00", "7z"),
        (b"Rar!\x1a\x07", "Rar|rar"),
        (b"\x28\xb5\x2f\xfd\x00", "zstandard"),
    ],
)
def test_no_archive(data: bytes, says: str, tmp_path: Path) -> None:
    with pytest.raises(ArchiveError, match=says):
        read(data, tmp_path)


def test_a_large_number_as_gnu_writes_it(tmp_path: Path) -> None:
    data = bytearray(member("x", size=3, data=b"abc"))
    for number, says in ((3, None), (1 << 62, "more than"), (-1, "size is not a number")):
        data[124:136] = (number % (1 << 88) | 0x80 << 88).to_bytes(12, "big") if number >= 0 else b"\xff" * 12
        data[148:156] = b" " * 8
        data[148:156] = f"{sum(data[:512]):06o}\0 ".encode()
        if says is None:
            assert read(bytes(data), tmp_path) == {"x": b"abc"}
        else:
            with pytest.raises(ArchiveError, match=says):
                read(bytes(data), tmp_path)


def test_paths_that_are_no_files(tmp_path: Path) -> None:
    import os

    os.mkfifo(tmp_path / "pipe")
    for path in (tmp_path, tmp_path / "pipe", tmp_path / "missing", Path("a\0b")):
        with pytest.raises(ArchiveError, match=r"regular file|cannot be read"):
            list(read_archive(path))


# ---- fuzzing

BASES = [
    make_tar(FILES, format=tarfile.GNU_FORMAT),
    gzip.compress(make_tar(FILES)),
    make_zip(FILES),
    make_zip(FILES, 0),
]


@pytest.mark.costly
@settings(deadline=None, max_examples=200)
@given(data=st.data(), base=st.sampled_from(BASES))
def test_damage_is_an_error_or_changes_nothing(
    data: st.DataObject, base: bytes, tmp_path_factory: pytest.TempPathFactory
) -> None:
    """Whatever bytes are changed, an archive is refused, or gives clean names of no more than allowed."""
    changed = bytearray(base)
    near = st.integers(0, min(len(base), 2000) - 1) | st.integers(max(0, len(base) - 300), len(base) - 1)
    for place in data.draw(st.lists(near, min_size=1, max_size=6)):
        changed[place] = data.draw(st.integers(0, 255))
    limits = Limits(members=100, member_bytes=1 << 20, total_bytes=1 << 21)
    try:
        found = read(bytes(changed), tmp_path_factory.getbasetemp(), name="fuzz", limits=limits)
    except ArchiveError as error:
        message, found = str(error), {}
        assert message.endswith(".")
        assert len(message.splitlines()) == 1
        assert len(message) < 300
    for name, content in found.items():
        assert not name.startswith("/")
        assert ".." not in name.split("/")
        assert len(content) <= 1 << 20


@pytest.mark.costly
@settings(deadline=None, max_examples=60)
@given(files=st.dictionaries(st.from_regex(r"[a-z]{1,8}(/[a-z]{1,8}){0,3}", fullmatch=True), st.binary(max_size=3000)))
def test_any_content_comes_back(files: dict[str, bytes], tmp_path_factory: pytest.TempPathFactory) -> None:
    clashes = any(other.startswith(f"{name}/") for name in files for other in files)
    for data in (make_tar(files), gzip.compress(make_tar(files)), make_zip(files)):
        if clashes:
            with pytest.raises(ArchiveError, match="twice"):
                read(data, tmp_path_factory.getbasetemp(), name="any")
        else:
            assert read(data, tmp_path_factory.getbasetemp(), name="any") == files
