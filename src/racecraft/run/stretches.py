"""Stretches of a training: with which reward, actions, hyperparameters, track and car it learned, from which step on.

    stretches/1.json    {"format": 1, "number": 1, "step": 0, "began": "...", "reward_function": "...", ...}

A run has one, and another for every time it went on with something changed. A step, be it a point of a curve, a
checkpoint or an evaluation of one, belongs to the last stretch that began before it. A run of an earlier version has
no such files, and one stretch: what its files say.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from racecraft.errors import ConfigError, RunError
from racecraft.json_file import read_json_object
from racecraft.run.atomic import write_file, write_json

if TYPE_CHECKING:
    from racecraft.run.folder import RunFolder

FORMAT: Final = 1
MAX_BYTES: Final = 1 << 22  # a reward function of the largest size, every character escaped, and the rest
FILE_NAME: Final = re.compile(r"[1-9]\d{0,3}\.json")
NOT_LEARNED_FROM: Final = ("until", "num_threads")
"""Settings that say how long, and on how many cores; learning is the same with any."""
ALGORITHMS: Final = ("algorithm", "ppo", "sac", "distill", "sb3", "critic")
"""Settings that AWS calls hyperparameters, or would."""


@dataclass(frozen=True, kw_only=True)
class Stretch:
    """A part of a training in which nothing was changed."""

    number: int
    """From 1."""
    step: int
    """Camera steps of training before it."""
    began: str
    """ISO 8601 in UTC."""
    reward_function: str
    """Source."""
    track: str
    """Name or path, or several."""
    track_digest: str
    model_metadata: dict[str, Any] = field(default_factory=dict)
    """Action space, sensors, network: AWS's document."""
    hyperparameters: dict[str, Any] | None = None
    """AWS's document, where the run follows AWS."""
    settings: dict[str, Any] = field(default_factory=dict)
    """As in ``run.json``, but for `NOT_LEARNED_FROM`."""

    def changes(self, before: Stretch) -> list[str]:
        """What is other than in an earlier stretch, in this order.

        One or more of ``reward``, ``actions``, ``model_metadata``, ``hyperparameters``, ``track``, ``vehicle`` and
        ``settings``.
        """
        mine, theirs = self._parts(), before._parts()
        return [name for name, part in mine.items() if part != theirs[name]]

    def _parts(self) -> dict[str, Any]:
        metadata, settings = dict(self.model_metadata), dict(self.settings)
        actions, vehicle = metadata.pop("action_space", None), settings.pop("vehicle", None)
        learning = {name: settings.pop(name, None) for name in ALGORITHMS}
        return {
            "reward": self.reward_function,
            "actions": (actions, metadata.pop("action_space_type", None)),
            "model_metadata": metadata,
            "hyperparameters": (self.hyperparameters, learning),
            "track": (self.track, self.track_digest),
            "vehicle": vehicle,
            "settings": settings,
        }


def read_stretches(folder: RunFolder) -> list[Stretch]:
    """The stretches of a run in the order they were trained; one at least.

    Raises:
        RacecraftError: A file of theirs, or of a run of an earlier version, is missing or damaged.
    """
    return recorded_stretches(folder) or [_as_it_is(folder, number=1, step=0)]


def begin_stretch(folder: RunFolder, *, step: int) -> Stretch:
    """Training goes on at a step with what the run's files say now: a new stretch, where that is something new.

    Stretches that began at this step or later are forgotten, as what they trained is.

    Raises:
        RacecraftError: A file cannot be read or written.
    """
    recorded = recorded_stretches(folder)
    kept = [stretch for stretch in recorded if stretch.step < step]
    now = _as_it_is(folder, number=len(kept) + 1, step=step if kept else 0)
    for stretch in reversed(recorded[len(kept) :]):
        _path(folder, stretch.number).unlink(missing_ok=True)
    if kept and not now.changes(kept[-1]):
        return kept[-1]
    path = _path(folder, now.number)
    try:
        path.parent.mkdir(exist_ok=True)
        write_json(path, {"format": FORMAT, **asdict(now)})
    except OSError as error:
        raise RunError(f"{path} cannot be written: {error.strerror or error}.") from error
    return now


