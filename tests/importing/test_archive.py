"""The archive reader against archives that Python's own writers make, and against what is hostile in them."""

from __future__ import annotations

import gzip
import io
import struct
import tarfile
import zipfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from archives_made import FILES, make_tar, make_zip, member, read

from racecraft.errors import ArchiveError, ConfigError
from racecraft.importing.archive import read_archive
from racecraft.importing.archive_guard import Guard, Limits


@pytest.mark.parametrize(
    "data",
    [
        make_tar(FILES, format=tarfile.USTAR_FORMAT),
        make_tar(FILES, format=tarfile.GNU_FORMAT),
        make_tar(FILES, format=tarfile.PAX_FORMAT),
        gzip.compress(make_tar(FILES)),
        gzip.compress(make_tar(FILES)[:5000]) + gzip.compress(make_tar(FILES)[5000:]),
        make_zip(FILES),
        make_zip(FILES, zipfile.ZIP_STORED),
    ],
    ids=["ustar", "gnu", "pax", "gzip", "gzip-in-two-parts", "deflated", "stored"],
)
def test_what_other_writers_wrote_is_read(data: bytes, tmp_path: Path) -> None:
    assert read(data, tmp_path) == FILES
    assert [entry.name for entry in read_archive(tmp_path / "x.tar.gz")] == list(FILES)  # skipped, not read


@pytest.mark.parametrize("format", [tarfile.GNU_FORMAT, tarfile.PAX_FORMAT, tarfile.USTAR_FORMAT])
def test_long_and_foreign_names(format: int, tmp_path: Path) -> None:
    long = {"/".join(["folder" * 5] * 5) + "/reward_function.py": b"a"}  # 170 characters
    assert read(make_tar(long, format=format), tmp_path) == long
    if format != tarfile.USTAR_FORMAT:
        foreign = {"Müller/赛道.json": b"b", "Mu\u0308ller2/x": b"c"}
        assert read(make_tar(foreign, format=format), tmp_path) == foreign


def test_folders_and_dots_are_no_files(tmp_path: Path) -> None:
    buffer = io.BytesIO()
    with tarfile.open(fileobj=buffer, mode="w") as tar:
        for name in (".", "./model", "./model"):
            info = tarfile.TarInfo(name)
            info.type = tarfile.DIRTYPE
            tar.addfile(info)
        tar.addfile(tarfile.TarInfo("./model//a"))
    assert read(buffer.getvalue(), tmp_path) == {"model/a": b""}
    assert read(member("model/"), tmp_path) == {}  # a folder as old writers put it: a file whose name ends so
    assert read(make_zip({"model/": b"", "model/a": b"1"}), tmp_path) == {"model/a": b"1"}
    assert read(make_zip({}), tmp_path) == {}
    assert read(make_tar({}), tmp_path) == {}


def test_a_header_for_all_members_that_says_nothing_of_names_is_fine(tmp_path: Path) -> None:
    buffer = io.BytesIO()
    with tarfile.open(fileobj=buffer, mode="w", pax_headers={"comment": "made by hand"}) as tar:
        tar.addfile(tarfile.TarInfo("a"))
    assert read(buffer.getvalue(), tmp_path) == {"a": b""}


# ---- names

BAD_NAMES = {
    "../evil": "leads out",
    "a/../../evil": "leads out",
    "a/..": "leads out",
    "a/... /b": "leads out",
    "/etc/passwd": "absolute",
    "C:/evil": "absolute",
    "./C:evil": "absolute",
    "a\\..\\evil": "backslash",
    "a\uff3cevil": "backslash",
    "\uff0e\uff0e/evil": "leads out",
    "\u2025/evil": "leads out",
    "a\uff0fb": "something like a slash",
    "a\u2100b": "something like a slash",
    "evil\u202egnp.py": "cannot be seen",
    "a\u200bb": "cannot be seen",
    "a\nb": "cannot be seen",
    "a" * 501: "501 characters",
    "/".join("a" * 21): "21 deep",
}


