"""What a learner has solved: a small JSON file in the user's own folder of data."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from racecraft import system
from racecraft.errors import ConfigError
from racecraft.json_file import MAX_BYTES, read_bytes
from racecraft.run.atomic import write_file


class Progress(BaseModel):
    """Exercises and quizzes that were solved."""

    model_config = ConfigDict(extra="forbid", validate_assignment=True)

    exercises: set[str] = Field(default_factory=set)
    """Such as ``1.inside``."""
    quizzes: dict[int, float] = Field(default_factory=dict)
    """Best share of right answers, by lesson."""

    def to_dict(self) -> dict[str, Any]:
        """As JSON."""
        quizzes = {str(number): share for number, share in sorted(self.quizzes.items())}
        return {"exercises": sorted(self.exercises), "quizzes": quizzes}


def progress_path() -> Path:
    """``racecraft/lessons.json`` in ``XDG_DATA_HOME``, or in ``~/.local/share``."""
    base = os.environ.get("XDG_DATA_HOME")
    return (Path(base) if base else Path.home() / ".local" / "share") / "racecraft" / "lessons.json"


def read_progress() -> Progress:
    """What was solved so far.

    Raises:
        ConfigError: The file is damaged, or cannot be read.
    """
    path = progress_path()
    if not os.path.exists(path):  # nor where nobody may look
        return Progress()
    try:
        return Progress.model_validate_json(read_bytes(path, max_bytes=MAX_BYTES))
    except ValidationError as error:
        raise ConfigError(f"{path} holds no progress that can be read.", hint="Delete it to begin anew.") from error


def record_exercise(name: str) -> None:
    """An exercise is solved.

    Raises:
        ConfigError: The file is damaged, or cannot be read.
        OSError: It cannot be written.
    """
    with _to_change() as progress:
        progress.exercises.add(name)


def record_quiz(number: int, share: float) -> None:
    """A lesson's quiz was answered; the best share is kept.

    Raises:
        ConfigError: The file is damaged, or cannot be read.
        OSError: It cannot be written.
    """
    with _to_change() as progress:
        progress.quizzes[number] = max(share, progress.quizzes.get(number, 0.0))


@contextmanager
def _to_change() -> Iterator[Progress]:
    """What was solved so far, kept as the block leaves it; whoever else wants to change it waits.

    What the block leaves as it was is not written again.
    """
    path = progress_path()
    path.parent.mkdir(parents=True, exist_ok=True)
    descriptor = os.open(path.with_suffix(".lock"), os.O_RDWR | os.O_CREAT, 0o644)
    try:
        system.lock(descriptor, waits=True)
        progress = read_progress()
        before = progress.model_copy(deep=True)
        yield progress
        if progress != before:
            write_file(path, json.dumps(progress.to_dict(), indent=1).encode() + b"\n", durable=False)
    finally:
        os.close(descriptor)
