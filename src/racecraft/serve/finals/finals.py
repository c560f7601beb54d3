"""A league's finals in which two meet at a time.

    qualifying is over ──hold──▶ finalists, and a job that drives their duels ──▶ duels, one after the other ──▶ places

Nobody enters: the first of qualifying drive, with the very files that they qualified with. So what is shown of a duel
that is decided helps nobody in the next; until the final is over its poses are rounded as everywhere.
"""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

import sqlalchemy as sa
from sqlalchemy.orm import Session

from racecraft.contest.finals import HEATS, FinalTerms, Source, plan_final, seats_of
from racecraft.serve.finals.schemas import DuelInfo, DuelRacer, FinalistInfo, FinalPage
from racecraft.serve.finals.tasks import final_folder, heat_file
from racecraft.serve.jobs.queue import new_job
from racecraft.serve.problems import Conflict, NotFound
from racecraft.serve.races.races import hold, state_of
from racecraft.serve.store.database import Database
from racecraft.serve.store.tables import Duel, Finalist, Job, Race
from racecraft.serve.submissions.finalists import board_of, duels_of, finalists_of, places_of
from racecraft.serve.submissions.infos import seconds_of
from racecraft.serve.submissions.league import League
from racecraft.serve.submissions.stages import final_of, is_decided, require_decided
from racecraft.serve.tracks.courses import Courses

KIND: Final = "final"
"""Of the job."""
UNDER_WAY: Final = ("queued", "running")


class Finals:
    """The finals of all groups.

    Args:
        database: Where they are.
        state: The server's own folder.
        courses: Of somebody: a final may be on its maker's own track.
        league: Knows who may see a race, and who organises it.
    """

    def __init__(self, database: Database, state: Path, courses: Callable[[int], Courses], league: League) -> None:
        self._database, self._state, self._courses, self._league = database, state, courses, league

    def hold(self, race_id: int, *, user_id: int) -> None:
        """Have a final driven by the first of its qualifying; once more if that has changed, or something failed.

        Raises:
            NotFound: They do not organise it, or it is no such final.
            Conflict: Qualifying is not over and judged, fewer than two have a place in it, or it is driven already.
        """
        self._league.get(race_id, user_id, organiser=True)
        with self._database.transaction() as session:
            hold(session, race_id)
            race, terms = self._final(session, race_id)
            before = session.get_one(Race, race.after_id)
            if state_of(race) == "upcoming":
                raise Conflict("The race is not open yet.")
            require_decided(session, before)
            old = None if race.final_job_id is None else session.get_one(Job, race.final_job_id)
            if old is not None and old.state in UNDER_WAY:
                raise Conflict("It is being driven.")
            ranked = [row for row in board_of(session, before, user_id=None, top=terms.best).rows if row.place]
            if len(ranked) < 2:
                raise Conflict(f"Fewer than two have a place in {before.title!r}.", hint="Hold another race.")
            race.last_places = places_of(session, race)
            for table in (Duel, Finalist):
                session.execute(sa.delete(table).where(table.race_id == race_id))
            rows = enumerate(ranked[: terms.best], start=1)
            session.add_all(Finalist(race_id=race_id, seed=seed, submission_id=row.submission) for seed, row in rows)
            track = self._courses(race.owner_id).path_or_name(race.track)
            job = new_job(KIND, "", {"track": track}, user_id=user_id)
            session.add(job)
            session.flush()
            race.final_job_id = job.id
        if old is not None:
            shutil.rmtree(final_folder(self._state, old.id), ignore_errors=True)

    def page(self, race_id: int, *, user_id: int | None) -> FinalPage:
        """A final as far as it is decided.

        Raises:
            NotFound: It is not theirs to see, or it is no such final.
        """
        self._league.get(race_id, user_id)
        with self._database.transaction() as session:
            race, terms = self._final(session, race_id)
            before = session.get_one(Race, race.after_id)
            job = None if race.final_job_id is None else session.get_one(Job, race.final_job_id)
            finalists, driven = finalists_of(session, race_id), duels_of(session, race_id)
            is_qualified = is_decided(session, before)
        return FinalPage.model_validate(
            {
                "race": race_id,
                "form": terms.form,
                "best": terms.best,
                "qualifying": before.id if before.deleted is None else None,
                "qualifying_title": before.title,
                "is_qualified": is_qualified,
                "state": "waiting" if job is None else job.state,
                "error": None if job is None else job.error,
                "finalists": [
                    FinalistInfo(
                        seed=finalist.seed,
                        name=name,
                        model=submission.model,
                        place=finalist.place,
                        is_me=user_id is not None and submission.user_id == user_id,
                    )
                    for finalist, submission, name in finalists
                ],
                "duels": _duels(terms, len(finalists), {duel.number: duel for duel in driven}),
            }
        )

    def heat(self, race_id: int, number: int, heat: int, *, user_id: int | None) -> tuple[Path, bool]:
        """The replay file of a duel's heat that is decided, and whether the final is over, so that it may be given out.

        Raises:
            NotFound: The race is not theirs to see, or has no such heat that is driven.
        """
        race = self._league.get(race_id, user_id)
        with self._database.transaction() as session:
            row, _ = self._final(session, race_id)
            duel = session.get(Duel, (race_id, number))
        path = heat_file(final_folder(self._state, row.final_job_id or "none"), number, heat)
        if duel is None or not 0 <= heat < HEATS or not path.is_file():
            raise NotFound(f"There is no heat {heat} of a duel {number} in this race.")
        return path, race.state == "closed"

    def racers(self, race_id: int, number: int, heat: int) -> list[tuple[int, str]]:
        """Seeds and names of a decided duel's cars, the one in front first."""
        with self._database.transaction() as session:
            duel = session.get_one(Duel, (race_id, number))
            names = {finalist.seed: name for finalist, _, name in finalists_of(session, race_id)}
        seeds = (duel.first, duel.second) if heat == 0 else (duel.second, duel.first)
        return [(seed, names[seed]) for seed in seeds]

    def _final(self, session: Session, race_id: int) -> tuple[Race, FinalTerms]:
        race = session.get_one(Race, race_id)
        terms = final_of(race)
        if terms is None or race.after_id is None:
            raise NotFound(f"Race {race_id} is no final in which two meet at a time.")
        return race, terms


def _duels(terms: FinalTerms, num_finalists: int, driven: dict[int, Duel]) -> list[DuelInfo]:
    """All duels that there will be; none before there are finalists."""
    if num_finalists < 2:
        return []
    plan = plan_final(terms.form, num_finalists)
    winners = {number: duel.winner for number, duel in driven.items()}
    return [
        DuelInfo(
            number=planned.number,
            round=planned.round,
            is_for_third=planned.is_for_third,
            racers=[
                _racer(seed, source, driven.get(planned.number))
                for seed, source in zip(seats, planned.sources, strict=True)
            ],
            winner=winners.get(planned.number),
        )
        for planned, seats in zip(plan, seats_of(plan, winners), strict=True)
    ]


def _racer(seed: int | None, source: Source, duel: Duel | None) -> DuelRacer:
    found: dict[str, Any] = {} if duel is None else duel.results[str(seed)]
    return DuelRacer(
        seed=seed,
        source=None if source.kind == "seed" else source.number,
        score=seconds_of(found.get("score_ms")),
        completion=found.get("completion"),
    )