def stretch_at(stretches: Sequence[Stretch], step: int) -> Stretch:
    """The stretch that trained up to a step."""
    return next((stretch for stretch in reversed(stretches) if stretch.step < step), stretches[0])


def recorded_stretches(folder: RunFolder) -> list[Stretch]:
    """The stretches that have files: none before the first training, or of an earlier version.

    Raises:
        RunError: A file is damaged.
    """
    numbers = []
    if folder.stretches.is_dir():
        numbers = sorted(int(path.stem) for path in folder.stretches.iterdir() if FILE_NAME.fullmatch(path.name))
    found: list[Stretch] = []
    for number in numbers:
        path = _path(folder, number)
        try:
            stretch = _parsed(read_json_object(path, max_bytes=MAX_BYTES))
            if stretch.number != number or (stretch.step <= found[-1].step if found else stretch.step != 0):
                raise ValueError(f"number {stretch.number} at step {stretch.step} is out of order")
        except (ConfigError, ValueError, KeyError, TypeError) as error:
            raise RunError(f"{path} cannot be read: {error}.", hint="Restore it, or delete the folder.") from error
        found.append(stretch)
    return found


def stretches_as_it_is(folder: RunFolder) -> set[int]:
    """The numbers of those that say what the run's files say now, as one that begins now does.

    Raises:
        RacecraftError: A file is missing or damaged.
    """
    recorded = recorded_stretches(folder)
    now = _as_it_is(folder, number=1, step=0)
    return {stretch.number for stretch in recorded if not now.changes(stretch)}


def change_reward(folder: RunFolder, source: str) -> None:
    """Give a run another reward function, from its next step on; the one it learned with so far is kept.

    Args:
        folder: Of a run that nobody is training.
        source: A reward function that was checked.

    Raises:
        RacecraftError: A file cannot be read or written.
    """
    if not recorded_stretches(folder):
        begin_stretch(folder, step=0)
    try:
        write_file(folder.reward_function, source.encode())
    except OSError as error:
        raise RunError(f"{folder.reward_function} cannot be written: {error.strerror or error}.") from error


def _path(folder: RunFolder, number: int) -> Path:
    return folder.stretches / f"{number}.json"


def _parsed(document: dict[str, Any]) -> Stretch:
    if document.pop("format") != FORMAT:
        raise ValueError("it was written by another version of Racecraft")
    stretch = Stretch(**document)
    kinds: tuple[tuple[str, type | tuple[type, ...]], ...] = (
        ("number", int),
        ("step", int),
        ("began", str),
        ("reward_function", str),
        ("track", str),
        ("track_digest", str),
        ("model_metadata", dict),
        ("hyperparameters", (dict, type(None))),
        ("settings", dict),
    )
    for name, kind in kinds:
        if not isinstance(getattr(stretch, name), kind):
            raise TypeError(f"{name} is {getattr(stretch, name)!r:.60}")
    datetime.fromisoformat(stretch.began)
    return stretch


def _as_it_is(folder: RunFolder, *, number: int, step: int) -> Stretch:
    """What the run's files say now; the documents as they stand, so that a later version sees no change in them."""
    info = folder.read_info()
    try:
        parameters = read_json_object(folder.hyperparameters) if folder.hyperparameters.exists() else None
        return Stretch(
            number=number,
            step=step,
            began=info.created if number == 1 else datetime.now(UTC).isoformat(timespec="seconds"),
            reward_function=folder.read_reward_function(),
            track=info.track,
            track_digest=info.track_digest,
            model_metadata=read_json_object(folder.model_metadata),
            hyperparameters=parameters,
            settings={name: value for name, value in info.settings.items() if name not in NOT_LEARNED_FROM},
        )
    except ConfigError as error:
        raise RunError(f"{folder.path} cannot be read: {error}") from error
