"""Heats and ladders: jobs whose payload is what was asked for, and a folder each with what was driven.

request ──start──▶ job (kind heat or ladder) ──racecraft.serve.contests.tasks──▶ result, files

A job that ends is not forgotten: it is what a page shows until somebody removes it.
"""

from __future__ import annotations

import re
import secrets
import shutil
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Any, Final

import sqlalchemy as sa

from racecraft.contest.ladder import check_ladder, planned_matches
from racecraft.contest.terms import TOGETHER, laps_needed, race_terms
from racecraft.errors import ConfigError
from racecraft.race.announcement import draw_secret
from racecraft.race.conditions import Conditions
from racecraft.race.rules import RaceRules
from racecraft.serve.conditions import told_randomization, told_vehicle
from racecraft.serve.contests.files import REPLAY, VIDEO, contest_folder, count_matches
from racecraft.serve.contests.schemas import (
    ContestCard,
    ContestDetail,
    HeatRow,
    LadderMatch,
    LadderPlace,
    NewHeat,
    NewLadder,
)
from racecraft.serve.contests.terms import Terms, settle, terms_of
from racecraft.serve.evaluations.objects import MAX_SHOWN
from racecraft.serve.jobs.queue import ENDED, JobQueue, new_job_id
from racecraft.serve.models.garage import Garage
from racecraft.serve.models.mirror import Mirror
from racecraft.serve.problems import Conflict, NotFound
from racecraft.serve.races.ghost_schemas import EarlierHeat, Evaluated, EvaluatedCard, Ghost, Starter
from racecraft.serve.races.ghosts import entry_name, evaluated, evaluation_replay, keep
from racecraft.serve.store.database import Database
from racecraft.serve.store.tables import Job
from racecraft.serve.tracks.courses import Courses
from racecraft.track import Track

KINDS: Final = ("heat", "ladder")
"""Of the jobs."""
MAX_CONTESTS: Final = 500
MAX_MATCHES: Final = 20_000
"""Of a ladder."""
_ID: Final = re.compile(r"[0-9a-f]{16}")


