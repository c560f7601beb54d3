"""Checkpoints that survive a kill at any moment: safetensors files and a manifest that is written last.

    checkpoints/000020480-1f3a9b2c.safetensors   step, and the first 8 digits of the file's SHA-256
    checkpoints/manifest.json                    size, checksum, score, metrics of each; best and last

A file is believed only when its size and checksum are right. When the manifest itself is lost, the files and
their names are enough to do without it. Nothing here is ever unpickled. Weights alone, of a run with an ``origin`` and
no training yet, may lie there as float16; they are read as float32.
"""

from __future__ import annotations

import hashlib
import json
import math
import os
import re
import stat
import time
import warnings
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from racecraft.checks import is_number
from racecraft.errors import CheckpointError, ConfigError, did_you_mean
from racecraft.json_file import parse_json_object
from racecraft.run.atomic import TEMPORARY, write_file, write_json
from racecraft.run.tensor_file import is_storable, tensor_file

FORMAT = 1
KEEP = 4  # as AWS: the last four and the best; and the one that a run began with
MAX_FILE_BYTES = 1 << 33  # 8 GiB; AWS's networks with Adam's state take 140 MB
MAX_MANIFEST_BYTES = 1 << 22
MANIFEST = "manifest.json"
_NAME = re.compile(r"(\d{9,18})-([0-9a-f]{8})\.safetensors")
_STEP = re.compile(r"[0-9]{1,18}")  # as many digits as a file's name has; int() also reads other scripts' digits
HEADER_KEY = "racecraft"  # the one entry of the safetensors header's metadata: a JSON text


class CheckpointWarning(UserWarning):
    """A checkpoint was damaged and another one was used."""


@dataclass(frozen=True)
class Entry:
    """One line of the manifest."""

    step: int
    """Camera steps of training behind it."""
    file: str
    """Name in the folder."""
    size: int
    """Bytes."""
    sha256: str
    """Of the whole file, hexadecimal."""
    time_stamp: float
    """When it was saved, s since 1970."""
    score: tuple[float, ...] | None
    """What makes one better than another, most important first, larger is better; None when not evaluated."""
    metrics: dict[str, float | None]
    """Numbers to show beside it."""


@dataclass(frozen=True, eq=False)
class Checkpoint:
    """What was saved."""

    step: int
    arrays: dict[str, NDArray[Any]]
    """Weights and optimizer state by name; the arrays are writable and belong to the caller."""
    metadata: dict[str, Any]
    metrics: dict[str, float | None]
    score: tuple[float, ...] | None
    path: Path

    def check_arrays(self, own: Mapping[str, NDArray[Any]]) -> None:
        """Refuse arrays of another type than those of the same name that a training has, and NaN and infinity in any.

        Shapes are for those to check who take the arrays: some grow with a training.

        Raises:
            CheckpointError: Names the array.
        """
        for name, array in self.arrays.items():
            expected = own[name].dtype if name in own else array.dtype
            if array.dtype != expected:
                raise CheckpointError(f"{self.path} cannot be resumed: {name} is {array.dtype} instead of {expected}.")
            if array.dtype.kind == "f" and not np.isfinite(array).all():
                raise CheckpointError(f"{self.path} cannot be resumed: {name} holds NaN or infinity.")


@dataclass(frozen=True, eq=False)
class StoredCheckpoint:
    """A checkpoint on disk that is whole; its arrays are read when they are asked for, and no others."""

    step: int
    metadata: dict[str, Any]
    metrics: dict[str, float | None]
    score: tuple[float, ...] | None
    path: Path
    kinds: dict[str, tuple[str, tuple[int, ...]]]
    """Type that it is read as, by the format's name (``F32``), and shape of every array by name."""

    def read(self, names: Iterable[str]) -> dict[str, NDArray[Any]]:
        """Some of its arrays; they are writable and belong to the caller.

        Raises:
            CheckpointError: The file cannot be read, or has no such array.
        """
        from safetensors import SafetensorError, safe_open

        try:
            with safe_open(self.path, framework="numpy") as file:
                arrays = {name: np.array(file.get_tensor(name)) for name in names}
        except (OSError, SafetensorError, TypeError, ValueError) as error:
            raise CheckpointError(f"{self.path} cannot be read: {error}.") from error
        return {
            name: array.astype(np.float32) if array.dtype == np.float16 and self.kinds[name][0] == "F32" else array
            for name, array in arrays.items()
        }


