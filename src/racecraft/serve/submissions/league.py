"""A league's races: who sees them, who changes them, who is where.

A race belongs to a group. Its members see it and submit, its organisers change it; where it is public everybody sees
the board. To all others it does not exist. Until it is over nothing is shown that tells where it starts.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from typing import Any, Final, Literal

import sqlalchemy as sa
from sqlalchemy.orm import Session

from racecraft.contest.finals import FinalTerms
from racecraft.errors import ConfigError, RacecraftError
from racecraft.limits import Medals
from racecraft.limits.limit import known_limit
from racecraft.race.announcement import Announcement
from racecraft.serve.groups.groups import hold_group
from racecraft.serve.problems import Conflict, NotFound
from racecraft.serve.races.races import announcement_of, hold, is_withheld, state_of
from racecraft.serve.races.state import car_of, ranges_of, told_car
from racecraft.serve.store.database import Database
from racecraft.serve.store.tables import Group, Job, Member, Race, Submission, now
from racecraft.serve.submissions.board import NONE, Board
from racecraft.serve.submissions.finalists import board_of, published_final
from racecraft.serve.submissions.schemas import LeagueRace, LeagueRaceChange, NewLeagueRace, Stage
from racecraft.serve.submissions.stages import announced_final, final_of, let_follow, require_alone
from racecraft.serve.tracks.courses import Courses, track_title
from racecraft.track import Track

Part = Literal["organiser", "racer", "spectator"]
PUBLISHED: Final = ("submission", "name", "model", "place", "score_ms", "best_lap_ms", "resets", "completion")
"""Of each row of the board of a race that is over."""


class League:
    """The races of all groups.

    Args:
        database: Where they are.
        courses: Of somebody: a race may be on its maker's own track.
    """

    def __init__(self, database: Database, courses: Callable[[int], Courses]) -> None:
        self._database, self._courses = database, courses

    def races(self, user_id: int) -> list[LeagueRace]:
        """The races of somebody's groups, newest first."""
        query = sa.select(Race, Group.title, Member.role).join(Group, Group.id == Race.group_id)
        query = query.join(Member, sa.and_(Member.group_id == Race.group_id, Member.user_id == user_id))
        with self._database.transaction() as session:
            rows = session.execute(query.where(Race.deleted.is_(None)).order_by(Race.id.desc())).all()
        self._note_over(*(row[0] for row in rows))
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
            race, title, part = seen(session, race_id, user_id)
        self._note_over(race)
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
            sets_end = "closes" in request.model_fields_set or request.is_over
            if sets_end and state_of(race) == "closed":
                raise Conflict("The race is over: everybody knows its secret.", hint="Make another one.")
            if sets_end and final_of(race) is not None:
                raise Conflict("A final in which two meet at a time ends when it has been driven.")
            if sets_end:
                race.closes = now() if request.is_over else request.closes
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
        race = self.get(race_id, user_id, organiser=True)
        with self._database.transaction() as session:
            hold_group(session, race.group)  # or another race would follow this one meanwhile
            follows = sa.select(Race.title).where(Race.after_id == race_id, Race.deleted.is_(None))
            if (final := session.scalar(follows.limit(1))) is not None:
                raise Conflict(f"{final!r} takes its drivers from this race.", hint="Let it follow no race first.")
            session.get_one(Race, race_id).deleted = now()

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
            hold(session, race_id)  # nobody enters meanwhile who did not qualify
            hold_group(session, race.group)  # nor does that one follow this one, or go
            if session.get_one(Race, stage.race).deleted is not None:
                raise NotFound(f"There is no race {stage.race} in this race's group.")
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

    def board(self, race_id: int, *, user_id: int | None, top: int) -> tuple[LeagueRace, Board, int]:
        """A race, its board, and how many submissions are not judged yet.

        Raises:
            NotFound: It is not theirs to see.
        """
        with self._database.transaction() as session:
            race, told, board, running = _board(session, race_id, user_id=user_id, top=top)
        self._note_over(race)
        return told, board, running

    def medals(self, race_id: int) -> Medals | None:
        """What lap times on a race's track are worth in its car, where that is known."""
        with self._database.transaction() as session:
            race = session.get_one(Race, race_id)
        with suppress(RacecraftError):
            track = self._courses(race.owner_id).load(race.track)
            driven = track.reversed() if race.rules.get("direction") == "reverse" else track
            if ranges_of(race).changes_car:
                return None
            limit = known_limit(driven, car_of(race))
            return None if limit is None else limit.medals
        return None

    def announcement(self, race_id: int, *, user_id: int | None) -> Announcement:
        """What is published of a race: its secret only when it is over.

        Raises:
            NotFound: It is not theirs to see.
        """
        with self._database.transaction() as session:
            race, _, _ = seen(session, race_id, user_id)
        self._note_over(race)
        announced = announcement_of(race)
        shown = "" if is_withheld(race) else announced.secret
        return Announcement(document=announced.document, commitment=announced.commitment, secret=shown)

    def published(self, race_id: int, *, user_id: int | None) -> dict[str, Any]:
        """All that anybody needs to check a race: its announcement, and when it is over its whole board.

        Raises:
            NotFound: It is not theirs to see.
        """
        with self._database.one_moment() as connection, Session(connection) as session:
            found, race, board, running = _board(session, race_id, user_id=user_id, top=NONE)
            running += _is_driven_again(session, found)
            is_over = race.state == "closed"
            final = {"final": published_final(session, found)} if is_over and race.form != "alone" else {}
        self._note_over(found)
        announced = replace(announcement_of(found), secret=race.secret).to_dict()
        told = {"title": race.title, "state": race.state, "running": running}
        rows = [vars(row) for row in board.rows] if is_over else []
        return {**told, **announced, "board": [{name: row[name] for name in PUBLISHED} for row in rows], **final}

    def _note_over(self, *races: Race) -> None:
        """Let races that are about to be told to be over, with what they kept secret, be so for good.

        A clock may be set back afterwards, or have been ahead: what people may know then is no race to enter.
        """
        told = [race.id for race in races if race.secret and race.over is None and state_of(race) == "closed"]
        if told:
            with self._database.transaction() as session:
                is_new = sa.and_(Race.id.in_(told), Race.over.is_(None))
                session.execute(sa.update(Race).where(is_new).values(over=now()))

    def track(self, race_id: int) -> tuple[str, Track]:
        """A race's track by its name; it may be its maker's own."""
        with self._database.transaction() as session:
            race = session.get_one(Race, race_id)
        return race.track, self._courses(race.owner_id).load(race.track)


