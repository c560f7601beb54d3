"""Copies of runs in an object store: a server with an empty folder has them again, and any machine can go on with one.

    runs/NAME.json      path, size and SHA-256 of each file, which copy it is, counted from 1, and of which life of the
                        name; written last, so a copy is whole, or the one before
    runs/NAME/SHA256    a file's content
    live/NAME           its cars as they drive, while somebody looks
    tracks/SHA256       a track of somebody's own, for jobs that drive on it
    contests/JOB …      as runs: what a job makes that is no run, until it is at home
    people/NUMBER/…     the same for each other person of a league

A run folder remembers which copy it was last alike to. So whoever has an older one brings the newer, and nobody who was
away writes over it. A name may be given again when its run was removed, or by another console: copies of another life
are another run.

The store is S3 (``s3://bucket/prefix``; keys, region and endpoint from AWS's environment variables) or a folder
(``file:///…``), both through obstore. What comes back is not believed: names, sizes and checksums are checked first.
"""

from __future__ import annotations

import copy
import hashlib
import json
import os
import re
import secrets
import shutil
import sqlite3
import tempfile
from collections.abc import Callable, Iterator
from contextlib import closing, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final, TypeVar

from racecraft.errors import ConfigError, RunError
from racecraft.json_file import parse_json_object
from racecraft.run import RunFolder
from racecraft.run.atomic import write_file
from racecraft.serve.settings import OWNER
from racecraft.serve.store.objects import NoAnswer, NoObject, Objects, ObjectStore, first_line

T = TypeVar("T")
FORMAT: Final = 1
MAX_INDEX_BYTES: Final = 1 << 26
MAX_FILE_BYTES: Final = 1 << 33
MAX_FILES: Final = 200_000
_PLAIN: Final = re.compile(r"[A-Za-z0-9_][A-Za-z0-9._:@+-]{0,150}(/[A-Za-z0-9_][A-Za-z0-9._:@+-]{0,150}){0,20}")
"""Paths of runs: no odd characters, nothing hidden, nothing that leads elsewhere."""
_LIFE: Final = re.compile(r"[0-9a-f]{0,16}")
MARK: Final = ".copy"
"""In a run folder: number and life of the copy that it was last alike to."""
RUNS: Final = "runs"
MANIFEST: Final = "checkpoints/manifest.json"
SNAPSHOTS: Final = 10
"""How often the checkpoints are looked at again because a training saved one meanwhile."""
FETCHES: Final = 3
"""The same for a copy that was made anew while it was brought."""
MAX_LIVE_BYTES: Final = 1 << 20
MAX_TRACK_BYTES: Final = 1 << 26
DATABASES: Final = ".sqlite"
"""Ending of files that are copied last and as one transaction left them, while others write them."""


@dataclass(frozen=True)
class Copy:
    """What the store has of a run."""

    number: int = 0
    files: dict[str, dict[str, Any]] = field(default_factory=dict)
    """Size, time and SHA-256 by path."""
    life: str = ""
    """Made by chance with the first copy; empty for copies of earlier versions."""


