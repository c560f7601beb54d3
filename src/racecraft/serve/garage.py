"""The models of a console: run folders, what people say about them, and summaries made when a folder changed."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from datetime import datetime
from pathlib import Path
from typing import Any, Literal

import sqlalchemy as sa

from racecraft.errors import RacecraftError, RunError
from racecraft.run import RunFolder, list_runs
from racecraft.run.history import read_history
from racecraft.serve.database import Database
from racecraft.serve.problems import Conflict, NotFound
from racecraft.serve.schemas import Checkpoint, ModelCard
from racecraft.serve.tables import Job, Model, now

TRASH = "trash"  # inside the state folder
Status = Literal["training", "queued", "stopped", "finished", "failed", "new"]


class Garage:
    """Finds, describes, renames and removes models.

    Args:
        runs: Folder of the run folders.
        state: The console's own folder.
        database: Tags, summaries and jobs.
    """

    def __init__(self, runs: Path, state: Path, database: Database) -> None:
        self._runs, self._trash, self._database = runs, state / TRASH, database

    @property
    def runs(self) -> Path:
        """Folder of the run folders."""
        return self._runs

    def folder(self, name: str) -> RunFolder:
        """A model's run folder.

        Raises:
            NotFound: There is none of this name; paths are no names.
        """
        if name in {run.name for run in list_runs(self._runs)}:
            return RunFolder(self._runs / name)
        raise NotFound(f"There is no model {name[:80]!r}.")

    def cards(self) -> list[ModelCard]:
        """All models, newest first."""
        folders = list_runs(self._runs)
        with self._database.transaction() as session:
            rows = {row.name: row for row in session.scalars(sa.select(Model))}
            jobs = _latest_trainings(session)
            cards = []
            for folder in folders:
                row = rows.get(folder.name)
                if row is None:
                    row = Model(name=folder.name, owner_id=1, tags=[])
                    session.add(row)
                if (mark := _fingerprint(folder)) != row.fingerprint:
                    row.fingerprint, row.summary = mark, _summary(folder)
                if row.summary:
                    status = _status(jobs.get(folder.name), row.summary)
                    cards.append(ModelCard(name=folder.name, tags=row.tags, status=status, **row.summary))
        return sorted(cards, key=lambda card: (card.created, card.name), reverse=True)

    def card(self, name: str) -> ModelCard:
        """One model."""
        self.folder(name)
        for card in self.cards():
            if card.name == name:
                return card
        raise NotFound(f"Model {name!r} cannot be read: its run.json is damaged.")

    def checkpoints(self, folder: RunFolder) -> list[Checkpoint]:
        """The states of a model's policy that are kept."""
        store = folder.checkpoints
        best = store.best
        return [
            Checkpoint(
                step=entry.step,
                is_best=best is not None and entry.step == best.step,
                completion=entry.metrics.get("completion"),
                best_lap=entry.metrics.get("best_lap_s"),
            )
            for entry in store.entries()
        ]

    def tag(self, name: str, tags: list[str]) -> None:
        """Replace a model's tags."""
        self.card(name)
        with self._database.transaction() as session:
            session.execute(sa.update(Model).where(Model.name == name).values(tags=list(dict.fromkeys(tags))))

    def rename(self, old: str, new: str) -> None:
        """Give a model another name.

        Raises:
            Conflict: The name is taken, or the model is in use.
        """
        folder = self.folder(old)
        if (self._runs / new).exists():
            raise Conflict(f"There is a model {new!r} already.", hint="Choose another name.")
        with self._free(folder):
            folder.path.rename(self._runs / new)
        with self._database.transaction() as session:
            session.execute(sa.delete(Model).where(Model.name == new))
            session.execute(sa.update(Model).where(Model.name == old).values(name=new))
            session.execute(sa.update(Job).where(Job.run == old).values(run=new))

    def remove(self, name: str) -> None:
        """Put a model into the trash, from where `restore` brings it back.

        Raises:
            Conflict: It is in use.
        """
        folder = self.folder(name)
        with self._free(folder):
            self._trash.mkdir(parents=True, exist_ok=True)
            shutil.rmtree(self._trash / name, ignore_errors=True)
            folder.path.rename(self._trash / name)
        with self._database.transaction() as session:
            session.execute(sa.update(Model).where(Model.name == name).values(deleted=now()))

    def restore(self, name: str) -> None:
        """Bring a removed model back.

        Raises:
            NotFound: It is not in the trash.
            Conflict: There is another of that name by now.
        """
        if name not in {run.name for run in list_runs(self._trash)}:
            raise NotFound(f"There is no model {name[:80]!r} in the trash.")
        if (self._runs / name).exists():
            raise Conflict(f"There is a model {name!r} again.", hint="Rename that one first.")
        (self._trash / name).rename(self._runs / name)
        with self._database.transaction() as session:
            session.execute(sa.update(Model).where(Model.name == name).values(deleted=None))

    @contextmanager
    def _free(self, folder: RunFolder) -> Iterator[None]:
        """Hold the run's lock; Conflict when it is in use."""
        with ExitStack() as stack:
            try:
                stack.enter_context(folder.lock())
            except RunError as error:
                raise Conflict(str(error), hint="Stop its training first.") from error
            yield


def _fingerprint(folder: RunFolder) -> str:
    """Changes when a card may change: the settings, the checkpoints, an evaluation."""
    marks = []
    for path in (folder.path, folder.path / "run.json", folder.path / "checkpoints"):
        try:
            marks.append(str(path.stat().st_mtime_ns))
        except OSError:
            marks.append("-")
    return " ".join(marks)


def _summary(folder: RunFolder) -> dict[str, Any]:
    """What a card shows, as JSON; empty for a folder that cannot be read."""
    try:
        info = folder.read_info()
        best, last = folder.checkpoints.best, folder.checkpoints.last
    except RacecraftError:
        return {}
    evaluations = sorted(folder.path.glob("evaluation-*/evaluation.json"))
    pictures = sorted(folder.path.glob("evaluation-*/racing-line.png"))
    metrics = best.metrics if best is not None else {}
    return {
        "track": Path(info.track).stem,
        "created": datetime.fromisoformat(info.created).isoformat(),
        "steps": last.step if last is not None else 0,
        "seconds": _seconds(folder),
        "completion": metrics.get("completion"),
        "best_lap": metrics.get("best_lap_s"),
        "evaluations": len(evaluations),
        "picture": f"{pictures[-1].parent.name}/{pictures[-1].name}" if pictures else None,
        "until": str(info.settings.get("until", "")),
    }


def _seconds(folder: RunFolder) -> float:
    """How long a model was trained, from the end of its history."""
    try:
        size = folder.history.stat().st_size
    except OSError:
        return 0.0
    points, _ = read_history(folder.history, offset=max(0, size - 4096))
    return max((float(point.get("seconds") or 0.0) for point in points), default=0.0)


def _latest_trainings(session: Any) -> dict[str, Job]:
    """The newest training of each run."""
    query = sa.select(Job).where(Job.kind == "train").order_by(Job.created)
    return {job.run: job for job in session.scalars(query)}


def _status(job: Job | None, summary: dict[str, Any]) -> Status:
    if job is not None and job.state in ("queued", "running"):
        return "training" if job.state == "running" else "queued"
    if job is not None and job.state == "failed":
        return "failed"
    if job is not None and (job.state == "cancelled" or (job.result or {}).get("reason") == "interrupted"):
        return "stopped"
    return "finished" if summary["steps"] else "new"
