"""The models of a console: run folders, what people say about them, and summaries made when a folder changed."""

from __future__ import annotations

import itertools
import math
import os
import re
import shutil
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from datetime import datetime
from pathlib import Path
from typing import Any, Final, Literal

import sqlalchemy as sa
from sqlalchemy.dialects import sqlite
from sqlalchemy.orm import Session

from racecraft.checks import is_number
from racecraft.errors import RacecraftError, RunError
from racecraft.limits import known_limit
from racecraft.run import RunFolder, RunInfo, Stretch, best_of, judged_laps, list_runs, read_stretches, stretch_at
from racecraft.run.history import read_history
from racecraft.serve.models.names import free_name
from racecraft.serve.models.schemas import Checkpoint, ModelCard, TrainingStretch
from racecraft.serve.problems import Conflict, NotFound
from racecraft.serve.settings import OWNER
from racecraft.serve.store.database import Database
from racecraft.serve.store.tables import Comment, Entry, Job, Model, now
from racecraft.sim.objects import RACE_TYPES, Objects
from racecraft.sim.vehicle import Vehicle
from racecraft.track import load_track, single_names

RACED: Final = "head-to-head"
"""The race of a training among other policies, which no race of models is called."""
TRASH: Final = "trash"  # inside the state folder
REMOVED: Final = 20  # models that a racer's trash keeps; the owner's keeps all
PICTURE: Final = "racing-line.png"
NEWEST: Final = 20  # evaluations that are looked into; older ones are counted
SETTLED: Final = 600.0  # s after which an evaluation without a result is taken to have been killed
SUMMARY: Final = "6"
"""Changes with what a summary says, so that those kept by an earlier version are made anew."""
Status = Literal["training", "queued", "stopped", "finished", "failed", "new"]
_NAME: Final = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]{0,63}")