class CheckpointStore:
    """The checkpoints of one run.

    Args:
        folder: Where they lie; made when the first one is saved.
        keep: How many of the last ones stay, beside the best.
        aws_index: Where to write AWS's ``deepracer_checkpoints.json``, if anywhere.
    """

    def __init__(self, folder: str | Path, *, keep: int = KEEP, aws_index: Path | None = None) -> None:
        self.folder = Path(folder)
        self.keep = keep
        self.aws_index = aws_index

    def save(
        self,
        step: int,
        arrays: Mapping[str, NDArray[Any]],
        *,
        metadata: Mapping[str, Any] | None = None,
        metrics: Mapping[str, float] | None = None,
        score: Sequence[float] | None = None,
        time_stamp: float | None = None,
    ) -> Path:
        """Save a checkpoint, then remove what need not be kept.

        Args:
            step: Camera steps of training so far; of step 0, what a run begins with, only the one saved last is kept.
            arrays: Numeric arrays by name.
            metadata: Any JSON: settings, counters, states of random generators.
            metrics: Numbers to show in lists of checkpoints.
            score: Most important number first, larger is better; of equal ones the later is best, as at AWS.
            time_stamp: When it was made, s since 1970, where its file is to repeat to the bit; now by default.

        Raises:
            CheckpointError: It could not be saved; the earlier ones are as good as before.
        """
        step, time_stamp = int(step), time.time() if time_stamp is None else float(time_stamp)
        if step < 0:
            raise CheckpointError(f"step is {step}; allowed is 0 or more.")
        shown = {name: float(v) if math.isfinite(v) else None for name, v in (metrics or {}).items()}
        ranked = None if score is None else tuple(map(float, score))
        if ranked is not None and not all(map(math.isfinite, ranked)):
            raise CheckpointError(f"score is {ranked}; allowed are finite numbers.")
        header = {
            "step": step,
            "time_stamp": time_stamp,
            "score": ranked,
            "metrics": shown,
            "metadata": metadata or {},
        }
        pieces = _encode(arrays, header)
        digest = _digest(pieces)
        size = sum(piece.nbytes for piece in pieces)
        entry = Entry(step, f"{step:09d}-{digest[:8]}.safetensors", size, digest, time_stamp, ranked, shown)
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            kept = self._kept([*(e for e in self.entries() if e.file != entry.file and (step or e.step)), entry])
            write_file(self.folder / entry.file, pieces)
            self._write_manifest(kept)
        except OSError as error:
            self._prune()
            raise CheckpointError(
                f"Checkpoint {step} could not be saved in {self.folder}: {error.strerror or error}.",
                hint="The earlier checkpoints are good. Free disk space or repair permissions, then resume.",
            ) from error
        self._prune()
        return self.folder / entry.file

    def load(self, which: str | int = "last") -> Checkpoint:
        """The last, the best, or the checkpoint of a step, as `find` finds it, with all its arrays.

        Raises:
            CheckpointError: There is none, or none that is whole.
        """
        found = self.find(which)
        arrays = found.read(found.kinds)
        return Checkpoint(found.step, arrays, found.metadata, found.metrics, found.score, found.path)

    def find(self, which: str | int = "last") -> StoredCheckpoint:
        """Find the last, the best, or the checkpoint of a step.

        A damaged last or best one is passed over with a `CheckpointWarning` for the next best there is.

        Args:
            which: ``"last"``, ``"best"`` or a step, as a number or in digits.

        Raises:
            CheckpointError: There is none, or none that is whole.
        """
        if isinstance(which, str) and is_step(which):
            which = int(which)
        entries = self.entries()
        if not entries:
            raise CheckpointError(f"{self.folder} has no checkpoint.", hint="Train first, or check the path.")
        if which == "last":
            candidates = list(reversed(entries))
        elif which == "best":
            ranked = sorted((_rank(entry), place) for place, entry in enumerate(entries))
            candidates = [entries[place] for _, place in reversed(ranked)]
        elif isinstance(which, str):
            hint = did_you_mean(which, ("last", "best"))
            raise CheckpointError(f"checkpoint is {which!r}; allowed is 'last', 'best' or a step.", hint=hint)
        else:
            candidates = [entry for entry in reversed(entries) if entry.step == which][:1]
        if not candidates:
            steps = ", ".join(str(entry.step) for entry in entries)
            raise CheckpointError(f"{self.folder} has no checkpoint of step {which}; allowed are {steps}.")
        damage = []
        for entry in candidates:
            try:
                checkpoint = self._read(entry)
            except CheckpointError as error:
                damage.append(str(error))
                continue
            if damage:
                warnings.warn(f"{' '.join(damage)} Using step {entry.step}.", CheckpointWarning, stacklevel=2)
            return checkpoint
        raise CheckpointError(" ".join(damage), hint="No other checkpoint of this run is whole.")

    def entries(self) -> list[Entry]:
        """All checkpoints in the order they were saved; without a whole manifest those in the folder.

        Raises:
            CheckpointError: The folder cannot be read, or was written by a later version.
        """
        try:
            try:
                return self._read_manifest()
            except CheckpointError:
                raise
            except FileNotFoundError:
                reason = "is missing"
            except (ValueError, TypeError, KeyError) as error:
                reason = f"is damaged ({error})"
            entries = self._scan()
        except OSError as error:
            raise CheckpointError(f"{self.folder} cannot be read: {error.strerror or error}.") from error
        if entries:
            warnings.warn(
                f"{self.folder / MANIFEST} {reason}; {len(entries)} whole checkpoints were found beside it.",
                CheckpointWarning,
                stacklevel=2,
            )
        return entries

    @property
    def last(self) -> Entry | None:
        """The checkpoint saved last."""
        return next(reversed(self.entries()), None)

    @property
    def best(self) -> Entry | None:
        """The checkpoint with the highest score; without any score the last one."""
        return _best(self.entries())

    def _kept(self, entries: list[Entry]) -> list[Entry]:
        """The last ones, the best one, and what a run began with: weights from elsewhere are nowhere else."""
        best = _best(entries)
        return [entry for entry in entries if entry in entries[-self.keep :] or entry is best or entry.step == 0]

    def _write_manifest(self, entries: list[Entry]) -> None:
        best = _best(entries) or entries[-1]
        lines = [asdict(entry) for entry in entries]
        document = {"format": FORMAT, "best": best.file, "last": entries[-1].file, "checkpoints": lines}
        write_json(self.folder / MANIFEST, document)
        if self.aws_index is not None:
            self.aws_index.parent.mkdir(parents=True, exist_ok=True)
            write_json(self.aws_index, {"best_checkpoint": _aws(best), "last_checkpoint": _aws(entries[-1])})

    def _read_manifest(self) -> list[Entry]:
        with (self.folder / MANIFEST).open("rb") as file:
            data = file.read(MAX_MANIFEST_BYTES + 1)
        if len(data) > MAX_MANIFEST_BYTES:
            raise ValueError(f"larger than {MAX_MANIFEST_BYTES:,} bytes")
        document = parse_json_object(data, name="it")
        if document["format"] != FORMAT:
            raise CheckpointError(
                f"{self.folder / MANIFEST} has format {document['format']!r}, this version reads {FORMAT}.",
                hint="Update Racecraft.",
            )
        return [_entry(line) for line in document["checkpoints"]]

    def _scan(self) -> list[Entry]:
        """Entries of the whole files in the folder, oldest first: what a rebuilt manifest holds."""
        entries = []
        for path in self.folder.glob("*.safetensors"):
            name = _NAME.fullmatch(path.name)
            with suppress(ValueError, KeyError, TypeError):
                size = path.stat().st_size
                if name is None or not path.is_file() or size > MAX_FILE_BYTES:
                    continue
                with path.open("rb") as file:
                    digest = hashlib.file_digest(file, "sha256").hexdigest()
                if digest[:8] != name[2]:
                    continue
                header = {**header_of(path)[0], "file": path.name, "size": size, "sha256": digest}
                entries.append(_entry(header))
        return sorted(entries, key=lambda entry: entry.time_stamp)

    def _read(self, entry: Entry) -> StoredCheckpoint:
        path = self.folder / entry.file
        try:
            status = path.stat()
            if not stat.S_ISREG(status.st_mode):  # a pipe would never end
                raise CheckpointError(f"{path} is no file.")
            if status.st_size != entry.size:
                raise CheckpointError(f"{path} has {status.st_size:,} bytes instead of {entry.size:,}.")
            if entry.size > MAX_FILE_BYTES:
                raise CheckpointError(f"{path} is larger than {MAX_FILE_BYTES:,} bytes.")
            with path.open("rb") as file:
                digest = hashlib.file_digest(file, "sha256").hexdigest()
        except OSError as error:
            raise CheckpointError(f"{path} cannot be read: {error.strerror or error}.") from error
        if digest != entry.sha256:
            raise CheckpointError(f"{path} is damaged: its checksum is wrong.")
        try:
            header, kinds = header_of(path)
            metadata = dict(header["metadata"])
        except (ValueError, KeyError, TypeError) as error:
            raise CheckpointError(f"{path} is not a checkpoint of Racecraft: {error}.") from error
        if "origin" in metadata:  # weights alone may be kept in halves; what a training goes on with never is
            kinds = {name: ("F32" if kind == "F16" else kind, shape) for name, (kind, shape) in kinds.items()}
        return StoredCheckpoint(entry.step, metadata, entry.metrics, entry.score, path, kinds)

    def _prune(self) -> None:
        """Remove files that the manifest on disk does not list: old checkpoints and unfinished ones."""
        with suppress(OSError, ValueError, KeyError, TypeError):
            listed = {entry.file for entry in self._read_manifest()}
            for path in self.folder.iterdir():
                unfinished = path.name.endswith(TEMPORARY)
                if unfinished or (_NAME.fullmatch(path.name) and path.name not in listed):
                    path.unlink()


