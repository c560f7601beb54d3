"""A league's race without a server: who may enter it, and a judge in this very process."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import sqlalchemy as sa

from racecraft.errors import RacecraftError
from racecraft.race.announcement import Announcement, draw_secret
from racecraft.race.conditions import Conditions
from racecraft.race.rules import RaceRules
from racecraft.serve.jobs.queue import JobQueue
from racecraft.serve.jobs.task import Task
from racecraft.serve.settings import STATE_FOLDER
from racecraft.serve.store.database import Database
from racecraft.serve.store.tables import Group, Member, Race, Submission, User
from racecraft.serve.submissions import judge, tasks
from racecraft.serve.submissions.bench import Bench
from racecraft.serve.submissions.entries import Entries
from racecraft.serve.submissions.league import League
from racecraft.serve.tracks.courses import Courses
from racecraft.track import load_track

ADA, RACE, OWNER = 2, 1, "this-worker"
RULES = RaceRules(laps=1, max_resets=1, time_limit=60.0, starts="lap")
Said = dict[str, Any]


class HereBench(Bench):
    """Judges in this process's own children, and lies where it is told to."""

    def __init__(self, lie: Callable[[Path, Said], object] = lambda *_: None) -> None:
        super().__init__()
        self._lie = lie

    def _answer(self, told: Said) -> Said:
        status, words = judge.judge(told)
        if status != judge.DROVE:
            return {"status": status, "said": words}
        said = json.loads(words)
        lied = self._lie(Path(told["results"]), said)
        return {"status": status, "said": lied if isinstance(lied, str) else json.dumps(said)}


def announced(rules: RaceRules = RULES, trials: int = 2) -> Announcement:
    conditions = Conditions(track=load_track("oval"), rules=rules)
    settings: dict[str, Any] = {"kind": "time-trial", "ranking": "total", "minimum_laps": 1}
    return Announcement.of(conditions, num_trials=trials, secret=draw_secret(), **settings)


class Court:
    """A race that Ada may enter once a day, and who judges her entries."""

    def __init__(self, root: Path) -> None:
        self.root = root
        self.database = Database(f"sqlite:///{root / 'console.db'}")
        self.database.migrate()
        self.queue = JobQueue(self.database)
        terms = announced()
        with self.database.transaction() as session:
            session.add(User(id=ADA, name="Ada", handle="ada"))
            session.add(Group(id=1, title="Class"))
            session.flush()
            session.add(Member(group_id=1, user_id=ADA, role="racer"))
            race = Race(id=RACE, owner_id=1, group_id=1, title="Cup", track="oval", ranking="total", trials=2)
            race.document, race.commitment, race.secret = dict(terms.document), terms.commitment, terms.secret
            race.rules, race.attempts_per_day = RULES.to_dict(), 1
            session.add(race)

        def courses(_: int) -> Courses:
            return Courses(root / "tracks")

        self.league = League(self.database, courses)
        self.entries = Entries(self.database, root / STATE_FOLDER, courses, self.league)

    def enter(self, data: bytes) -> Task:
        self.entries.submit(RACE, data, model="novice", user_id=ADA)
        return self.claim()

    def claim(self) -> Task:
        job = self.queue.claim(("judge",), owner=OWNER)
        assert job is not None
        return Task(
            job=job,
            runs=self.root,
            home=self.root,
            database=self.database,
            artifacts=None,
            on_stop=lambda _: None,
        )

    def end(self, task: Task, state: str, **outcome: Any) -> bool:
        return self.queue.finish(task.job.id, owner=OWNER, state=state, **outcome)

    def fail(self, task: Task) -> RacecraftError:
        """Judge something that does not count, as a worker does."""
        with pytest.raises(RacecraftError) as caught:
            tasks.judge(task)
        assert self.end(task, "failed", error={"code": type(caught.value).__name__, "message": str(caught.value)})
        return caught.value

    @property
    def on_board(self) -> int:
        _, board, _ = self.league.board(RACE, user_id=ADA, top=10)
        with self.database.transaction() as session:
            judged = session.scalar(sa.select(sa.func.count()).where(Submission.judged.is_not(None)))
        assert board.entrants == judged
        return board.entrants
