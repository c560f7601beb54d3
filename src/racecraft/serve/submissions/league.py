"""A league's races: who sees them, what is submitted, who is where.

    file ──submit──▶ looked at, refused with a sentence, or: submission + job (kind judge) ──▶ score ──▶ board

A race belongs to a group. Its members see it and submit, its organisers change it; where it is public everybody sees
the board. To all others it does not exist. Until it is over nothing is shown that tells where it starts.
"""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any, Final, Literal

import sqlalchemy as sa
from sqlalchemy.exc import IntegrityError
from sqlalchemy.orm import Session

from racecraft.contest.finals import FinalTerms
from racecraft.errors import ConfigError, RacecraftError, RunError
from racecraft.limits import Medals
from racecraft.limits.limit import known_limit
from racecraft.race.announcement import Announcement
from racecraft.race.entry_file import read_entry_file
from racecraft.serve.jobs.queue import KINDS, ORGANISER, kinds_of, new_job
from racecraft.serve.jobs.turns import waiting_line
from racecraft.serve.problems import Conflict, NotFound
from racecraft.serve.races.races import announcement_of, hold, is_withheld, state_of
from racecraft.serve.races.standings import trial_scores
from racecraft.serve.store.database import Database
from racecraft.serve.store.tables import Group, Job, Member, Race, Submission, User, now
from racecraft.serve.submissions.admission import KIND, require_place, require_room
from racecraft.serve.submissions.board import NONE, Board
from racecraft.serve.submissions.copies import accept
from racecraft.serve.submissions.finalists import board_of, published_final
from racecraft.serve.submissions.infos import pace, submission_info, told_of, whose
from racecraft.serve.submissions.judge import ENTRY
from racecraft.serve.submissions.moderation import rename_model
from racecraft.serve.submissions.schemas import LeagueRace, LeagueRaceChange, NewLeagueRace, Stage, SubmissionInfo
from racecraft.serve.submissions.stages import announced_final, final_of, let_follow, require_alone
from racecraft.serve.submissions.tasks import REPLAY, submission_folder
from racecraft.serve.tracks.courses import Courses
from racecraft.sim.vehicle import load_vehicle
from racecraft.track import Track

Part = Literal["organiser", "racer", "spectator"]
MAX_LISTED: Final = 1000  # submissions at once
PUBLISHED: Final = ("submission", "name", "model", "place", "score_ms", "best_lap_ms", "resets", "completion")
"""Of each row of the board of a race that is over."""