class Artifacts:
    """The runs in an object store.

    Args:
        store: ``s3://bucket/prefix`` or ``file:///folder``, or what stands for it.

    Raises:
        ConfigError: No such kind of store, or it cannot be opened.
    """

    def __init__(self, store: str | Objects) -> None:
        self.objects = ObjectStore(store) if isinstance(store, str) else store
        self.url = self.objects.url
        self._prefix, self._shelf = "", RUNS

    def of(self, user_id: int) -> Artifacts:
        """The same for another person."""
        return self._at("" if user_id == OWNER else f"people/{user_id}/", RUNS)

    def shelf(self, name: str) -> Artifacts:
        """The same for folders of another kind than runs."""
        return self._at(self._prefix, name)

    def _at(self, prefix: str, shelf: str) -> Artifacts:
        other = copy.copy(self)
        other._prefix, other._shelf = prefix, shelf
        return other

    def names(self) -> list[str]:
        """The runs that are there.

        Raises:
            RunError: The store cannot be reached.
        """

        def listed() -> list[str]:
            found = self.objects.beside(self.key())
            names = [path.removeprefix(f"{self.key()}/").removesuffix(".json") for path in found]
            return sorted(name for name in names if _PLAIN.fullmatch(name) and "/" not in name)

        return self._tried(listed)

    def keep(self, folder: RunFolder) -> int:
        """Copy what changed of a run, also while it is being trained; the number of files that were.

        Checkpoints come first: what is copied after them is at least as far, and a training that goes on from a copy
        cuts off what is behind its checkpoint.

        Raises:
            RunError: The store cannot be reached, what it has is as good as before; or somebody else went on with it.
        """

        def copied() -> int:
            before = self.copy(folder.name) or Copy(life=secrets.token_hex(8))
            number, life = _mark(folder.path, (before.number, before.life))
            if before.number > 0 and (life != before.life or number < before.number):
                raise RunError(
                    f"Run {folder.name!r} was changed by another machine, so its copy is newer than {folder.path}."
                )
            known = {(line["size"], line["time"], path): line["sha256"] for path, line in before.files.items()}
            there = {line["sha256"] for line in before.files.values()}
            count = 0

            def taken(path: str, file: Path) -> dict[str, Any]:
                nonlocal count
                status = file.stat()
                digest = known.get((status.st_size, status.st_mtime_ns, path))
                size = status.st_size
                if digest is None:
                    data = _content(file)
                    digest, size = hashlib.sha256(data).hexdigest(), len(data)
                    if digest not in there:
                        put(self.key(folder.name, digest), data)
                        there.add(digest)
                        count += 1
                return {"size": size, "time": status.st_mtime_ns, "sha256": digest}

            with self.objects.together() as put:
                files, number = _snapshot(folder.path, taken), before.number
                if files != before.files:
                    number += 1
                    document = {"format": FORMAT, "number": number, "life": before.life, "files": files}
                    put(self.key(f"{folder.name}.json"), json.dumps(document).encode())
            _remember(folder.path, number, before.life)
            gone = {line["sha256"] for line in before.files.values()} - {line["sha256"] for line in files.values()}
            self.objects.delete(self.key(folder.name, digest) for digest in gone)
            return count

        return self._tried(copied)

    def is_current(self, folder: RunFolder) -> bool:
        """Whether the copy is as the run is.

        Raises:
            RunError: The store cannot be reached.
        """
        copy = self._tried(lambda: self.copy(folder.name)) or Copy()
        found = {path: (file.stat().st_size, file.stat().st_mtime_ns) for path, file in _files(folder.path)}
        return found == {path: (line["size"], line["time"]) for path, line in copy.files.items()}

    def bring(self, name: str, runs: Path, *, incoming: Path, missing_ok: bool = False, is_home: bool = False) -> bool:
        """Have a run here as it is in the store, unless what is here is as new; whether anything was brought.

        Nothing changes before all of it is here and checked. Then files are replaced one by one, the list of
        checkpoints after the checkpoints, so that who reads meanwhile finds whole files.

        Args:
            name: Of the run.
            runs: Where it lies, or is to lie.
            incoming: Folder on the same disk where it is put together.
            missing_ok: Whether there may be nothing of this name.
            is_home: Whether another run of the name is to stay, rather than to be taken for what an old job left.

        Raises:
            RunError: It is not there, damaged, or the store cannot be reached.
        """
        folder = runs / name
        incoming.mkdir(parents=True, exist_ok=True)
        for attempt in range(1, FETCHES + 1):
            copy = self._tried(lambda: self.copy(name))
            if copy is None and missing_ok:
                return False
            if copy is None:
                raise RunError(f"The store has no run {name[:80]!r}.")
            is_here = folder.exists()
            # a run without a mark is older than marks; another folder was left by a job that was killed
            number, life = _mark(folder, (copy.number if self._shelf == RUNS else 0, copy.life))
            if is_here and (copy.number <= number if life == copy.life else is_home):
                return False
            target = Path(tempfile.mkdtemp(dir=incoming, prefix=f"{name}-"))
            target.chmod(0o755)
            try:
                wanted = {
                    path: line for path, line in copy.files.items() if not is_here or not _is_alike(folder / path, line)
                }
                self._tried(lambda: self._download(name, wanted, target))  # noqa: B023 - called here and now
                _remember(target, copy.number, copy.life)
                if not is_here:
                    os.rename(target, folder)
                else:
                    _replace(folder, target, wanted, copy)
                return True
            except RunError:
                latest = self._tried(lambda: self.copy(name))
                if attempt == FETCHES or latest is None or latest.number == copy.number:
                    raise
            finally:
                shutil.rmtree(target, ignore_errors=True)
        return False

    def _download(self, name: str, files: dict[str, dict[str, Any]], target: Path) -> None:
        for path, line in files.items():
            file = target / path
            file.parent.mkdir(parents=True, exist_ok=True)
            digest, size = hashlib.sha256(), 0
            with file.open("xb") as out:
                for chunk in self.objects.get(self.key(name, line["sha256"])).chunks:
                    size += len(chunk)
                    if size > line["size"]:
                        break
                    digest.update(chunk)
                    out.write(chunk)
            if size != line["size"] or digest.hexdigest() != line["sha256"]:
                raise RunError(f"{path} of run {name!r} is damaged in the store.")
            os.utime(file, ns=(line["time"], line["time"]))

    def show(self, name: str, live: bytes) -> None:
        """Let others see a run's cars as they are now.

        Raises:
            RunError: The store cannot be reached.
        """
        self._tried(lambda: self.objects.put(f"{self._prefix}live/{name}", live))

    def shown(self, name: str) -> bytes:
        """What was shown last of a run's cars; nothing where nothing was, or too much.

        Raises:
            RunError: The store cannot be reached.
        """

        def read() -> bytes:
            try:
                content = self.objects.get(f"{self._prefix}live/{name}")
            except NoObject:
                return b""
            return b"" if content.size > MAX_LIVE_BYTES else content.read()

        return self._tried(read)

    def forget(self, name: str) -> None:
        """Remove a run's copy.

        Raises:
            RunError: The store cannot be reached.
        """

        def forgotten() -> None:
            self.objects.delete([self.key(f"{name}.json"), f"{self._prefix}live/{name}"])
            self.objects.delete(self.objects.below(self.key(name)))

        self._tried(forgotten)

    def forget_all(self) -> None:
        """Remove all that another person of a league has here.

        Raises:
            RunError: The store cannot be reached.
        """
        if not self._prefix:
            raise RunError("The owner's copies are not removed.")

        self._tried(lambda: self.objects.delete(self.objects.below(self._prefix.rstrip("/"))))

    def keep_track(self, file: Path) -> str:
        """Have a track's file here; its SHA-256.

        Raises:
            RunError: The store cannot be reached, or the file cannot be read.
        """

        def kept() -> str:
            data = file.read_bytes()
            digest = hashlib.sha256(data).hexdigest()
            self.objects.put(self.track_key(digest), data)
            return digest

        return self._tried(kept)

    def bring_track(self, digest: str, file: Path) -> None:
        """Have a track's file on this machine.

        Raises:
            RunError: It is not there, damaged, or the store cannot be reached.
        """

        def read() -> bytes:
            content = self.objects.get(self.track_key(digest))
            return b"" if content.size > MAX_TRACK_BYTES else content.read()

        if not file.is_file():
            data = self._tried(read)
            if hashlib.sha256(data).hexdigest() != digest:
                raise RunError(f"Track {file.name} is damaged in the store.")
            file.parent.mkdir(parents=True, exist_ok=True)
            write_file(file, data)

    def key(self, *parts: str) -> str:
        """Where something of this shelf is in the store."""
        return "/".join((f"{self._prefix}{self._shelf}", *parts))

    def track_key(self, digest: str) -> str:
        """The same for a track."""
        return f"{self._prefix}tracks/{digest}"

    def copy(self, name: str) -> Copy | None:
        """What the store has of a run, checked; None when there is nothing."""
        try:
            content = self.objects.get(self.key(f"{name}.json"))
            if content.size > MAX_INDEX_BYTES:
                raise RunError(f"The list of files of run {name!r} is too large.")
            return read_copy(content.read(), name)
        except NoObject:
            return None

    def _tried(self, action: Callable[[], T]) -> T:
        try:
            return action()
        except OSError as error:
            raise RunError(f"Copies of runs cannot be made on this machine: {first_line(error)}.") from error
        except NoAnswer as error:
            raise RunError(
                f"The object store {self.url} does not answer as it should: {first_line(error)}.",
                hint="Runs are safe on this machine and are copied later.",
            ) from error


