"""Who takes part in a race: a run's policy, by the name of the run and its checkpoint."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from racecraft.errors import ConfigError
from racecraft.race.policy import NetworkPolicy, load_policy
from racecraft.run.folder import RunFolder, RunInfo


@dataclass(frozen=True, eq=False)
class Entry:
    """A model at the start."""

    name: str
    """In results and videos; different for every entry of a race."""
    run: Path
    """Its run folder."""
    step: int
    """Camera steps of training behind its checkpoint."""
    policy: NetworkPolicy
    """What drives."""
    info: RunInfo
    """How it was trained."""


def load_entry(model: str | Path, *, num_threads: int = 0) -> Entry:
    """A model by ``RUN`` or ``RUN@CHECKPOINT``; the checkpoint is ``best``, ``last`` or a number of steps.

    Raises:
        RunError: There is no such run.
        CheckpointError: There is no such checkpoint, or it is damaged.
        ConfigError: The checkpoint is none of those.
    """
    path, checkpoint = split_model(model)
    folder = RunFolder.open(path)
    step, policy = load_policy(folder, checkpoint=checkpoint or "best", num_threads=num_threads)
    name = folder.path.resolve().name + (f"@{checkpoint}" if checkpoint else "")
    return Entry(name, folder.path, step, policy, folder.read_info())


def load_entries(models: Sequence[str | Path], *, num_threads: int = 0) -> list[Entry]:
    """All models of a race, each with a name of its own: a model may race against itself."""
    entries: list[Entry] = []
    for model in models:
        entry = load_entry(model, num_threads=num_threads)
        taken = {other.name for other in entries}
        number, name = 2, entry.name
        while name in taken:
            name, number = f"{entry.name}-{number}", number + 1
        entries.append(replace(entry, name=name))
    return entries


def split_model(model: str | Path) -> tuple[str, str | int]:
    """``RUN@CHECKPOINT`` as path and checkpoint; the checkpoint is empty where none is named."""
    path, _, checkpoint = str(model).rpartition("@")
    if not path and not checkpoint:
        raise ConfigError("A model has no name; give the path of a run folder.")
    if not path or "/" in checkpoint or Path(str(model)).exists():
        return str(model), ""
    if checkpoint.isdigit():
        return path, int(checkpoint)
    if checkpoint not in ("best", "last"):
        raise ConfigError(f"Checkpoint {checkpoint!r} of {path} is none; allowed are best, last and a number of steps.")
    return path, checkpoint
