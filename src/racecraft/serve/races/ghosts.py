"""Ghosts of a film: evaluations that can be some, the replays of those that drove before, and where they were.

request ──▶ replays ──keep──▶ own copies ──sources_of──▶ what `load_ghosts` takes
                                                ghosts ──write_beside──▶ a file ──read_beside──▶ the page

Heats have them, and entries of races. The copies are made when one is asked for: they travel with it to whoever drives
it, and what they were copied from may be removed meanwhile.
"""

from __future__ import annotations

import heapq
import json
import os
import shutil
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from racecraft.errors import ConfigError, RacecraftError
from racecraft.json_file import read_json_object
from racecraft.run import RunFolder, list_runs
from racecraft.run.atomic import write_file
from racecraft.serve.problems import Conflict, NotFound
from racecraft.track import Track

if TYPE_CHECKING:
    from racecraft.film.ghost import Ghost
    from racecraft.race.recording import Recording
    from racecraft.serve.races.ghost_schemas import EvaluatedCard
    from racecraft.serve.races.schemas import ReplayGhost
    from racecraft.sim.views import CarView

BESIDE: Final = "ghosts.json"
"""Where the ghosts were, beside those that drove; in the folder of the heat or entry."""
NEWEST: Final = 20
"""Evaluations of a model that are listed."""
MAX_LISTED: Final = 500
MAX_READ: Final = 2000
"""Evaluations whose summaries are read for a list; it is to be there within a second."""
MAX_BESIDE: Final = 16 << 20
"""Bytes of the file that says where the ghosts were, which a worker may have written; an hour of sixteen has them."""


def entry_name(starter: dict[str, Any]) -> str:
    """A model that drives, with its checkpoint unless that is the best."""
    model, checkpoint = starter["model"], starter["checkpoint"]
    return str(model) if checkpoint == "best" else f"{model}@{checkpoint}"


def ghost_file(number: int) -> str:
    """Of the copy of a ghost's replay, inside the folder of the heat or entry, by its place among the ghosts."""
    return f"ghosts/{number}.replay"


def evaluated(runs: Path, track: Track, direction: str = "forward") -> list[EvaluatedCard]:
    """Evaluations on a track, driven that way round, that have a replay; model by model, the newest first.

    They are of the newest `MAX_READ` of all. Of those whose files do not tell their road or direction only the track's
    name is known here; a replay itself is looked at by who asks for it as a ghost.
    """
    folders = list_runs(runs)
    stamps = [(stamp, number) for number, folder in enumerate(folders) for stamp in _stamps(folder)]
    found: list[list[EvaluatedCard]] = [[] for _ in folders]
    for stamp, number in heapq.nlargest(MAX_READ, stamps):
        if len(found[number]) < NEWEST and (card := _card(folders[number], stamp, track, direction)) is not None:
            found[number].append(card)
    return list(chain.from_iterable(found))[:MAX_LISTED]


def _stamps(folder: RunFolder) -> list[str]:
    with suppress(OSError):
        names = [name.removeprefix("evaluation-") for name in os.listdir(folder.path) if name.startswith("evaluation-")]
        return [stamp for stamp in names if stamp.isascii() and stamp.isdigit()]
    return []


def _card(folder: RunFolder, stamp: str, track: Track, direction: str) -> EvaluatedCard | None:
    if not folder.evaluation_replay(stamp).is_file():
        return None
    try:
        summary = read_json_object(folder.evaluation(stamp) / "evaluation.json")
    except RacecraftError:
        return None
    if summary.get("track") != track.name or summary.get("track_digest", track.digest) != track.digest:
        return None
    try:
        if summary["conditions"]["rules"]["direction"] != direction:
            return None
    except (KeyError, TypeError):
        pass  # from before that was told
    from racecraft.serve.races.ghost_schemas import EvaluatedCard  # jobs do without messages

    best = summary.get("best_lap_seconds")
    return EvaluatedCard(
        model=folder.name, evaluation=stamp, best_lap=float(best) if isinstance(best, int | float) else None
    )


def evaluation_replay(folder: RunFolder, stamp: str) -> Path:
    """The replay of a model's evaluation.

    Raises:
        NotFound: There is no such evaluation.
        Conflict: It has no replay.
    """
    if not (stamp.isascii() and stamp.isdigit()) or not folder.evaluation(stamp).is_dir():
        raise NotFound(f"Model {folder.name!r} has no evaluation {stamp[:40]!r}.")
    path = folder.evaluation_replay(stamp)
    if not path.is_file():
        raise Conflict(
            f"Evaluation {stamp!r} of model {folder.name!r} has no replay.", hint="Evaluate the model once more."
        )
    return path


