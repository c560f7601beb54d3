"""What an import found: what was understood and became what, what was not, and how to go on."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from racecraft.errors import RacecraftError, RunError, SourceError, printable, typed
from racecraft.importing.layout import Role, meant_by, role
from racecraft.importing.source import SourceFile

_WHY: dict[Role, str] = {
    "weights": "other weights of the model, and what TensorFlow needs beside them",
    "video": "videos and pictures are not needed",
    "code": "code besides the reward function is neither run nor kept",
    "archive": "archives inside are not opened; import one by itself",
    "other": "nothing that is read",
}
_WHY_MISNAMED = "the original's file has another name: give it that if it is to be read"


@dataclass(frozen=True, kw_only=True)
class ImportedRun:
    """A run made from files of the original, ready to be trained."""

    run: Path
    """Its folder."""
    kind: str
    """What was imported."""
    track: str
    """Where it drives."""
    used: dict[str, str] = field(default_factory=dict)
    """Files and settings that were understood, and what each became."""
    unused: dict[str, str] = field(default_factory=dict)
    """Files and settings that have no effect, and why."""
    unknown: dict[str, str] = field(default_factory=dict)
    """Settings that nobody here knows, and a suggestion or an empty string."""
    kept: list[str] = field(default_factory=list)
    """Metrics, sim-traces and logs of the original, below `kept_in`."""
    kept_in: str = "original"
    """Folder of the run; empty where they lie in it as they did, in a run that was Racecraft's before."""
    notes: list[str] = field(default_factory=list)
    """Sentences for the user."""

    @property
    def next_command(self) -> str:
        """What trains it."""
        return f"racecraft train --resume {typed(self.run)}"

    def to_dict(self) -> dict[str, Any]:
        """As JSON, which cannot hold each name that a file may have."""
        return {
            "run": str(self.run),
            "kind": printable(self.kind),
            "track": self.track,
            "used": _plain(self.used),
            "unused": _plain(self.unused),
            "unknown": _plain(self.unknown),
            "kept": self.kept,
            "kept_in": self.kept_in,
            "notes": [printable(note) for note in self.notes],
            "next": self.next_command,
        }


def _plain(told: dict[str, str]) -> dict[str, str]:
    return {printable(what): printable(why) for what, why in told.items()}


def unused_files(files: Iterable[SourceFile], root: str) -> dict[str, str]:
    """Files that are not taken over for what they are: a line for each kind, with the number and size."""
    found: dict[Role, list[SourceFile]] = {}
    lines = {}
    for file in files:
        if meant_by(file.name):
            lines[f"{file.name.removeprefix(root)} ({_size(file.size)})"] = _WHY_MISNAMED
        else:
            found.setdefault(role(file.name), []).append(file)
    for kind, why in _WHY.items():
        if kind in found:
            names = sorted(file.name.removeprefix(root) for file in found[kind])
            size = sum(file.size for file in found[kind])
            more = f" and {len(names) - 1} more" if len(names) > 1 else ""
            lines[f"{names[0]}{more} ({_size(size)})"] = why
    return lines


def _size(count: int) -> str:
    return f"{count / 1e6:,.1f} MB" if count >= 100_000 else f"{count:,} bytes"


def failure(error: OSError, run: Path) -> RacecraftError:
    """Why a run could not be written: for want of room or rights, or as a file of the model went meanwhile."""
    if isinstance(error, FileNotFoundError) and error.filename and not Path(error.filename).is_relative_to(run):
        return SourceError(
            f"{error.filename} went while it was imported.", hint="Stop what changes that folder, such as its training."
        )
    return RunError(f"{run} cannot be written: {error.strerror or error}.")
