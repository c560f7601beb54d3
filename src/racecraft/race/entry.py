"""Who takes part in a race: a run's policy, by the name of the run and its checkpoint.

An entry is what drives, and nothing else: a race never asks a run how it was trained, in which car or by which rules.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from racecraft.agent.sensor_suite import SensorSuite
from racecraft.checks import check_type
from racecraft.errors import NonFiniteAction
from racecraft.race.policy import NetworkPolicy, load_policy
from racecraft.run.checkpoint import split_model
from racecraft.run.folder import MAX_NAME, RunFolder


@dataclass(frozen=True, eq=False)
class Entry:
    """A model at the start."""

    name: str
    """In results and videos: printable, and different for every entry of a race."""
    run: Path
    """Its run folder."""
    step: int
    """Camera steps of training behind its checkpoint, as the run says."""
    policy: NetworkPolicy
    """What drives."""

    def __call__(self, sight: NDArray[Any]) -> NDArray[np.float32]:
        """Commands for what its sensors read, as `racecraft.race.evaluation.Driver`.

        Raises:
            NonFiniteAction: Its network gives NaN; the message says whose.
        """
        try:
            return self.policy(sight)
        except NonFiniteAction as error:
            raise NonFiniteAction(f"{self.name} cannot drive: {error}", hint="Leave it out of the race.") from error

    @property
    def sensors(self) -> SensorSuite:
        """What it sees through."""
        return self.policy.sensors


def load_entry(model: str | Path, *, num_threads: int = 0) -> Entry:
    """A model by ``RUN`` or ``RUN@CHECKPOINT``; the checkpoint is ``best``, ``last`` or a number of steps.

    Raises:
        RunError: There is no such run.
        CheckpointError: There is no such checkpoint, it is damaged, or holds what is not its network's.
        ConfigError: The checkpoint is none of those, or the action space or the sensors are not allowed.
    """
    path, checkpoint = split_model(model)
    folder = RunFolder.open(path)
    step, policy = load_policy(folder, checkpoint=checkpoint or "best", num_threads=num_threads)
    name = _shown(folder.path.resolve().name) + (f"@{checkpoint}" if checkpoint else "")
    return Entry(name, folder.path, step, policy)


def check_models(models: Any) -> None:
    """Refuse what is no list of models, such as a single one.

    Raises:
        ConfigError: Says what to use.
    """
    if isinstance(models, str | Path) or not isinstance(models, Sequence):
        check_type("models", models, (), "use a list of run folders, RUN or RUN@CHECKPOINT")


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


def _shown(name: str) -> str:
    """A folder's name, which may be anybody's, without what could drive a terminal, and as long as ours may be."""
    return "".join(mark if mark.isprintable() else "�" for mark in name[:MAX_NAME])