def read_copy(data: bytes, name: str) -> Copy:
    """What a list of a run's files says, checked.

    Raises:
        RunError: It is none of ours.
    """
    try:
        document = parse_json_object(data, name="It")
    except ConfigError as error:
        raise RunError(f"The list of files of run {name!r} is damaged.") from error
    try:
        if document["format"] != FORMAT or len(document["files"]) > MAX_FILES:
            raise ValueError("format")
        files = {}
        for path, line in document["files"].items():
            size, moment, digest = int(line["size"]), int(line["time"]), str(line["sha256"])
            is_digest = len(digest) == 64 and set(digest) <= set("0123456789abcdef")
            if (
                not _PLAIN.fullmatch(path)
                or not 0 <= size <= MAX_FILE_BYTES
                or not 0 <= moment < 2**63
                or not is_digest
            ):
                raise ValueError("name or size")
            files[path] = {"size": size, "time": moment, "sha256": digest}
        number = int(document.get("number", 0))  # copies of earlier versions are not counted
        life = str(document.get("life", ""))
        if not 0 <= number < 2**62 or not _LIFE.fullmatch(life):
            raise ValueError("number or life")
        return Copy(number, files, life)
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise RunError(f"The list of files of run {name!r} is not one of Racecraft's.") from error


def _files(root: Path) -> Iterator[tuple[str, Path]]:
    """What of a run is worth keeping: no links, no hidden files."""
    for folder, folders, names in os.walk(root):
        folders[:] = sorted(name for name in folders if not name.startswith("."))
        for name in sorted(names):
            file = Path(folder, name)
            path = file.relative_to(root).as_posix()
            if _PLAIN.fullmatch(path) and not file.is_symlink():
                yield path, file