class Contests:
    """What somebody's models drove against each other.

    Args:
        state: The console's own folder.
        database: Where the jobs are.
        queue: Of jobs.
        garage: Of models.
        courses: Of tracks.
        mirror: Has the object store hold what a contest needs.
    """

    def __init__(
        self,
        state: Path,
        database: Database,
        queue: JobQueue,
        garage: Garage,
        courses: Courses,
        *,
        mirror: Mirror,
    ) -> None:
        self._state, self._database, self._queue = state, database, queue
        self._garage, self._courses, self._mirror = garage, courses, mirror

    def start_heat(self, request: NewHeat) -> str:
        """Queue a heat; its id.

        Raises:
            RacecraftError: A model, a ghost or the track is not usable, or there are too many contests.
        """
        if request.secret and request.seed is not None:
            raise ConfigError("secret and seed are two ways to say where the heat starts; give one.")
        terms, kind = settle(request), "head-to-model" if len(request.models) == 2 else "grid"
        conditions = Conditions(
            track=self._courses.load(request.track),
            rules=terms.rules,
            vehicle=terms.vehicle,
            objects=terms.objects,
            randomize=terms.randomize,
        )
        announced = race_terms(
            conditions,
            kind=kind,
            num_cars=len(request.models),
            ranking=request.ranking,
            minimum_laps=request.minimum_laps,
            secret=draw_secret() if request.secret else None,
        ).announcement
        replays = self.replays(request.ghosts, conditions.track, conditions.rules)
        payload = request.model_dump() | {
            "kind": kind,
            "tracks": [request.track],
            "paths": [self._courses.path_or_name(request.track)],
            "secret": announced.secret,
            "commitment": announced.commitment if request.secret else "",
        }
        driving = [*request.models, *(ghost for ghost in request.ghosts if isinstance(ghost, Starter))]
        return self._add("heat", payload, driving, terms, replays=replays)

    def start_ladder(self, request: NewLadder) -> str:
        """Queue a ladder; its id.

        Raises:
            RacecraftError: A model or a track is not usable, or there are too many contests.
        """
        check_ladder(
            len(request.models),
            kind=request.kind,
            schedule=request.schedule,
            starts=request.starts,
            rounds=request.rounds,
        )
        if request.rounds and request.schedule != "swiss":
            raise ConfigError(f"rounds are those of a swiss schedule; this one is {request.schedule}.")
        if request.objects is not None and request.kind not in TOGETHER:
            raise ConfigError(f"objects go with the ladder head-to-model; a {request.kind} has its own.")
        paths = self._courses.paths(request.tracks)
        planned = planned_matches(
            len(request.models), len(paths), schedule=request.schedule, starts=request.starts, rounds=request.rounds
        )
        if planned > MAX_MATCHES:
            raise ConfigError(
                f"This ladder would have {planned} races; allowed are {MAX_MATCHES}.",
                hint="Choose fewer models, tracks or starts, or the Swiss schedule.",
            )
        payload = request.model_dump() | {"paths": paths, "planned": planned}
        return self._add("ladder", payload, request.models, settle(request))

    def evaluated(self, track: str, direction: str) -> list[EvaluatedCard]:
        """Evaluations on a track that may be ghosts of a heat there, in that direction."""
        return evaluated(self._garage.runs, self._courses.load(track), direction)

    def cards(self) -> list[ContestCard]:
        """All of them, newest first."""
        return [self._card(job) for job in self._jobs()]

    def get(self, contest: str) -> ContestDetail:
        """A heat or a ladder with its result."""
        job = self.job(contest)
        payload, result = job.payload, job.result or {}
        terms, ranking = terms_of(payload), payload.get("ranking", "total")
        return ContestDetail(
            **self._card(job).model_dump(),
            rules=terms.rules.to_dict(),
            objects=terms.objects.to_dict(),
            laps=payload["laps"],
            vehicle=told_vehicle(terms.vehicle),
            randomize=told_randomization(terms.randomize),
            seed=payload["seed"],
            commitment=payload.get("commitment", ""),
            secret=payload.get("secret", "") if job.state in ENDED else "",
            ghosts=payload.get("ghosts", []),
            ranking=ranking,
            minimum_laps=payload.get("minimum_laps") or laps_needed(ranking, payload["laps"]),
            schedule=payload.get("schedule", ""),
            starts=payload.get("starts", 0),
            rounds=payload.get("rounds", 0),
            heat=[HeatRow(**row) for row in result.get("heat", ())],
            ladder=[LadderPlace(**row) for row in result.get("ladder", ())],
            matches=[LadderMatch(number=number, **row) for number, row in enumerate(result.get("matches", ()))],
            has_video=(self.folder(contest) / VIDEO).is_file(),
        )

    def remove(self, contest: str) -> None:
        """Remove a contest with its files.

        Raises:
            Conflict: It is under way.
        """
        job = self.job(contest)
        if job.state not in ENDED:
            raise Conflict("It is being driven.", hint="Stop it first.")
        with self._database.transaction() as session:
            session.execute(sa.delete(Job).where(Job.id == job.id))
        shutil.rmtree(self.folder(contest), ignore_errors=True)

    def job(self, contest: str) -> Job:
        """The job of a contest.

        Raises:
            NotFound: There is none.
        """
        job = self._queue.get(contest) if _ID.fullmatch(contest) else None
        if job is None or job.kind not in KINDS:
            raise NotFound(f"There is no heat or ladder {contest[:40]!r}.")
        return job

    def folder(self, contest: str) -> Path:
        """Where its files lie."""
        return contest_folder(self._state, contest)

    def file(self, contest: str, name: str) -> Path:
        """One of its files.

        Raises:
            NotFound: It has none of that name, or none that may be seen before its secret.
        """
        job = self.job(contest)
        path = self.folder(job.id) / name
        if not path.is_file() or (_is_secret(job.payload) and job.state not in ENDED):
            raise NotFound("There is nothing to see of it.")
        return path

    def _jobs(self) -> list[Job]:
        found = [job for kind in KINDS for job in self._queue.list(kind=kind, limit=MAX_CONTESTS)]
        return sorted(found, key=lambda job: job.created, reverse=True)

    def replays(self, ghosts: Sequence[Ghost], track: Track, rules: RaceRules) -> dict[int, Path]:
        """The replays of those that drove before, by their places among the ghosts.

        Args:
            ghosts: As somebody asked for them.
            track: Of the film.
            rules: Of the film, which say in what direction it goes.

        Raises:
            NotFound: There is no such heat, model or evaluation.
            Conflict: An evaluation has no replay.
            ConfigError: One is of another road.
        """
        found = {}
        for number, ghost in enumerate(ghosts):
            if isinstance(ghost, EarlierHeat):
                found[number] = self.file(ghost.heat, REPLAY)
            elif isinstance(ghost, Evaluated):
                found[number] = evaluation_replay(self._garage.folder(ghost.model), ghost.evaluation)
        if found:
            from racecraft.film.ghost_source import check_sources

            check_sources([str(path) for path in found.values()], track, rules, run=None, max_numbers=MAX_SHOWN)
        return found

    def _add(
        self,
        kind: str,
        payload: dict[str, Any],
        driving: Sequence[Starter],
        terms: Terms,
        *,
        replays: Mapping[int, Path] = MappingProxyType({}),
    ) -> str:
        for starter in driving:
            self._garage.require_checkpoint(starter.model, starter.checkpoint)
        if len(self._jobs()) >= MAX_CONTESTS:
            raise Conflict(f"There are {MAX_CONTESTS} heats and ladders already.", hint="Delete some first.")
        payload["terms"] = terms.to_dict()
        if payload["seed"] is None and not _is_secret(payload):
            payload["seed"] = secrets.randbelow(2**32)
        folders = [self._garage.folder(starter.model) for starter in driving]
        contest = new_job_id()
        try:
            keep(replays, self.folder(contest))
            filled = self.folder(contest) if replays else None
            cargo = self._mirror.share(*folders, tracks=payload["paths"], filled=filled)
            return self._queue.add(kind, driving[0].model, payload, cargo=cargo, job_id=contest).id
        except Exception:
            shutil.rmtree(self.folder(contest), ignore_errors=True)
            raise

    def _card(self, job: Job) -> ContestCard:
        payload, result = job.payload, job.result or {}
        is_ladder = job.kind == "ladder"
        first = next(iter(result.get("ladder" if is_ladder else "heat", ())), None)
        return ContestCard(
            id=job.id,
            is_ladder=is_ladder,
            kind=payload["kind"],
            title=payload["title"],
            tracks=payload["tracks"],
            is_road_as_it_was="digest" not in result or self._courses.is_still(payload["tracks"][0], result["digest"]),
            direction=payload.get("terms", {}).get("rules", payload).get("direction", "forward"),
            models=[entry_name(one) for one in payload["models"]],
            state=job.state,  # type: ignore[arg-type]
            created=job.created,
            winner=first["name"] if first and first["place"] == 1 else None,
            driven=count_matches(self.folder(job.id))
            if is_ladder and job.state == "running"
            else len(result.get("matches", ())),
            planned=payload.get("planned", 0),
            error=str((job.error or {}).get("message", "")),
        )


def _is_secret(payload: Mapping[str, Any]) -> bool:
    """Whether its starts are drawn from a secret."""
    return bool(payload.get("commitment"))