class Garage:
    """Finds, describes, renames and removes models.

    Args:
        runs: Folder of the run folders.
        state: The console's own folder.
        database: Tags, summaries and jobs.
        user_id: Whose models they are.
    """

    def __init__(self, runs: Path, state: Path, database: Database, *, user_id: int = OWNER) -> None:
        self._runs, self._trash, self._database, self._user_id = runs, state / TRASH, database, user_id
        self._naming, self._given = threading.Lock(), set[str]()

    @property
    def runs(self) -> Path:
        """Folder of the run folders."""
        return self._runs

    def folder(self, name: str) -> RunFolder:
        """A model's run folder.

        Raises:
            NotFound: There is none of this name; paths are no names.
        """
        if _NAME.fullmatch(name) and (self._runs / name / "run.json").is_file():
            return RunFolder(self._runs / name)
        raise NotFound(f"There is no model {name[:80]!r}.")

    def is_foreign(self, reward: str) -> bool:
        """Whether this text comes from somebody else than who runs the server.

        All of a guest's do; of the owner's, those that are to the letter the reward function of a model that came from
        elsewhere.
        """
        if self._user_id != OWNER:
            return True
        for folder in list_runs(self._runs):
            with suppress(RacecraftError):
                if folder.read_info().foreign and folder.read_reward_function() == reward:
                    return True
        return False

    def cards(self) -> list[ModelCard]:
        """All models, newest first."""
        return sorted(self._cards(list_runs(self._runs)), key=lambda card: (card.created, card.name), reverse=True)

    def card(self, name: str) -> ModelCard:
        """One model."""
        for card in self._cards([self.folder(name)]):
            return card
        raise NotFound(f"Model {name!r} cannot be read: its run.json is damaged.")

    def _cards(self, folders: list[RunFolder]) -> list[ModelCard]:
        """Cards of these folders; what changed is read while nobody waits for the database."""
        only = [folders[0].name] if len(folders) == 1 else None
        with self._database.transaction() as session:
            known = {
                row.name: (row.fingerprint, row.summary, row.deleted is not None) for row in self._rows(session, only)
            }
        renewed: dict[str, tuple[str, dict[str, Any]]] = {}
        for folder in folders:
            mark = _fingerprint(folder)
            if known.get(folder.name, ("", {}, True))[::2] != (mark, False):
                summary, is_settled = _summary(folder)
                renewed[folder.name] = (mark if is_settled else "", summary)
        with self._database.transaction() as session:
            if fresh := [name for name in renewed if name not in known]:
                session.execute(_insert(session), [{"name": name, "owner_id": self._user_id} for name in fresh])
            for name, (mark, summary) in renewed.items():
                change: dict[str, Any] = {"fingerprint": mark, "summary": summary}
                if name in known and known[name][2]:  # a new one by the name of one in the trash
                    change |= {"deleted": None, "tags": []}
                session.execute(sa.update(Model).where(self._named(name)).values(change))
            tags = {row.name: (row.tags, row.summary) for row in self._rows(session, only)}
            trainings = self._latest_trainings(session, only)
        cards = []
        for name, (words, summary) in ((folder.name, tags[folder.name]) for folder in folders if folder.name in tags):
            if summary:
                shown = {key: value for key, value in summary.items() if key != "has_policy"}
                status = _status(*trainings.get(name, ("", "")), has_policy=summary["has_policy"])
                cards.append(ModelCard(name=name, tags=words, status=status, **shown))
        return cards

    def require_new(self, name: str) -> None:
        """Refuse a name that is taken.

        Raises:
            Conflict: There is something of that name.
        """
        if (self._runs / name).exists():
            raise Conflict(f"There is a model {name!r} already.", hint="Choose another name.")

    def new_name(self) -> str:
        """A name that nothing has or had, the trash included; it is given to nobody else while the server runs."""
        with self._naming, self._database.transaction() as session:
            taken = {*(row.name for row in self._rows(session, None)), *self._given}
            taken |= {entry.name for entry in self._runs.iterdir()} if self._runs.is_dir() else set()
            self._given.add(name := free_name(taken))
        return name

    def name_beside(self, name: str) -> str:
        """A name for a copy of a model that nothing has yet: the same with a number from 2 on."""
        names = (f"{name[:58]}-{number}" for number in itertools.count(2))
        return next(one for one in names if not (self._runs / one).exists())

    def require_checkpoint(self, name: str, choice: str | int) -> None:
        """Refuse a model that cannot race with a checkpoint.

        Args:
            name: Of the model.
            choice: ``best``, ``last`` or a number of camera steps.

        Raises:
            NotFound: There is no such model.
            Conflict: It has no such checkpoint.
        """
        steps = [entry.step for entry in self.folder(name).checkpoints.entries()]
        if not steps:
            raise Conflict(f"Model {name!r} has no checkpoint to race with.", hint="Train it first.")
        if isinstance(choice, int) and choice not in steps:
            raise Conflict(
                f"Model {name!r} has no checkpoint at step {choice}; it has {', '.join(map(str, steps))}.",
                hint="Choose one of those, best or last.",
            )

    def checkpoints(self, folder: RunFolder) -> list[Checkpoint]:
        """The states of a model's policy that are kept."""
        store, stretches = folder.checkpoints, read_stretches(folder)
        best = store.best
        return [
            Checkpoint(
                step=entry.step,
                stretch=stretch_at(stretches, entry.step).number,
                is_best=best is not None and entry.step == best.step,
                completion=entry.metrics.get("completion"),
                best_lap=entry.metrics.get("best_lap_s"),
            )
            for entry in store.entries()
        ]

    def stretches(self, folder: RunFolder) -> list[TrainingStretch]:
        """What a model learned with, part by part, and how well each drove."""
        stretches, judged = read_stretches(folder), judged_laps(folder)
        found = []
        for place, stretch in enumerate(stretches):
            own = [one for one in judged if stretch_at(stretches, one.step) is stretch]
            fastest = best_of(own)
            found.append(
                TrainingStretch(
                    number=stretch.number,
                    step=stretch.step,
                    began=datetime.fromisoformat(stretch.began),
                    changes=stretch.changes(stretches[place - 1]) if place else [],
                    reward=stretch.reward_function,
                    settings=learned_with(stretch),
                    best_lap=fastest.best_lap if fastest is not None else None,
                    completion=max((one.completion for one in own if one.completion is not None), default=None),
                    evaluations=len(own),
                )
            )
        return found

    def tag(self, name: str, tags: list[str]) -> None:
        """Replace a model's tags."""
        self.card(name)
        with self._database.transaction() as session:
            session.execute(sa.update(Model).where(self._named(name)).values(tags=list(dict.fromkeys(tags))))

    def rename(self, old: str, new: str) -> None:
        """Give a model another name.

        Raises:
            Conflict: The name is taken, or the model is in use.
        """
        folder = self.folder(old)
        self.require_new(new)
        with self._free(folder):
            folder.path.rename(self._runs / new)
        with self._database.transaction() as session:
            session.execute(sa.delete(Model).where(self._named(new)))
            session.execute(sa.update(Model).where(self._named(old)).values(name=new))
            about_it = sa.and_(Comment.owner_id == self._user_id, Comment.model == old)
            session.execute(sa.update(Comment).where(about_it).values(model=new))
            for table in (Job, Entry):
                of_it = sa.and_(table.user_id == self._user_id, table.run == old)
                session.execute(sa.update(table).where(of_it).values(run=new))

    def remove(self, name: str) -> None:
        """Put a model into the trash, from where `restore` brings it back; of a racer's the oldest there is forgotten.

        Raises:
            Conflict: It is in use.
        """
        folder = self.folder(name)
        with self._free(folder):
            self._trash.mkdir(parents=True, exist_ok=True)
            shutil.rmtree(self._trash / name, ignore_errors=True)
            folder.path.rename(self._trash / name)
            os.utime(self._trash / name)
            if self._user_id != OWNER:  # a disk is filled by removing as well as by keeping
                for path in sorted(self._trash.iterdir(), key=lambda path: path.stat().st_mtime)[:-REMOVED]:
                    shutil.rmtree(path, ignore_errors=True)
        with self._database.transaction() as session:
            session.execute(sa.update(Model).where(self._named(name)).values(deleted=now()))

    def restore(self, name: str) -> None:
        """Bring a removed model back.

        Raises:
            NotFound: It is not in the trash.
            Conflict: There is another of that name by now.
        """
        if not _NAME.fullmatch(name) or not (self._trash / name / "run.json").is_file():
            raise NotFound(f"There is no model {name[:80]!r} in the trash.")
        if (self._runs / name).exists():
            raise Conflict(f"There is a model {name!r} again.", hint="Rename that one first.")
        (self._trash / name).rename(self._runs / name)
        with self._database.transaction() as session:
            session.execute(sa.update(Model).where(self._named(name)).values(deleted=None))

    def _named(self, name: str) -> sa.ColumnElement[bool]:
        return sa.and_(Model.owner_id == self._user_id, Model.name == name)

    def _rows(self, session: Session, only: list[str] | None) -> list[Model]:
        query = sa.select(Model).where(Model.owner_id == self._user_id)
        return list(session.scalars(query if only is None else query.where(Model.name.in_(only))))

    def _latest_trainings(self, session: Session, only: list[str] | None) -> dict[str, tuple[str, str]]:
        """State and reason of the end of each run's newest training."""
        query = sa.select(Job.run, Job.state, Job.result)  # whole: a database fails at all for one that holds NaN
        query = query.where(Job.kind == "train", Job.user_id == self._user_id)
        if only is not None:
            query = query.where(Job.run.in_(only))
        rows = session.execute(query.order_by(Job.created))
        return {run: (state, str((result or {}).get("reason") or "")) for run, state, result in rows}

    @contextmanager
    def _free(self, folder: RunFolder) -> Iterator[None]:
        """Hold the run's lock; Conflict when it is in use, or soon will be."""
        with self._database.transaction() as session:
            is_its = sa.and_(Job.user_id == self._user_id, Job.run == folder.name)
            waiting = sa.select(Job.kind).where(is_its, Job.state.in_(("queued", "running")))
            kind = session.scalar(waiting.limit(1))
        if kind is not None:
            hint = "Stop it first." if kind in ("train", "tune") else "Wait until it has ended."
            raise Conflict(f"Model {folder.name!r} is in use: there is a job of kind {kind!r}.", hint=hint)
        with ExitStack() as stack:
            try:
                stack.enter_context(folder.lock())
            except RunError as error:
                raise Conflict(str(error), hint="Stop its training first.") from error
            yield