def seen(session: Session, race_id: int, user_id: int | None) -> tuple[Race, str, Part]:
    """A race, its group's title, and what somebody is to it.

    Raises:
        NotFound: There is none, or it is not theirs to see.
    """
    race = session.get(Race, race_id)
    if race is not None and race.deleted is None and race.group_id is not None:
        member = None if user_id is None else session.get(Member, (race.group_id, user_id))
        if member is not None or race.visibility == "public":
            part: Part = "spectator" if member is None else "organiser" if member.role == "organiser" else "racer"
            return race, session.get_one(Group, race.group_id).title, part
    raise NotFound(f"There is no race {race_id} in this league.")


def _board(session: Session, race_id: int, *, user_id: int | None, top: int) -> tuple[Race, LeagueRace, Board, int]:
    """A race, as it is and as it is told, its board, and how many submissions are not judged yet."""
    race, title, part = seen(session, race_id, user_id)
    board = board_of(session, race, user_id=user_id, top=top)
    waiting = sa.select(sa.func.count(Submission.id)).join(Job, Job.id == Submission.job_id)
    waiting = waiting.where(Submission.race_id == race_id, Job.state.in_(("queued", "running")))
    return race, _info(race, title, part), board, session.scalar(waiting) or 0


def _is_driven_again(session: Session, race: Race) -> bool:
    """Whether a final that is over is being driven once more, so that its board is not the last one."""
    job = None if race.final_job_id is None else session.get_one(Job, race.final_job_id)
    return job is not None and job.state in ("queued", "running") and state_of(race) == "closed"


def _info(race: Race, group_title: str, part: Part) -> LeagueRace:
    state = state_of(race)
    return LeagueRace.model_validate(
        {
            **{name: getattr(race, name) for name in LeagueRace.model_fields if hasattr(race, name)},
            "vehicle": told_car(race),
            "group": race.group_id,
            "after": race.after_id,
            "group_title": group_title,
            "track_title": track_title(race.track),
            "part": part,
            "is_public": race.visibility == "public",
            "form": (race.document.get("final") or {}).get("form", "alone"),
            "is_practice": "seed" in race.document,
            "laps": int(race.rules.get("laps", 1)),
            "time_limit": float(race.rules.get("time_limit", 0.0)),
            "direction": race.rules.get("direction", "forward"),
            "state": state,
            "secret": race.secret if state == "closed" else "",
        }
    )