def _snapshot(root: Path, put: Callable[[str, Path], dict[str, Any]]) -> dict[str, dict[str, Any]]:
    """The files of a run by path, as `put` has copied them; the checkpoints all of one moment."""
    files: dict[str, dict[str, Any]] = {}

    def add(is_wanted: Callable[[str], bool]) -> None:
        for path, file in _files(root):
            if is_wanted(path):
                with suppress(FileNotFoundError):  # an old checkpoint that was removed meanwhile
                    files[path] = put(path, file)

    for _ in range(SNAPSHOTS):
        files.clear()
        listed = _moment(root / MANIFEST)
        add(lambda path: path.startswith("checkpoints/"))
        if _moment(root / MANIFEST) == listed:
            break
    add(lambda path: not path.startswith("checkpoints/") and not path.endswith(DATABASES))
    add(lambda path: path.endswith(DATABASES))
    return dict(sorted(files.items()))


def _content(file: Path) -> bytes:
    """Of a file; of a database as its last transaction left it."""
    if file.suffix != DATABASES:
        return file.read_bytes()
    try:
        with closing(sqlite3.connect(file)) as source, closing(sqlite3.connect(":memory:")) as copied:
            source.backup(copied)
            return copied.serialize()
    except sqlite3.Error as error:
        raise OSError(f"{file.name} cannot be read: {error}") from error


def _replace(folder: Path, fresh: Path, wanted: dict[str, dict[str, Any]], copy: Copy) -> None:
    """Put what was brought in its place, and remove what the copy has not."""
    for path in sorted(wanted, key=lambda path: path == MANIFEST):
        (folder / path).parent.mkdir(parents=True, exist_ok=True)
        os.replace(fresh / path, folder / path)
    for path, file in _files(folder):
        if path not in copy.files:
            file.unlink(missing_ok=True)
    os.replace(fresh / MARK, folder / MARK)


def _is_alike(file: Path, line: dict[str, Any]) -> bool:
    """Whether a file is the one of the copy, by its size and time, which a copy keeps."""
    try:
        status = file.stat()
    except OSError:
        return False
    return (status.st_size, status.st_mtime_ns) == (line["size"], line["time"])


def _mark(folder: Path, otherwise: tuple[int, str]) -> tuple[int, str]:
    """Which copy a folder was last alike to: number and life."""
    try:
        number, _, life = (folder / MARK).read_text(encoding="ascii")[:60].partition(" ")
        return int(number), life
    except (OSError, ValueError):
        return otherwise


def _remember(folder: Path, number: int, life: str) -> None:
    write_file(folder / MARK, f"{number} {life}".encode())


def _moment(path: Path) -> tuple[int, int]:
    try:
        status = path.stat()
    except OSError:
        return 0, 0
    return status.st_mtime_ns, status.st_ino