def learned_with(stretch: Stretch) -> dict[str, Any]:
    """The settings of a stretch as one document; what JSON cannot say becomes null."""
    document: dict[str, Any] = finite(
        {
            "track": Path(stretch.track).stem,
            **stretch.settings,
            "model_metadata": stretch.model_metadata,
            "hyperparameters": stretch.hyperparameters,
        }
    )
    return document


def finite(value: Any) -> Any:
    """A document whose numbers JSON can say."""
    if isinstance(value, dict):
        return {name: finite(item) for name, item in value.items()}
    if isinstance(value, list):
        return [finite(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def race_of(info: RunInfo) -> str:
    """The type of race that a model is trained for."""
    if info.settings.get("opponents") is not None:
        return RACED
    try:
        return Objects.from_dict(info.settings["objects"]).race_type
    except (RacecraftError, KeyError, TypeError, AttributeError):
        return RACE_TYPES[0]


def _fingerprint(folder: RunFolder) -> str:
    """Changes when a card may change: the settings, the checkpoints, an evaluation, how long it was trained."""
    marks = [SUMMARY]
    for path in (folder.path, folder.path / "run.json", folder.path / "checkpoints", folder.history):
        try:
            marks.append(str(path.stat().st_mtime_ns))
        except OSError:
            marks.append("-")
    return " ".join(marks)


def _summary(folder: RunFolder) -> tuple[dict[str, Any], bool]:
    """What a card shows, as JSON, empty for a folder that cannot be read; and whether it will stay so for now."""
    try:
        info = folder.read_info()
        best, last = folder.checkpoints.best, folder.checkpoints.last
        fastest = best_of(judged_laps(folder))
        created = datetime.fromisoformat(info.created).isoformat()
        tracks = _tracks(info.track)
    except (RacecraftError, ValueError, TypeError):
        return {}, True
    raced, picture, is_settled = _evaluations(folder, fastest.stamp if fastest is not None else None)
    metrics = best.metrics if best is not None else {}
    return {
        "track": tracks[0],
        "num_tracks": len(tracks),
        "race": race_of(info),
        "created": created,
        "has_policy": last is not None,  # weights from elsewhere have no steps
        "steps": last.step if last is not None else 0,
        "seconds": _seconds(folder),
        "completion": metrics.get("completion"),
        "best_lap": fastest.best_lap if fastest is not None else None,
        "medals": _medals(info) if len(tracks) == 1 else None,
        "evaluations": raced,
        "picture": picture,
        "until": str(info.settings.get("until", "")),
    }, is_settled


def _medals(info: RunInfo) -> dict[str, float] | None:
    """The times of the medals on a model's road, where that and its car are known."""
    with suppress(RacecraftError, KeyError, TypeError):
        track, vehicle = load_track(info.track), Vehicle(**info.settings["vehicle"])
        is_reverse = info.settings.get("direction") == "reverse"
        limit = known_limit(track.reversed() if is_reverse else track, vehicle)
        return None if limit is None else vars(limit.medals)
    return None


def _tracks(named: str) -> list[str]:
    """By their names; a folder of tracks that is gone is one that nobody knows."""
    try:
        return single_names(named)
    except RacecraftError:
        return [Path(named).stem]


def _evaluations(folder: RunFolder, fastest: str | None) -> tuple[int, str | None, bool]:
    """How many evaluations there are, the picture of the fastest, else of the newest, and whether none is under way.

    Looks at the newest only, and at the one of the best lap.
    """
    with os.scandir(folder.path) as entries:
        names = sorted((entry.name for entry in entries if entry.name.startswith("evaluation-")), reverse=True)
    newest = names[:NEWEST]
    raced = [name for name in newest if (folder.path / name / "evaluation.json").exists()]
    unfinished = set(newest).difference(raced)
    youngest = max(((folder.path / name).stat().st_mtime for name in unfinished), default=0.0)
    shown = [*([f"evaluation-{fastest}"] if fastest is not None else []), *raced]
    picture = next((f"{name}/{PICTURE}" for name in shown if (folder.path / name / PICTURE).is_file()), None)
    return len(names) - len(unfinished), picture, time.time() - youngest > SETTLED


def _seconds(folder: RunFolder) -> float:
    """How long a model was trained, from the end of its history."""
    try:
        size = folder.history.stat().st_size
    except OSError:
        return 0.0
    points, _ = read_history(folder.history, offset=max(0, size - 4096))
    known = (point for point in points if is_number(point.get("seconds")))  # an archive's may say anything
    return max((float(point["seconds"]) for point in known), default=0.0)


_FRESH: Final[dict[str, Any]] = {"tags": [], "fingerprint": "", "summary": {}}


def _insert(session: Session) -> sa.Insert:
    """New rows; two who look at the same time do not collide."""
    if session.get_bind().dialect.name == "postgresql":
        from sqlalchemy.dialects import postgresql  # takes its time to load, and most consoles do without

        return postgresql.insert(Model).values(**_FRESH).on_conflict_do_nothing()
    return sqlite.insert(Model).values(**_FRESH).on_conflict_do_nothing()


def _status(state: str, reason: str, *, has_policy: bool) -> Status:
    if state in ("queued", "running"):
        return "training" if state == "running" else "queued"
    if state == "failed":
        return "failed"
    if state == "cancelled" or reason == "interrupted":
        return "stopped"
    return "finished" if has_policy else "new"
