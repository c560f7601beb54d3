"""What is submitted to a league's races, and what becomes of it.

    file ──submit──▶ looked at, refused with a sentence, or: submission + job (kind judge) ──▶ score ──▶ board

Until a race is over nothing is shown that tells where it starts.
"""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Final

import sqlalchemy as sa
from sqlalchemy.exc import IntegrityError
from sqlalchemy.orm import Session

from racecraft.errors import RunError
from racecraft.race.entry_file import read_entry_file
from racecraft.serve.jobs.queue import KINDS, ORGANISER, kinds_of, new_job
from racecraft.serve.jobs.turns import waiting_line
from racecraft.serve.people.keys import hold_account
from racecraft.serve.problems import Conflict, NotFound
from racecraft.serve.races.races import hold, is_withheld, state_of
from racecraft.serve.races.standings import trial_scores
from racecraft.serve.store.database import Database
from racecraft.serve.store.tables import Job, Race, Submission, User, now
from racecraft.serve.submissions.admission import KIND, require_place, require_room
from racecraft.serve.submissions.copies import accept
from racecraft.serve.submissions.infos import pace, submission_info, told_of, whose
from racecraft.serve.submissions.judge import ENTRY
from racecraft.serve.submissions.league import League, seen
from racecraft.serve.submissions.moderation import rename_model
from racecraft.serve.submissions.schemas import SubmissionInfo
from racecraft.serve.submissions.tasks import REPLAY, submission_folder
from racecraft.serve.tracks.courses import Courses

MAX_LISTED: Final = 1000  # submissions at once


