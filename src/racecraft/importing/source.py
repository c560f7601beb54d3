"""What is imported, as a list of files with clean relative names: a folder, an archive, or a single file.

Folders are listed without following links. Members of an archive that may be needed are put into a temporary folder
under names of our own, so nothing in an archive decides where anything is written.
"""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

from racecraft.checks import check_type
from racecraft.errors import ConfigError, SourceError, typed
from racecraft.importing.archive import DEFAULT_LIMITS, read_archive
from racecraft.importing.archive_guard import CHUNK, Limits
from racecraft.importing.layout import (
    BUCKET,
    EXPERIMENTS,
    HYPERPARAMETERS,
    METADATA,
    PLACES,
    REWARD,
    TRAINING_PARAMS,
    Role,
    is_plain,
    role,
)
from racecraft.json_file import decode_text, read_bytes, read_text
from racecraft.reward.source import decode_reward

MAX_FILES: Final = 100_000
MAX_DEPTH: Final = 20
MAX_KEPT_BYTES: Final = 1 << 31  # of an archive's members that are put into the temporary folder
MAX_BYTES: Final[dict[Role, int]] = {
    "settings": 1 << 20,
    "code": 1 << 20,
    "metrics": 1 << 25,
    "trace": 1 << 28,
    "log": 1 << 28,
    "own": 1 << 28,
    "weights": 1 << 29,
}
"""Largest file of a role that is read; the other roles are not read at all."""
_SKIPPED: Final = (".git", ".venv", "venv", "node_modules", "__pycache__", "__MACOSX")


@dataclass(frozen=True)
class SourceFile:
    """One file."""

    name: str
    """Relative, with forward slashes."""
    size: int
    """Bytes."""
    path: Path | None
    """Where it can be read; None where it is not needed."""


@dataclass(frozen=True)
class Source:
    """Everything that may be imported."""

    title: str
    """What messages call it."""
    stem: str
    """A name for a run made from it."""
    files: dict[str, SourceFile] = field(default_factory=dict)
    """By name."""
    num_links: int = 0
    """Links that were not followed."""
    reward: str = ""
    """Name of the reward function where the user named a single file."""

    def text(self, name: str) -> str:
        """A settings file's text, or a reward function's.

        Raises:
            ConfigError: Not readable, too large, or not UTF-8, nor what `decode_reward` takes of Python's.
        """
        path, limit = self.files[name].path, MAX_BYTES["settings"]
        if path is None or self.files[name].size > limit:
            raise ConfigError(f"{name} is larger than {limit:,} bytes, too large for a file of its kind.")
        if name.endswith(".py"):
            data = read_bytes(path, max_bytes=limit, name=name)
            with suppress(UnicodeDecodeError):
                return decode_reward(data)
            return decode_text(data, name=name)  # which says what is wrong
        return read_text(path, max_bytes=limit, name=name)


@contextmanager
def open_source(path: str | Path, *, limits: Limits = DEFAULT_LIMITS) -> Iterator[Source]:
    """List what is there; what was taken from an archive is gone after the block.

    Raises:
        ConfigError: The path is none.
        SourceError: There is nothing, or nothing of a kind that is understood.
        ArchiveError: The archive is damaged or hostile.
    """
    check_type("path", path, (str, os.PathLike), "use the path of a folder, an archive or a reward function")
    path = Path(path)
    try:
        is_folder, is_file = path.is_dir(), path.is_file()
    except (OSError, ValueError):
        is_folder = is_file = False
    if is_folder:
        yield _folder(path)
    elif not is_file:
        raise SourceError(f"There is no file or folder {str(path)[:200]!r} to import.")
    elif path.suffix == ".py":
        yield _single(path)
    elif path.name.endswith((".csv", ".log", ".csv.gz", ".log.gz")):
        raise SourceError(
            f"{path.name} alone is no model.",
            hint=f"Import the folder of its model, or hold it against the simulator: racecraft replay {typed(path)}",
        )
    elif path.name in PLACES or path.suffix in (".json", ".yaml", ".env", ".pb", ".index"):
        raise SourceError(
            f"{path.name} alone is no model.",
            hint=f"Import the folder it lies in: racecraft import {typed(path.parent)}",
        )
    else:
        with tempfile.TemporaryDirectory(prefix="racecraft-import-") as folder:
            yield _archive(path, Path(folder), limits)


def _folder(root: Path) -> Source:
    files: dict[str, SourceFile] = {}
    num_links = 0
    waiting = [(root, "", 0)]
    place = root.resolve()
    if place.parent.name == EXPERIMENTS and (bucket := place.parent.parent / BUCKET).is_dir():
        waiting.append((bucket, f"{BUCKET}/", 0))  # an experiment's models lie where all others do
    while waiting:
        folder, prefix, depth = waiting.pop()
        try:
            with os.scandir(folder) as entries:
                listed = sorted(entries, key=lambda entry: entry.name)
        except OSError as error:
            raise SourceError(f"{folder} cannot be read: {error.strerror or error}.") from error
        for entry in listed:
            name = prefix + entry.name
            if entry.is_symlink():
                num_links += 1
            elif entry.is_dir(follow_symlinks=False):
                if entry.name not in _SKIPPED and depth < MAX_DEPTH:
                    waiting.append((Path(entry.path), f"{name}/", depth + 1))
            elif entry.is_file(follow_symlinks=False):
                files[name] = SourceFile(name, entry.stat(follow_symlinks=False).st_size, Path(entry.path))
        if len(files) > MAX_FILES:
            raise SourceError(
                f"{root} holds more than {MAX_FILES:,} files.", hint="Import the folder of one model, not of many."
            )
    return Source(f"folder {root.name or root}", place.name, files, num_links)


def _single(path: Path) -> Source:
    """A reward function, and the settings files beside it."""
    files = {}
    for name in (path.name, METADATA, HYPERPARAMETERS, TRAINING_PARAMS):
        file = path.with_name(name)
        if file.is_file():
            files[name] = SourceFile(name, file.stat().st_size, file)
    return Source(path.name, path.stem if path.stem != Path(REWARD).stem else "imported", files, reward=path.name)


def _archive(path: Path, folder: Path, limits: Limits) -> Source:
    files: dict[str, SourceFile] = {}
    total = 0
    for number, member in enumerate(read_archive(path, limits=limits)):
        kept = None
        base = member.name.rpartition("/")[2]
        if base.startswith("._") or member.name.startswith("__MACOSX/"):
            continue  # what macOS puts beside every file
        what, is_kept_as_it_is = role(member.name), is_plain(base.removeprefix("."))
        # weights are read here and left: a car takes any graph, whatever its name
        if member.size <= MAX_BYTES.get(what, -1) and (is_kept_as_it_is or what == "weights"):
            total += member.size
            if total > MAX_KEPT_BYTES:
                raise SourceError(
                    f"{path.name} holds more than {MAX_KEPT_BYTES:,} bytes of logs, weights and settings."
                )
            kept = folder / str(number) / (base if is_kept_as_it_is else "weights")
            kept.parent.mkdir()
            with kept.open("xb") as file:
                while data := member.read(CHUNK):
                    file.write(data)
        files[member.name] = SourceFile(member.name, member.size, kept)
    stem = path.name
    for ending in (".gz", ".tar", ".tgz", ".zip"):
        stem = stem.removesuffix(ending)
    return Source(f"archive {path.name}", stem, files)
