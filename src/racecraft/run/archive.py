"""A run as one tar.gz in AWS's layout: what DeepRacer's tools read, and with it all that Racecraft needs to go on.

    model_metadata.json  reward_function.py  hyperparameters.json  training_params.yaml  race_rules.json
    model/  ip/  metrics/  training-simtrace/  evaluation-<time>/
    run.json  checkpoints/  stretches/   settings and weights (safetensors): `racecraft import` takes the run up again
    notes.md                             what people wrote about it

Videos, TensorBoard's files and logs stay behind.
"""

from __future__ import annotations

import gzip
import io
import os
import tarfile
from collections.abc import Iterator
from pathlib import Path
from typing import Final

from racecraft.run.folder import RunFolder

FILES: Final = ("notes.md", "race_rules.json", "run.json")
KEPT: Final = ("model", "ip", "metrics", "training-simtrace", "checkpoints", "stretches", *FILES)
FIRST: Final = ("model_metadata.json", "reward_function.py", "hyperparameters.json", "training_params.yaml")
CHUNK: Final = 1 << 18  # bytes


def archive_chunks(folder: RunFolder) -> Iterator[bytes]:
    """The archive, piece by piece, so that it never lies whole in memory or on disk.

    Files that change meanwhile, as those of a training do, are taken as long as they were when their turn came.
    """
    sink = _Sink()
    with (
        gzip.GzipFile(filename="", fileobj=sink, mode="wb", compresslevel=6, mtime=0) as packed,
        tarfile.open(mode="w|", fileobj=packed, format=tarfile.PAX_FORMAT, bufsize=CHUNK) as tar,
    ):
        for name, path in _files(folder.path):
            try:
                data = path.read_bytes()
            except OSError:
                continue  # an old checkpoint that was removed meanwhile
            member = tarfile.TarInfo(f"{folder.name}/{name}")
            member.size, member.mtime, member.mode = len(data), int(path.stat().st_mtime) if path.exists() else 0, 0o644
            tar.addfile(member, io.BytesIO(data))
            yield from sink.take()
    yield from sink.take()


class _Sink(io.RawIOBase):
    """Where the archive is written to; holds a piece until it is taken."""

    def __init__(self) -> None:
        self._pieces: list[bytes] = []

    def writable(self) -> bool:
        return True

    def write(self, data: bytes) -> int:  # type: ignore[override]
        self._pieces.append(bytes(data))
        return len(data)

    def take(self) -> list[bytes]:
        pieces, self._pieces = self._pieces, []
        return pieces


def _files(root: Path) -> Iterator[tuple[str, Path]]:
    """Name and path of what is kept: settings first, and no links, so that nothing from elsewhere comes along."""
    for name in FIRST:
        if (root / name).is_file() and not (root / name).is_symlink():
            yield name, root / name
    for top in sorted(os.listdir(root)):
        if (top in KEPT or top.startswith("evaluation-")) and not (root / top).is_symlink():
            yield from _below(root, root / top)


def _below(root: Path, path: Path) -> Iterator[tuple[str, Path]]:
    if path.is_file():
        yield path.relative_to(root).as_posix(), path
    elif path.is_dir():
        for name in sorted(os.listdir(path)):
            if not name.startswith(".") and not (path / name).is_symlink():
                yield from _below(root, path / name)