def windows_zip(*names: str) -> bytes:
    """As Compress-Archive of Windows PowerShell makes it."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        for name in names:
            info = zipfile.ZipInfo(name)
            info.create_system = 0
            archive.writestr(info, name.encode() if not name.endswith("\\") else b"")
    return buffer.getvalue()


def test_a_zip_of_windows_has_its_files_in_their_folders(tmp_path: Path) -> None:
    names = ("my-car\\", "my-car\\model\\model_metadata.json", "my-car\\reward_function.py")
    assert set(read(windows_zip(*names), tmp_path)) == {"my-car/model/model_metadata.json", "my-car/reward_function.py"}
    for name, says in (("a\\..\\evil", "leads out"), ("\\evil", "absolute"), ("C:\\evil", "absolute")):
        with pytest.raises(ArchiveError, match=says):
            read(windows_zip(name), tmp_path)
    with pytest.raises(ArchiveError, match="twice"):
        read(windows_zip("a\\b", "a/b"), tmp_path)


@pytest.mark.parametrize(("name", "says"), BAD_NAMES.items(), ids=[ascii(name)[:20] for name in BAD_NAMES])
def test_names_that_lead_elsewhere(name: str, says: str, tmp_path: Path) -> None:
    for data in (make_tar({name: b""}, format=tarfile.GNU_FORMAT), make_tar({name: b""}), make_zip({name: b""})):
        with pytest.raises(ArchiveError, match=says) as caught:
            read(data, tmp_path)
        assert "\n" not in str(caught.value)
        assert len(str(caught.value)) < 200


def test_a_nul_in_a_name(tmp_path: Path) -> None:
    pax = make_pax({"path": "reward\0.py"})
    with pytest.raises(ArchiveError, match="cannot be seen"):
        read(pax, tmp_path)
    with pytest.raises(ArchiveError, match="cannot be seen"):
        read(make_zip({"rewardX.py": b""}).replace(b"rewardX.py", b"reward\0.py"), tmp_path)


def make_pax(records: dict[str, str], *, kind: bytes = tarfile.XHDTYPE) -> bytes:
    """A tar of one member with pax records of any content."""
    lines = b""
    for key, value in records.items():
        rest = f" {key}={value}\n".encode()
        length = len(rest) + len(str(len(rest)))
        lines += str(length + (len(str(length + 1)) > len(str(len(rest))))).encode() + rest
    return member("pax", kind, len(lines), lines)[:-1024] + member("a")


TWINS = [("reward.py", "Reward.py"), ("a", "a"), ("straße", "STRASSE"), ("ﬁle", "file"), ("a", "a/b"), ("a/b", "A")]


@pytest.mark.parametrize(("first", "second"), TWINS)
@pytest.mark.filterwarnings("ignore:Duplicate name")
def test_members_that_some_system_cannot_tell_apart(first: str, second: str, tmp_path: Path) -> None:
    buffer = io.BytesIO()
    with tarfile.open(fileobj=buffer, mode="w") as archive:
        archive.addfile(tarfile.TarInfo(first))
        archive.addfile(tarfile.TarInfo(second))
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w") as zipped:
        zipped.writestr(first, b"")
        zipped.writestr(second, b"")
    for data in (buffer.getvalue(), packed.getvalue()):
        with pytest.raises(ArchiveError, match="twice"):
            read(data, tmp_path)


# ---- kinds


@pytest.mark.parametrize(
    ("kind", "says"),
    [
        (tarfile.SYMTYPE, "a link"),
        (tarfile.LNKTYPE, "a link"),
        (tarfile.CHRTYPE, "a device"),
        (tarfile.BLKTYPE, "a device"),
        (tarfile.FIFOTYPE, "a pipe"),
        (tarfile.GNUTYPE_SPARSE, "a sparse file"),
        (tarfile.GNUTYPE_LONGLINK, "a link"),
        (b"V", "kind b'V'"),
    ],
)
def test_only_files_and_folders(kind: bytes, says: str, tmp_path: Path) -> None:
    with pytest.raises(ArchiveError, match=says):
        read(member("x", kind, linkname="/etc/passwd"), tmp_path)


@pytest.mark.parametrize(
    ("mode", "says"), [(0o120777, "a link"), (0o020666, "a device"), (0o060666, "a device"), (0o010666, "a pipe")]
)
def test_only_files_and_folders_in_a_zip(mode: int, says: str, tmp_path: Path) -> None:
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:
        info = zipfile.ZipInfo("x")
        info.create_system, info.external_attr = 3, mode << 16
        archive.writestr(info, "/etc/passwd")
    with pytest.raises(ArchiveError, match=says):
        read(buffer.getvalue(), tmp_path)


@pytest.mark.parametrize(
    ("records", "says"),
    [
        ({"GNU.sparse.major": "1", "GNU.sparse.realsize": "99999999999"}, "sparse"),
        ({"size": "99999999999999"}, "more than"),
        ({"size": "-1"}, "size is not a number"),
        ({"size": "1e9"}, "size is not a number"),
        ({"size": "5000"}, "cut off"),
        ({"path": "../evil"}, "leads out"),
        ({"comment": "x" * 70_000}, "header of 7"),
    ],
)
def test_pax_records(records: dict[str, str], says: str, tmp_path: Path) -> None:
    with pytest.raises(ArchiveError, match=says):
        read(make_pax(records), tmp_path)


def test_pax_records_for_all_members(tmp_path: Path) -> None:
    with pytest.raises(ArchiveError, match="one header"):
        read(make_pax({"path": "same"}, kind=tarfile.XGLTYPE), tmp_path)


@pytest.mark.parametrize("records", [b"no records", b"999 path=a\n", b"5 a=b\n", b"0 a=b\n", b"8 path=a"])
def test_broken_pax_records(records: bytes, tmp_path: Path) -> None:
    with pytest.raises(ArchiveError, match="pax header"):
        read(member("pax", tarfile.XHDTYPE, len(records), records)[:-1024] + member("a"), tmp_path)


def test_headers_without_end(tmp_path: Path) -> None:
    endless = make_pax({"comment": "x"})[:1024] * 50
    with pytest.raises(ArchiveError, match="more than 20 members"):
        read(endless, tmp_path, limits=Limits(members=20))


# ---- sizes


def test_limits(tmp_path: Path) -> None:
    files = {f"{number}": b"x" * 1000 for number in range(20)}
    for data in (make_tar(files), gzip.compress(make_tar(files)), make_zip(files), make_zip(files, 0)):
        assert len(read(data, tmp_path)) == 20
        for limits, says in (
            (Limits(members=19), "more than 19 members"),
            (Limits(member_bytes=999), "to 1,000 bytes, more than 999"),
            (Limits(total_bytes=15_000), "more than 15,000 bytes"),
            (Limits(file_bytes=100), "archives of at most 100"),
        ):
            with pytest.raises(ArchiveError, match=says):
                read(data, tmp_path, limits=limits)


def test_what_reaches_a_limit_without_passing_it_is_read(tmp_path: Path) -> None:
    files = {f"{number}": b"x" * 1000 for number in range(20)}
    for data in (gzip.compress(make_tar(files)), make_zip(files)):
        exact = Limits(members=20, member_bytes=1000, file_bytes=len(data))
        assert read(data, tmp_path, limits=exact) == files
        for over in (Limits(members=19), Limits(member_bytes=999), Limits(file_bytes=len(data) - 1)):
            with pytest.raises(ArchiveError):
                read(data, tmp_path, limits=over)
    stored = make_zip(files, 0)
    assert read(stored, tmp_path, limits=Limits(total_bytes=20_000)) == files
    with pytest.raises(ArchiveError, match="more than 19,999 bytes"):
        read(stored, tmp_path, limits=Limits(total_bytes=19_999))


@pytest.mark.parametrize("name", ["a" * 500, "/".join("a" * 20)], ids=["500 characters", "20 deep"])
def test_the_longest_name_and_the_deepest_folder(name: str, tmp_path: Path) -> None:
    assert read(make_zip({name: b"1"}), tmp_path) == {name: b"1"}


def test_a_guard_lets_the_ratio_be_reached_and_counts_small_members_as_no_bomb() -> None:
    guard = Guard("x.zip", Limits(ratio=10, ratio_grace=100))
    guard.check_ratio(100, 1)  # within the grace
    guard.check_ratio(1000, 100)  # ten times, and no more
    for unpacked, packed in ((101, 10), (1001, 100)):
        with pytest.raises(ArchiveError, match="10 times its size"):
            guard.check_ratio(unpacked, packed)


@pytest.mark.parametrize("pack", [lambda files: gzip.compress(make_tar(files)), make_zip])
def test_a_bomb(pack: Callable[[dict[str, bytes]], bytes], tmp_path: Path) -> None:
    bomb = pack({"zeros": bytes(20_000_000)})
    assert len(bomb) < 25_000
    with pytest.raises(ArchiveError, match="only a bomb does"):
        read(bomb, tmp_path)
    path = tmp_path / "x.tar.gz"
    with pytest.raises(ArchiveError, match="only a bomb does"):
        list(read_archive(path))  # also when nobody reads the member


def test_a_bomb_that_grows_less_is_one_when_it_is_large(tmp_path: Path) -> None:
    data = gzip.compress(make_tar({str(i): np.random.default_rng(i).bytes(200) + bytes(9_800) for i in range(100)}))
    limits = Limits(ratio_grace=1000, large_bytes=900_000)
    with pytest.raises(ArchiveError, match="more than 20 times its size, as only a bomb does"):
        read(data, tmp_path, limits=limits)
    read(data, tmp_path, limits=replace(limits, large_bytes=2_000_000))


def test_a_header_that_claims_more_than_there_is(tmp_path: Path) -> None:
    with pytest.raises(ArchiveError, match="more than"):
        read(member("x", size=1 << 40), tmp_path)
    with pytest.raises(ArchiveError, match="cut off"):
        read(member("x", size=100_000), tmp_path)


def test_members_of_a_zip_that_share_bytes(tmp_path: Path) -> None:
    """Two names for one content: many of them make a bomb of any ratio."""
    data = make_zip({"a": b"x" * 100, "b": b"x" * 100}, 0)
    second = data.rindex(b"PK\x01\x02")
    overlapping = data[: second + 42] + struct.pack("<L", 0) + data[second + 46 :]
    with pytest.raises(ArchiveError, match=r"share bytes"):
        read(overlapping, tmp_path)
    first = data.index(b"PK\x01\x02")
    longer = data[: first + 20] + struct.pack("<2L", 180, 180) + data[first + 28 :]
    with pytest.raises(ArchiveError, match="share bytes"):
        read(longer, tmp_path)


@pytest.mark.parametrize("path", [5, None, b"model.tar.gz"])
def test_what_is_no_path_is_told(path: Any) -> None:
    with pytest.raises(ConfigError, match=r"^path is .*; use the path of an archive\.$"):
        next(read_archive(path))
