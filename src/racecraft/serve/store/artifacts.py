"""Copies of runs in an object store, so that a server with an empty folder has them again.

    runs/NAME.json      path, size and SHA-256 of each file; written last, so a copy is whole, or the one before
    runs/NAME/SHA256    a file's content

The store is S3 (``s3://bucket/prefix``; keys, region and endpoint from AWS's environment variables) or a folder
(``file:///…``), both through obstore. What comes back is not believed: names, sizes and checksums are checked first.
"""

from __future__ import annotations

import hashlib
import json
import os
import re
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, Final, TypeVar

from racecraft.errors import ConfigError, RunError
from racecraft.extras import needed_for
from racecraft.run import RunFolder

T = TypeVar("T")
FORMAT: Final = 1
MAX_INDEX_BYTES: Final = 1 << 26
MAX_FILE_BYTES: Final = 1 << 33
MAX_FILES: Final = 200_000
_PLAIN: Final = re.compile(r"[A-Za-z0-9_][A-Za-z0-9._:@+-]{0,150}(/[A-Za-z0-9_][A-Za-z0-9._:@+-]{0,150}){0,20}")
"""Paths of runs: no odd characters, nothing hidden, nothing that leads elsewhere."""
SCHEMES: Final = ("s3://", "file:///")


class Artifacts:
    """The runs in an object store.

    Args:
        url: ``s3://bucket/prefix`` or ``file:///folder``.

    Raises:
        ConfigError: No such kind of store, or it cannot be opened.
    """

    def __init__(self, url: str) -> None:
        if not url.startswith(SCHEMES):
            raise ConfigError(
                f"artifacts is {url.split('://')[0]!r}; allowed are s3://BUCKET/PREFIX and file:///FOLDER."
            )
        with needed_for("An object store"):
            import obstore
            from obstore import exceptions, store
        self.url = url
        self._api, self._missing = obstore, (exceptions.NotFoundError, FileNotFoundError)
        self._broken = (exceptions.BaseError, OSError)
        endpoint = os.environ.get("AWS_ENDPOINT_URL", os.environ.get("AWS_ENDPOINT", ""))
        try:
            if url.startswith("file:"):
                Path(url.removeprefix("file://")).mkdir(parents=True, exist_ok=True)
                self._store: Any = store.from_url(url)
            else:
                # obstore's own 5 s to connect and 30 s to answer are too short where a machine or a line is busy
                times = {"connect_timeout": "30 seconds", "timeout": "300 seconds"}
                options: Any = {"allow_http": endpoint.startswith("http://"), **times}
                retries: Any = {"max_retries": 3}
                self._store = store.from_url(url, client_options=options, retry_config=retries)
        except (*self._broken, ValueError) as error:
            raise ConfigError(f"The object store {url} cannot be opened: {_first_line(error)}.") from error

    def names(self) -> list[str]:
        """The runs that are there.

        Raises:
            RunError: The store cannot be reached.
        """

        def listed() -> list[str]:
            found = self._api.list_with_delimiter(self._store, "runs")["objects"]
            names = [entry["path"].removeprefix("runs/").removesuffix(".json") for entry in found]
            return sorted(name for name in names if _PLAIN.fullmatch(name) and "/" not in name)

        return self._tried(listed)

    def keep(self, folder: RunFolder) -> int:
        """Copy what changed of a run; the number of files that were.

        Raises:
            RunError: The store cannot be reached; what it has is as good as before.
        """

        def copied() -> int:
            before = self._index(folder.name) or {}
            known = {(line["size"], line["time"], path): line["sha256"] for path, line in before.items()}
            there = {line["sha256"] for line in before.values()}
            index: dict[str, dict[str, Any]] = {}
            count = 0
            for path, file in _files(folder.path):
                try:
                    status = file.stat()
                    digest = known.get((status.st_size, status.st_mtime_ns, path))
                    if digest is None:
                        data = file.read_bytes()
                        digest = hashlib.sha256(data).hexdigest()
                        if digest not in there:
                            self._api.put(self._store, f"runs/{folder.name}/{digest}", data)
                            there.add(digest)
                            count += 1
                        index[path] = {"size": len(data), "time": status.st_mtime_ns, "sha256": digest}
                    else:
                        index[path] = {"size": status.st_size, "time": status.st_mtime_ns, "sha256": digest}
                except FileNotFoundError:
                    continue  # an old checkpoint that was removed meanwhile
            if index != before:
                document = {"format": FORMAT, "files": index}
                self._api.put(self._store, f"runs/{folder.name}.json", json.dumps(document).encode())
            gone = {line["sha256"] for line in before.values()} - {line["sha256"] for line in index.values()}
            self._delete(f"runs/{folder.name}/{digest}" for digest in gone)
            return count

        return self._tried(copied)

    def is_current(self, folder: RunFolder) -> bool:
        """Whether the copy is as the run is.

        Raises:
            RunError: The store cannot be reached.
        """
        index = self._tried(lambda: self._index(folder.name)) or {}
        found = {path: (file.stat().st_size, file.stat().st_mtime_ns) for path, file in _files(folder.path)}
        return found == {path: (line["size"], line["time"]) for path, line in index.items()}

    def fetch(self, name: str, runs: Path, *, incoming: Path) -> RunFolder:
        """Bring a run back into the folder of the runs, whole or not at all.

        Args:
            name: Of the run.
            runs: Where it is to lie.
            incoming: Folder on the same disk where it is put together.

        Raises:
            RunError: It is not there, damaged, or the store cannot be reached.
        """
        target = incoming / name

        def fetched() -> RunFolder:
            index = self._index(name)
            if index is None:
                raise RunError(f"The store has no run {name[:80]!r}.")
            shutil.rmtree(target, ignore_errors=True)
            for path, line in index.items():
                file = target / path
                file.parent.mkdir(parents=True, exist_ok=True)
                digest, size = hashlib.sha256(), 0
                with file.open("xb") as out:
                    for chunk in self._api.get(self._store, f"runs/{name}/{line['sha256']}").stream():
                        size += len(chunk)
                        if size > line["size"]:
                            break
                        digest.update(chunk)
                        out.write(chunk)
                if size != line["size"] or digest.hexdigest() != line["sha256"]:
                    raise RunError(f"{path} of run {name!r} is damaged in the store.")
                os.utime(file, ns=(line["time"], line["time"]))
            os.rename(target, runs / name)
            return RunFolder(runs / name)

        try:
            return self._tried(fetched)
        finally:
            shutil.rmtree(target, ignore_errors=True)

    def forget(self, name: str) -> None:
        """Remove a run's copy.

        Raises:
            RunError: The store cannot be reached.
        """

        def forgotten() -> None:
            self._delete([f"runs/{name}.json"])
            for page in self._api.list(self._store, f"runs/{name}"):
                self._delete(entry["path"] for entry in page)

        self._tried(forgotten)

    def _index(self, name: str) -> dict[str, dict[str, Any]] | None:
        """What a run's copy holds, checked; None when there is none."""
        try:
            reply = self._api.get(self._store, f"runs/{name}.json")
            if reply.meta["size"] > MAX_INDEX_BYTES:
                raise RunError(f"The list of files of run {name!r} is too large.")
            document = json.loads(bytes(reply.bytes()))
        except self._missing:
            return None
        except ValueError as error:
            raise RunError(f"The list of files of run {name!r} is damaged.") from error
        try:
            if document["format"] != FORMAT or len(document["files"]) > MAX_FILES:
                raise ValueError("format")
            index = {}
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
                index[path] = {"size": size, "time": moment, "sha256": digest}
            return index
        except (KeyError, TypeError, ValueError, AttributeError) as error:
            raise RunError(f"The list of files of run {name!r} is not one of Racecraft's.") from error

    def _delete(self, paths: Any) -> None:
        for path in paths:
            try:
                self._api.delete(self._store, path)
            except self._missing:
                continue

    def _tried(self, action: Callable[[], T]) -> T:
        try:
            return action()
        except self._broken as error:
            raise RunError(
                f"The object store {self.url} does not answer as it should: {_first_line(error)}.",
                hint="Runs are safe on this machine and are copied later.",
            ) from error


def _files(root: Path) -> Iterator[tuple[str, Path]]:
    """What of a run is worth keeping: no links, no hidden files."""
    for folder, folders, names in os.walk(root):
        folders[:] = sorted(name for name in folders if not name.startswith("."))
        for name in sorted(names):
            file = Path(folder, name)
            path = file.relative_to(root).as_posix()
            if _PLAIN.fullmatch(path) and not file.is_symlink():
                yield path, file


def _first_line(error: BaseException) -> str:
    return (str(error).strip().splitlines() or [type(error).__name__])[0][:300].rstrip(".")