def keep(replays: Mapping[int, Path], folder: Path) -> None:
    """Copy replays of ghosts into the folder of a heat or an entry, by their places among its ghosts.

    Raises:
        Conflict: One cannot be copied.
    """
    for number, path in replays.items():
        kept = folder / ghost_file(number)
        try:
            kept.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(path, kept)
        except OSError as error:
            shutil.rmtree(folder, ignore_errors=True)
            raise Conflict(f"The replay of ghost {number + 1} cannot be copied: {error.strerror}.") from error


def sources_of(ghosts: Sequence[str | dict[str, Any]], *, folder: Path, runs: Path) -> list[str]:
    """The ghosts of a heat or an entry as `load_ghosts` takes them.

    Args:
        ghosts: As the job's payload has them.
        folder: Of the heat or entry.
        runs: Folder of the models.

    Raises:
        ConfigError: The copy of a replay is not there.
    """
    found = []
    for number, ghost in enumerate(ghosts):
        if isinstance(ghost, str):
            found.append(ghost)
        elif "checkpoint" in ghost:
            found.append(str(runs / entry_name(ghost)))
        elif (kept := folder / ghost_file(number)).is_file():
            found.append(str(kept))
        else:
            raise ConfigError(f"The replay of ghost {number + 1} is not there.", hint="Start it again.")
    return found


def named_as_asked(ghosts: Sequence[Ghost], asked: Sequence[str | dict[str, Any]]) -> list[Ghost]:
    """Ghosts of a film, each by a name of its own.

    Those of an evaluation are called as the model is now, which may have been renamed since it drove, and with the
    evaluation's stamp where others are called so, too; what is still alike is numbered, as cars of a grid are.

    Args:
        ghosts: In the order they were asked for; of the fastest lap there is none where nobody drove one.
        asked: As the job's payload has them.
    """
    there = [one for one in asked if len(ghosts) == len(asked) or not isinstance(one, str)]
    stamps = [one.get("evaluation", "") if isinstance(one, dict) else "" for one in there]
    names = [
        one["model"] if isinstance(one, dict) and "evaluation" in one else ghost.name
        for ghost, one in zip(ghosts, there, strict=True)
    ]
    told: list[str] = []
    for name, stamp in zip(names, stamps, strict=True):
        own = f"{name} {stamp}" if stamp and names.count(name) > 1 else name
        number, label = 2, own
        while label in told:
            label, number = f"{own}-{number}", number + 1
        told.append(label)
    return [replace(ghost, name=name) for ghost, name in zip(ghosts, told, strict=True)]


def write_beside(
    ghosts: Sequence[Ghost], recordings: Sequence[Recording], *, folder: Path, first: int = 0, trial: int = 0
) -> None:
    """Keep where the ghosts of a film were.

    Args:
        ghosts: As its film has them.
        recordings: Of all its cars.
        folder: Of the heat or entry.
        first: Number of the car that the film is about, with whose laps the fastest lap starts anew.
        trial: That is filmed, from 0.
    """
    longest = max(recordings, key=len)
    told = [
        {
            "name": ghost.name,
            "is_lap": ghost.is_lap,
            "trace": [_whole(view) for view in ghost.beside(recordings[first] if ghost.is_lap else longest)],
        }
        for ghost in ghosts
    ]
    write_file(
        folder / BESIDE, json.dumps({"trial": trial, "ghosts": told}, separators=(",", ":")).encode(), durable=False
    )


def read_beside(folder: Path, *, trial: int = 0) -> list[ReplayGhost]:
    """Where the ghosts of a trial were; none of one that was not filmed, and in folders from before that was kept.

    Raises:
        ConfigError: The file is damaged.
    """
    path = folder / BESIDE
    if not path.is_file():
        return []
    from racecraft.serve.races.schemas import ReplayGhost  # as above

    document = read_json_object(path, max_bytes=MAX_BESIDE)
    try:
        return [ReplayGhost(**ghost) for ghost in document["ghosts"]] if document.get("trial", 0) == trial else []
    except (KeyError, TypeError, ValueError) as error:
        raise ConfigError("ghosts.json is damaged.", hint="Start it again.") from error


def _whole(view: CarView | None) -> list[int]:
    """Pose of a car in mm and mrad; nothing of one that is not there."""
    return [] if view is None else [round(1000 * value) for value in (view.x, view.y, view.heading)]