class League:
    """The races of all groups.

    Args:
        database: Where they are.
        state: The server's own folder.
        courses: Of somebody: a race may be on its maker's own track.
    """

    def __init__(self, database: Database, state: Path, courses: Callable[[int], Courses]) -> None:
        self._database, self._state, self._courses = database, state, courses

    def races(self, user_id: int) -> list[LeagueRace]:
        """The races of somebody's groups, newest first."""
        query = sa.select(Race, Group.title, Member.role).join(Group, Group.id == Race.group_id)
        query = query.join(Member, sa.and_(Member.group_id == Race.group_id, Member.user_id == user_id))
        with self._database.transaction() as session:
            rows = session.execute(query.where(Race.deleted.is_(None)).order_by(Race.id.desc())).all()
        return [_info(race, title, "organiser" if role == "organiser" else "racer") for race, title, role in rows]

    def get(self, race_id: int, user_id: int | None, *, organiser: bool = False, member: bool = False) -> LeagueRace:
        """A race.

        Args:
            race_id: Of the race.
            user_id: Who asks; None for somebody without an account.
            organiser: Whether only its organisers may.
            member: Whether only members of its group may.

        Raises:
            NotFound: There is none, or it is not theirs to see.
        """
        with self._database.transaction() as session:
            race, title, part = self._seen(session, race_id, user_id)
        if (organiser and part != "organiser") or (member and part == "spectator"):
            raise NotFound(f"There is no race {race_id} of {'yours' if organiser else 'a group that you are in'}.")
        return _info(race, title, part)

    def announce(self, request: NewLeagueRace, group_id: int) -> FinalTerms | None:
        """What is announced of a group's new race, if two meet at a time in it.

        Raises:
            NotFound: The group has no such race to follow.
            ConfigError: The final is none that can be.
        """
        with self._database.transaction() as session:
            return announced_final(session, request, group_id)

    def begin(self, race_id: int, request: NewLeagueRace) -> None:
        """Let a race that was just made follow the one that it was announced with."""
        if request.after is not None:
            with self._database.transaction() as session:
                let_follow(session, race_id, request.after, best=request.best)

    def change(self, race_id: int, request: LeagueRaceChange, *, user_id: int) -> None:
        """Another title, description, end or audience.

        Raises:
            NotFound: They do not organise it.
            Conflict: It is over and cannot be opened again: everybody knows its secret.
        """
        self.get(race_id, user_id, organiser=True)
        with self._database.transaction() as session:
            race = session.get_one(Race, race_id)
            if "closes" in request.model_fields_set and state_of(race) == "closed":
                raise Conflict("The race is over: everybody knows its secret.", hint="Make another one.")
            if "closes" in request.model_fields_set and final_of(race) is not None:
                raise Conflict("A final in which two meet at a time ends when it has been driven.")
            if "closes" in request.model_fields_set:
                race.closes = request.closes
            race.title = request.title.strip() if request.title is not None else race.title
            race.description = request.description.strip() if request.description is not None else race.description
            if request.attempts_per_day is not None:
                race.attempts_per_day = request.attempts_per_day
            if request.is_frozen is not None:
                race.is_frozen = request.is_frozen
            if request.is_public is not None:
                race.visibility = "public" if request.is_public else "private"
            if race.closes is not None and race.closes <= race.opens:
                raise ConfigError("The race closes before it opens.", hint="Choose a later end, or none.")

    def remove(self, race_id: int, *, user_id: int) -> None:
        """Put a race away.

        Raises:
            NotFound: They do not organise it.
            Conflict: Another race takes its drivers from it and would be closed for ever.
        """
        self.get(race_id, user_id, organiser=True)
        with self._database.transaction() as session:
            follows = sa.select(Race.title).where(Race.after_id == race_id, Race.deleted.is_(None))
            if (final := session.scalar(follows.limit(1))) is not None:
                raise Conflict(f"{final!r} takes its drivers from this race.", hint="Let it follow no race first.")
            session.get_one(Race, race_id).deleted = now()

    def submit(self, race_id: int, data: bytes, *, model: str, user_id: int) -> int:
        """Take in a file and have it judged; the same one again is the submission that it was. Its number.

        Raises:
            NotFound: There is no such race to enter.
            Conflict: It is not open, somebody else has sent the very same, or too many wait.
            RacecraftError: The file is not what it has to be.
        """
        self.get(race_id, user_id, member=True)
        job = new_job(KIND, "", {}, user_id=user_id)
        folder = submission_folder(self._state, job.id)
        try:
            folder.mkdir(parents=True)
            _write(folder / ENTRY, data)
            digest = read_entry_file(folder / ENTRY).digest
            submission, earlier = self._enter(race_id, digest, job, model=model, user_id=user_id)
        except OSError as error:
            shutil.rmtree(folder, ignore_errors=True)
            raise RunError(f"The file cannot be kept: {error.strerror or error}.") from error
        except BaseException:
            shutil.rmtree(folder, ignore_errors=True)
            raise
        superseded = earlier if submission.job_id == job.id else job.id
        if superseded:
            shutil.rmtree(submission_folder(self._state, superseded), ignore_errors=True)
        return submission.id

    def _enter(self, race_id: int, digest: str, job: Job, *, model: str, user_id: int) -> tuple[Submission, str]:
        """The submission, and the job that it had before, if it failed."""
        try:
            with self._database.transaction() as session:
                hold(session, race_id)  # two at the same moment count each other
                race = session.get_one(Race, race_id)
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
        self.get(race_id, user_id, organiser=everybody, member=True)
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
        """
        self.get(race_id, user_id, organiser=True)
        is_it = sa.and_(Submission.id == submission_id, Submission.race_id == race_id)
        with self._database.transaction() as session:
            changed = session.execute(sa.update(Submission).where(is_it).values(disqualified=reason.strip()))
            if changed.rowcount != 1:  # type: ignore[attr-defined]
                raise NotFound(f"There is no submission {submission_id} in this race.")
            if not reason:
                accept(session, submission_id)

    def accept(self, race_id: int, submission_id: int, *, user_id: int) -> None:
        """A submission that drives like somebody else's stands, as a person has looked at it.

        Raises:
            NotFound: They do not organise the race, or it has no such submission.
            Conflict: It drives like nobody else's.
        """
        self.get(race_id, user_id, organiser=True)
        with self._database.transaction() as session:
            submission = session.get(Submission, submission_id)
            if submission is None or submission.race_id != race_id:
                raise NotFound(f"There is no submission {submission_id} in this race.")
            if not accept(session, submission_id):
                raise Conflict("It drives like nobody else's entry.")

    def rename_model(self, race_id: int, submission_id: int, model: str, *, user_id: int) -> None:
        """Call a submission otherwise, for good, if what its owner calls it will not do.

        Raises:
            NotFound: They do not organise the race, or it has no such submission.
            Conflict: It is not judged yet.
        """
        self.get(race_id, user_id, organiser=True)
        with self._database.transaction() as session:
            rename_model(session, self._state, race_id, submission_id, model)

    def follow(self, race_id: int, stage: Stage, *, user_id: int) -> None:
        """Let a race take its drivers from another one of its group.

        Raises:
            NotFound: They do not organise both, or the other is of another group.
            Conflict: Somebody has entered already, it would follow itself, or is a final in which two meet at a time.
        """
        race = self.get(race_id, user_id, organiser=True)
        before = self.get(stage.race, user_id, organiser=True)
        if race.group != before.group:
            raise NotFound(f"There is no race {stage.race} in this race's group.")
        with self._database.transaction() as session:
            require_alone(session.get_one(Race, race_id))
            let_follow(session, race_id, stage.race, best=stage.best)

    def follow_none(self, race_id: int, *, user_id: int) -> None:
        """Let everybody of the group enter a race again.

        Raises:
            NotFound: They do not organise it.
            Conflict: It is a final in which two meet at a time.
        """
        self.get(race_id, user_id, organiser=True)
        with self._database.transaction() as session:
            row = session.get_one(Race, race_id)
            require_alone(row)
            row.after_id, row.best_of_it = None, 0

    def judge_again(self, race_id: int, submission_id: int, *, user_id: int) -> None:
        """Have a submission driven once more, which its racer cannot cancel; it is off the board until that is done.

        Raises:
            NotFound: They do not organise the race, or it has no such submission.
            Conflict: It waits or is driven already, or its file is gone.
        """
        self.get(race_id, user_id, organiser=True)
        with self._database.transaction() as session:
            submission = session.get(Submission, submission_id)
            if submission is None or submission.race_id != race_id:
                raise NotFound(f"There is no submission {submission_id} in this race.")
            old = session.get_one(Job, submission.job_id)
            source = submission_folder(self._state, old.id) / ENTRY
            if old.state in ("queued", "running"):
                raise Conflict("It is not judged yet.")
            if not source.is_file():
                raise Conflict("Its file is gone.")
            job = new_job(KIND, "", {**old.payload, ORGANISER: user_id}, user_id=submission.user_id)
            folder = submission_folder(self._state, job.id)
            folder.mkdir(parents=True)
            _write(folder / ENTRY, source.read_bytes())
            session.add(job)
            session.flush()
            submission.job_id, submission.judged = job.id, None
        shutil.rmtree(submission_folder(self._state, old.id), ignore_errors=True)

    def forget(self, user_id: int) -> None:
        """Remove the files of somebody's submissions, weights and replays, in all races."""
        query = sa.select(Submission.job_id).where(Submission.user_id == user_id)
        with self._database.transaction() as session:
            jobs = session.scalars(query).all()
        for job in jobs:
            shutil.rmtree(submission_folder(self._state, job), ignore_errors=True)

    def board(self, race_id: int, *, user_id: int | None, top: int) -> tuple[LeagueRace, Board, int]:
        """A race, its board, and how many submissions are not judged yet.

        Raises:
            NotFound: It is not theirs to see.
        """
        with self._database.transaction() as session:
            race, title, part = self._seen(session, race_id, user_id)
            board = board_of(session, race, user_id=user_id, top=top)
            waiting = sa.select(sa.func.count(Submission.id)).join(Job, Job.id == Submission.job_id)
            waiting = waiting.where(Submission.race_id == race_id, Job.state.in_(("queued", "running")))
            return _info(race, title, part), board, session.scalar(waiting) or 0

    def medals(self, race_id: int) -> Medals | None:
        """What lap times on a race's track are worth in its car, where that is known."""
        with self._database.transaction() as session:
            race = session.get_one(Race, race_id)
        with suppress(RacecraftError):
            track = self._courses(race.owner_id).load(race.track)
            driven = track.reversed() if race.rules.get("direction") == "reverse" else track
            limit = known_limit(driven, load_vehicle(race.vehicle))
            return None if limit is None else limit.medals
        return None

    def announcement(self, race_id: int, *, user_id: int | None) -> Announcement:
        """What is published of a race: its secret only when it is over.

        Raises:
            NotFound: It is not theirs to see.
        """
        with self._database.transaction() as session:
            race, _, _ = self._seen(session, race_id, user_id)
        announced = announcement_of(race)
        shown = "" if is_withheld(race) else announced.secret
        return Announcement(document=announced.document, commitment=announced.commitment, secret=shown)

    def published(self, race_id: int, *, user_id: int | None) -> dict[str, Any]:
        """All that anybody needs to check a race: its announcement, and when it is over its whole board.

        Raises:
            NotFound: It is not theirs to see.
        """
        announced = self.announcement(race_id, user_id=user_id).to_dict()
        race, board, running = self.board(race_id, user_id=user_id, top=NONE)
        told = {"title": race.title, "state": race.state, "running": running}
        rows = [vars(row) for row in board.rows] if race.state == "closed" else []
        found = {**told, **announced, "board": [{name: row[name] for name in PUBLISHED} for row in rows]}
        if race.form == "alone" or race.state != "closed":
            return found
        with self._database.transaction() as session:
            return {**found, "final": published_final(session, session.get_one(Race, race_id))}

    def replay(self, race_id: int, submission_id: int, *, user_id: int | None) -> Path:
        """The replay file of a judged submission, once the race is over: it has every action.

        Raises:
            NotFound: There is none, or the race is not theirs to see.
            Conflict: The race is not over.
        """
        path, is_over = self.driven(race_id, submission_id, user_id=user_id)
        if not is_over:
            raise Conflict("Replays are published when the race is over; until then there is the film.")
        return path

    def driven(self, race_id: int, submission_id: int, *, user_id: int | None) -> tuple[Path, bool]:
        """The same to make a film of, also of a race whose starts everybody knows, and whether the race is over.

        Raises:
            NotFound: There is none, or the race is not theirs to see.
            Conflict: The race is not over and has a secret.
        """
        with self._database.transaction() as session:
            race, _, _ = self._seen(session, race_id, user_id)
            submission = session.get(Submission, submission_id)
        if submission is None or submission.race_id != race_id or submission.judged is None:
            raise NotFound(f"There is no judged submission {submission_id} in this race.")
        if is_withheld(race):
            raise Conflict("What was driven in this race is shown when it is over: it tells where it starts.")
        path = submission_folder(self._state, submission.job_id) / REPLAY
        if not path.is_file():
            raise NotFound(f"Submission {submission_id} has no replay.")
        return path, state_of(race) == "closed"

    def names(self, submissions: list[int]) -> dict[int, str]:
        """Whose submissions they are."""
        query = sa.select(Submission.id, User.name).join(User, User.id == Submission.user_id)
        with self._database.transaction() as session:
            return {row[0]: row[1] for row in session.execute(query.where(Submission.id.in_(submissions)))}

    def track(self, race_id: int) -> tuple[str, Track]:
        """A race's track by its name; it may be its maker's own."""
        with self._database.transaction() as session:
            race = session.get_one(Race, race_id)
        return race.track, self._courses(race.owner_id).load(race.track)

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

    def _seen(self, session: Session, race_id: int, user_id: int | None) -> tuple[Race, str, Part]:
        """A race, its group's title, and what somebody is to it."""
        race = session.get(Race, race_id)
        if race is not None and race.deleted is None and race.group_id is not None:
            member = None if user_id is None else session.get(Member, (race.group_id, user_id))
            if member is not None or race.visibility == "public":
                part: Part = "spectator" if member is None else "organiser" if member.role == "organiser" else "racer"
                return race, session.get_one(Group, race.group_id).title, part
        raise NotFound(f"There is no race {race_id} in this league.")


def _write(path: Path, data: bytes) -> None:
    """So that a crash leaves no half of a file behind a submission."""
    with path.open("xb") as file:
        file.write(data)
        file.flush()
        os.fsync(file.fileno())


def _info(race: Race, group_title: str, part: Part) -> LeagueRace:
    return LeagueRace.model_validate(
        {
            **{name: getattr(race, name) for name in LeagueRace.model_fields if hasattr(race, name)},
            "group": race.group_id,
            "after": race.after_id,
            "group_title": group_title,
            "part": part,
            "is_public": race.visibility == "public",
            "form": (race.document.get("final") or {}).get("form", "alone"),
            "is_practice": "seed" in race.document,
            "laps": int(race.rules.get("laps", 1)),
            "time_limit": float(race.rules.get("time_limit", 0.0)),
            "state": state_of(race),
            "secret": "" if is_withheld(race) else race.secret,
        }
    )
