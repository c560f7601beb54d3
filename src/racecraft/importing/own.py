"""Racecraft's own archives: with the settings of ``run.json`` and the checkpoints, a run goes on where it was.

An archive may come from a stranger, so nothing in it is believed before it was read as what it has to be: settings are
checked as those of a new run are, the track is one of Racecraft's and the very same, and weights are safetensors with
the right checksum.
"""

from __future__ import annotations

import re
import shutil
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from racecraft.errors import CheckpointError, RacecraftError, RunError, TrackNotFound
from racecraft.importing.layout import HYPERPARAMETERS, RUN
from racecraft.importing.source import Source, SourceFile
from racecraft.json_file import parse_json_object
from racecraft.run import RunFolder
from racecraft.run.stretches import FILE_NAME, recorded_stretches
from racecraft.scoped_warnings import scoped_warnings
from racecraft.track import Track, joint_digest, load_tracks
from racecraft.training.settings import TrainSettings

_TRACKS: Final = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_:.,+-]{0,199}")
_WEIGHTS: Final = re.compile(r"checkpoints/(manifest\.json|\d{9,18}-[0-9a-f]{8}\.safetensors)")
_PLAIN: Final = ("metrics/history.jsonl", "metrics/evolution.jsonl", "notes.md")
_STRETCHES: Final = "stretches/"


@dataclass(frozen=True)
class OwnRun:
    """What an archive of Racecraft says about its run."""

    settings: TrainSettings
    tracks: Sequence[Track]
    has_hyperparameters: bool
    """Whether the run follows AWS's hyperparameters."""
    files: dict[str, SourceFile]
    """Checkpoints, curves, laps of the training, stretches and notes, by their path in the run."""

    def restore(self, folder: RunFolder, notes: list[str]) -> dict[str, str]:
        """Put all of these into a new run folder; what became of what.

        Args:
            folder: Of the new run.
            notes: Gets a sentence for what is damaged.
        """
        for path, file in self.files.items():
            if file.path is not None:
                (folder.path / path).parent.mkdir(parents=True, exist_ok=True)
                shutil.copyfile(file.path, folder.path / path)
        try:
            recorded_stretches(folder)
        except RunError as error:
            shutil.rmtree(folder.stretches, ignore_errors=True)
            notes.append(f"What the run learned with before its last change is not known: {error}")
        store = folder.checkpoints
        try:
            with scoped_warnings("ignore"):
                step = store.load("last").step
        except CheckpointError as error:
            shutil.rmtree(store.folder, ignore_errors=True)
            folder.history.unlink(missing_ok=True)
            folder.evolution.unlink(missing_ok=True)
            shutil.rmtree(folder.stretches, ignore_errors=True)
            if any(path.startswith("checkpoints/") for path in self.files):
                notes.append(f"No checkpoint is whole, so training begins with fresh weights: {error}")
            return {}
        return {"checkpoints": f"training goes on at step {step:,}"}


def read_own(source: Source, root: str, *, track: str = "") -> OwnRun | None:
    """The run of an archive of ours, or None where it is another's, or of another road than the given one.

    Args:
        source: The archive.
        root: Where in it the run is.
        track: Name or file of its track, where Racecraft has none by its name.

    Raises:
        RunError: ``run.json`` is damaged or of another version.
        TrackNotFound: The track is not one of Racecraft's, or has changed.
    """
    if root + RUN not in source.files:
        return None
    document = parse_json_object(source.text(root + RUN), name=RUN)
    try:
        named, digest = str(document["track"]), str(document["track_digest"])
        settings = TrainSettings.from_dict({**document["settings"], "seed": document["seed"], "track": track or named})
    except (KeyError, TypeError) as error:
        raise RunError(f"{RUN} of {source.title} is damaged: {error!r}.") from error
    if track and joint_digest(load_tracks(track)) != digest:
        return None
    try:
        if not track and (not _TRACKS.fullmatch(named) or ".." in named):  # a stranger's name must not become a path
            raise TrackNotFound("not a name")
        tracks = load_tracks(track or named)
    except RacecraftError as error:
        raise TrackNotFound(
            f"The run drives on {named[:80]!r}, which is not among Racecraft's tracks.",
            hint="Give another track with --track NAME; training then begins with fresh weights.",
        ) from error
    if joint_digest(tracks) != digest:
        raise TrackNotFound(
            f"The run's track {named!r} is not the one that Racecraft has by this name.",
            hint="Give a track with --track NAME; training then begins with fresh weights.",
        )
    files = {
        name.removeprefix(root): file
        for name, file in source.files.items()
        if name.startswith(root) and _is_restored(name[len(root) :])
    }
    return OwnRun(settings, tracks, root + HYPERPARAMETERS in source.files, files)


def _is_restored(path: str) -> bool:
    is_stretch = path.startswith(_STRETCHES) and FILE_NAME.fullmatch(path.removeprefix(_STRETCHES)) is not None
    return is_stretch or path in _PLAIN or _WEIGHTS.fullmatch(path) is not None