class Entries:
    """The submissions to the races of all groups.

    Args:
        database: Where they are.
        state: The server's own folder.
        courses: Of somebody: a race may be on its maker's own track.
        league: Knows who may see a race, and who organises it.
    """

    def __init__(self, database: Database, state: Path, courses: Callable[[int], Courses], league: League) -> None:
        self._database, self._state, self._courses, self._league = database, state, courses, league

    def submit(self, race_id: int, data: bytes, *, model: str, user_id: int) -> int:
        """Take in a file and have it judged; the same one again is the submission that it was. Its number.

        Raises:
            NotFound: There is no such race to enter.
            Conflict: It is not open, somebody else has sent the very same, or too many wait.
            RacecraftError: The file is not what it has to be.
        """
        self._league.get(race_id, user_id, member=True)
        job = new_job(KIND, "", {}, user_id=user_id)
        folder = submission_folder(self._state, job.id)
        with _kept(folder, data):
            digest = read_entry_file(folder / ENTRY).digest
            submission, earlier = self._enter(race_id, digest, job, model=model, user_id=user_id)
        superseded = earlier if submission.job_id == job.id else job.id
        if superseded:
            shutil.rmtree(submission_folder(self._state, superseded), ignore_errors=True)
        return submission.id

    def _enter(self, race_id: int, digest: str, job: Job, *, model: str, user_id: int) -> tuple[Submission, str]:
        """The submission, and the job that it had before, if it failed."""
        try:
            with self._database.transaction() as session:
                hold(session, race_id)  # two at the same moment count each other
                hold_account(session, user_id)  # and what comes while somebody goes does so before them, or not at all
                race, _, part = seen(session, race_id, user_id)
                if part == "spectator":
                    raise NotFound(f"There is no race {race_id} of a group that you are in.")
                if (state := state_of(race)) != "open":
                    raise Conflict(f"The race is {'not open yet' if state == 'upcoming' else 'over'}.")
                is_it = sa.and_(Submission.race_id == race_id, Submission.digest == digest)
                known = session.scalars(sa.select(Submission).where(is_it)).first()
                if known is not None and known.user_id != user_id:
                    raise Conflict("Somebody has entered exactly this model already.", hint="Train it on.")
                if known is not None and session.get_one(Job, known.job_id).state not in ("failed", "cancelled"):
                    return known, ""
                require_room(session, race, user_id)
                require_place(session, race, user_id)
                track = self._courses(race.owner_id).path_or_name(race.track)
                job.payload = {"track": track, "name": model}
                session.add(job)
                session.flush()
                if known is not None:  # its job failed, which costs no attempt; this one is of today
                    earlier = known.job_id
                    known.job_id, known.created = job.id, now()
                    known.model = known.model if known.is_moderated else model
                    job.payload = {"track": track, "name": known.model}
                    return known, earlier
                fresh = Submission(race_id=race_id, user_id=user_id, job_id=job.id, digest=digest, model=model)
                session.add(fresh)
                session.flush()
                return fresh, ""
        except IntegrityError as error:  # the same file twice at the same moment
            raise Conflict("Exactly this model is being entered already.") from error

    def submissions(
        self, race_id: int, *, user_id: int, everybody: bool = False, only: int | None = None
    ) -> list[SubmissionInfo]:
        """Somebody's submissions, newest first; for an organiser everybody's; `only` that of a number.

        Raises:
            NotFound: The race is not theirs to see.
        """
        self._league.get(race_id, user_id, organiser=everybody, member=True)
        with self._database.transaction() as session:
            race = session.get_one(Race, race_id)
            query = told_of().where(Submission.race_id == race_id)
            if not everybody:
                query = query.where(Submission.user_id == user_id)
            if only is not None:
                query = query.where(Submission.id == only)
            rows = session.execute(query.order_by(Submission.id.desc()).limit(MAX_LISTED)).all()
            likes = whose(session, rows) if everybody else {}
            took = pace(session, KIND)
            line = waiting_line(session, kinds_of(KINDS[KIND].slot), self._database.moment(session))
        # jobs that have the places which a waiting one needs, or come first
        ahead = {job.id: place for place, job in enumerate(line) if job.state == "queued"}
        return [
            submission_info(
                row, ahead=ahead.get(row.Job.id, 0), pace=took, race=race, like=likes.get(row.Submission.id)
            )
            for row in rows
        ]

    def submission(self, race_id: int, submission_id: int, *, user_id: int) -> SubmissionInfo:
        """One's own submission.

        Raises:
            NotFound: There is none of this number.
        """
        found = self.submissions(race_id, user_id=user_id, only=submission_id)
        if not found:
            raise NotFound(f"You have no submission {submission_id} in this race.")
        return found[0]

    def disqualify(self, race_id: int, submission_id: int, reason: str, *, user_id: int) -> None:
        """A submission does not count, for a reason; with an empty one it does again.

        Raises:
            NotFound: They do not organise the race, or it has no such submission.
            Conflict: Who entered it has deleted their account.
        """
        self._league.get(race_id, user_id, organiser=True)
        with self._database.transaction() as session:
            found = _submission(session, race_id, submission_id)
            hold_account(session, found.user_id)  # or what is restored while they go stands without them
            if session.get_one(User, found.user_id).deleted is not None:
                raise Conflict("Who entered this has deleted their account: it stays out.")
            found.disqualified = reason.strip()
            if not reason:
                accept(session, submission_id)

    def accept(self, race_id: int, submission_id: int, *, user_id: int) -> None:
        """A submission that drives like somebody else's stands, as a person has looked at it.

        Raises:
            NotFound: They do not organise the race, or it has no such submission.
            Conflict: It drives like nobody else's.
        """
        self._league.get(race_id, user_id, organiser=True)
        with self._database.transaction() as session:
            _submission(session, race_id, submission_id)
            if not accept(session, submission_id):
                raise Conflict("It drives like nobody else's entry.")

    def rename_model(self, race_id: int, submission_id: int, model: str, *, user_id: int) -> None:
        """Call a submission otherwise, for good, if what its owner calls it will not do.

        Raises:
            NotFound: They do not organise the race, or it has no such submission.
            Conflict: It is not judged yet.
        """
        self._league.get(race_id, user_id, organiser=True)
        with self._database.transaction() as session:
            hold(session, race_id)  # who has it judged again meanwhile would give it its old name back
            rename_model(session, self._state, _submission(session, race_id, submission_id), model)

    def judge_again(self, race_id: int, submission_id: int, *, user_id: int) -> None:
        """Have a submission driven once more, which its racer cannot cancel; it is off the board until that is done.

        Raises:
            NotFound: They do not organise the race, or it has no such submission.
            Conflict: It waits or is driven already, or its file is gone.
            RunError: There is no room for a copy of it.
        """
        self._league.get(race_id, user_id, organiser=True)
        with self._database.transaction() as session:
            hold(session, race_id)  # of two at the same moment the second finds that it waits
            submission = _submission(session, race_id, submission_id)
            old = session.get_one(Job, submission.job_id)
            source = submission_folder(self._state, old.id) / ENTRY
            if old.state in ("queued", "running"):
                raise Conflict("It is not judged yet.")
            if not source.is_file():
                raise Conflict("Its file is gone.")
            job = new_job(KIND, "", {**old.payload, ORGANISER: user_id}, user_id=submission.user_id)
            with _kept(submission_folder(self._state, job.id), source.read_bytes()):
                session.add(job)
                session.flush()
                submission.job_id, submission.judged = job.id, None
                session.flush()
        shutil.rmtree(submission_folder(self._state, old.id), ignore_errors=True)

    def forget(self, user_id: int) -> None:
        """Remove the files of somebody's submissions, weights and replays, in all races."""
        query = sa.select(Submission.job_id).where(Submission.user_id == user_id)
        with self._database.transaction() as session:
            jobs = session.scalars(query).all()
        for job in jobs:
            shutil.rmtree(submission_folder(self._state, job), ignore_errors=True)

    def replay(self, race_id: int, submission_id: int, *, user_id: int | None) -> Path:
        """The replay file of a judged submission, once the race is over: it has every action.

        Raises:
            NotFound: There is none, or the race is not theirs to see.
            Conflict: The race is not over.
        """
        path, is_over = self.driven(race_id, submission_id, user_id=user_id)
        if not is_over:
            raise Conflict("Replays are published when the race is over; until then there is the film.")
        if not path.is_file():
            raise NotFound(f"Submission {submission_id} has no replay.")
        return path

    def driven(self, race_id: int, submission_id: int, *, user_id: int | None) -> tuple[Path, bool]:
        """Where it lies unless it is gone, also of a race whose starts everybody knows, and whether the race is over.

        Raises:
            NotFound: The race has no judged submission of that number, or the race is not theirs to see.
            Conflict: The race is not over and has a secret.
        """
        with self._database.transaction() as session:
            race, _, _ = seen(session, race_id, user_id)
            submission = session.get(Submission, submission_id)
        if submission is None or submission.race_id != race_id or submission.judged is None:
            raise NotFound(f"There is no judged submission {submission_id} in this race.")
        if is_withheld(race):
            raise Conflict("What was driven in this race is shown when it is over: it tells where it starts.")
        return submission_folder(self._state, submission.job_id) / REPLAY, state_of(race) == "closed"

    def names(self, submissions: list[int]) -> dict[int, str]:
        """Whose submissions they are."""
        query = sa.select(Submission.id, User.name).join(User, User.id == Submission.user_id)
        with self._database.transaction() as session:
            return {row[0]: row[1] for row in session.execute(query.where(Submission.id.in_(submissions)))}

    def counted_trial(self, submission_id: int) -> int:
        """The trial that a judged submission is ranked by; the first where it has no score."""
        query = sa.select(Submission, Job, Race).join(Job, Job.id == Submission.job_id)
        query = query.join(Race, Race.id == Submission.race_id).where(Submission.id == submission_id)
        with self._database.transaction() as session:
            submission, job, race = session.execute(query).one()
        if submission.score_ms is None:
            return 0
        away = [abs(score - submission.score_ms / 1000) for score in trial_scores(race, job)]
        return away.index(min(away))


def _submission(session: Session, race_id: int, submission_id: int) -> Submission:
    """That of a number.

    Raises:
        NotFound: The race has none.
    """
    submission = session.get(Submission, submission_id)
    if submission is None or submission.race_id != race_id:
        raise NotFound(f"There is no submission {submission_id} in this race.")
    return submission


@contextmanager
def _kept(folder: Path, data: bytes) -> Iterator[None]:
    """A folder with what was sent, of which a crash leaves no half; gone again if the block fails.

    Raises:
        RunError: It cannot be written.
    """
    try:
        folder.mkdir(parents=True)
        with (folder / ENTRY).open("xb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        yield
    except OSError as error:
        shutil.rmtree(folder, ignore_errors=True)
        raise RunError(f"The file cannot be kept: {error.strerror or error}.") from error
    except BaseException:
        shutil.rmtree(folder, ignore_errors=True)
        raise