def is_step(text: str) -> bool:
    """Whether a text names a checkpoint by its camera steps."""
    return _STEP.fullmatch(text) is not None


def split_model(model: str | Path) -> tuple[str, str]:
    """``RUN@CHECKPOINT`` as path and checkpoint; the checkpoint is empty where none is named.

    Raises:
        ConfigError: There is no name, or what follows the @ names no checkpoint.
    """
    path, _, checkpoint = str(model).rpartition("@")
    if not path and not checkpoint:
        raise ConfigError("A model has no name; give the path of a run folder.")
    if not path or "/" in checkpoint or os.path.exists(model):
        return str(model), ""
    if checkpoint not in ("best", "last") and not is_step(checkpoint):
        raise ConfigError(f"Checkpoint {checkpoint!r} of {path} is none; allowed are best, last and a number of steps.")
    return path, checkpoint


def _rank(entry: Entry) -> tuple[float, ...]:
    return entry.score if entry.score is not None else (-math.inf,)


def _best(entries: list[Entry]) -> Entry | None:
    return max(reversed(entries), key=_rank, default=None)


def _aws(entry: Entry) -> dict[str, Any]:
    metric = entry.score[0] if entry.score else None
    return {"name": entry.file, "avg_eval_metric": metric, "time_stamp": entry.time_stamp}


def _entry(line: Mapping[str, Any]) -> Entry:
    """An entry from JSON, refused unless every value is what it has to be."""
    entry = Entry(
        step=_whole(line["step"]),
        file=str(line["file"]),
        size=_whole(line["size"]),
        sha256=str(line["sha256"]),
        time_stamp=_number(line["time_stamp"]),
        score=None if line["score"] is None else tuple(map(_number, line["score"])),
        metrics={name: None if value is None else _number(value) for name, value in dict(line["metrics"]).items()},
    )
    name = _NAME.fullmatch(entry.file)
    if name is None or int(name[1]) != entry.step or not entry.sha256.startswith(name[2]):
        raise ValueError(f"{entry.file!r} is not the name of a checkpoint of step {entry.step}")
    return entry


def _whole(value: object) -> int:
    if type(value) is not int or value < 0:
        raise ValueError(f"{str(value)[:40]!r} is no whole number from 0")
    return value


def _number(value: object) -> float:
    if not is_number(value):  # a text may say "nan"
        raise ValueError(f"{str(value)[:40]!r} is no number")
    return float(cast(float, value))


def _encode(arrays: Mapping[str, NDArray[Any]], header: Mapping[str, Any]) -> list[memoryview]:
    plain = {name: np.asarray(values) for name, values in arrays.items()}
    for name, array in plain.items():
        if not is_storable(array):
            raise CheckpointError(f"array {name!r} has type {array.dtype}; allowed are booleans, integers, floats.")
    try:
        text = json.dumps(header, allow_nan=False, default=_plain)
    except (TypeError, ValueError) as error:
        raise CheckpointError(f"metadata of a checkpoint must be JSON: {error}.") from error
    return list(tensor_file(plain, {HEADER_KEY: text}))


def _digest(pieces: Iterable[memoryview]) -> str:
    digest = hashlib.sha256()
    for piece in pieces:
        digest.update(piece)
    return digest.hexdigest()


def _plain(value: object) -> object:
    if isinstance(value, np.generic):
        return value.item()
    raise TypeError(f"{type(value).__name__} {value!r} has no JSON form")


def header_of(path: Path) -> tuple[dict[str, Any], dict[str, tuple[str, tuple[int, ...]]]]:
    """What a file says of itself, and the type and shape of its arrays by name."""
    from safetensors import SafetensorError, safe_open

    try:
        with safe_open(path, framework="numpy") as file:
            header = parse_json_object((file.metadata() or {})[HEADER_KEY], name="its header")
            names: list[str] = file.keys()
            slices = {name: file.get_slice(name) for name in names}
            kinds = {name: (str(one.get_dtype()), tuple(one.get_shape())) for name, one in slices.items()}
    except (OSError, SafetensorError) as error:
        raise ValueError(str(error)) from error
    return header, kinds
