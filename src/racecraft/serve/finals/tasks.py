"""The job of a final: its duels one after the other, each heat judged as a submission is.

    FOLDER/<duel>/heat-0.replay, heat-1.replay     what the two drove, the better seed in front first

The judge drives every heat twice and is given no secret; this process has it, drives each replay again from its actions
alone, and believes only what comes out the same, from the starts that the secret gives. A job that is begun again
drives only what is not decided yet. Places, and the race's end, come in the moment in which the job is done (`count`).
"""

from __future__ import annotations

import shutil
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any, Final

import sqlalchemy as sa
from sqlalchemy.orm import Session

from racecraft.contest.finals import FinalTerms, duel_result, final_places, plan_final, seats_of
from racecraft.errors import RunError
from racecraft.race.announcement import Announcement
from racecraft.serve.jobs.task import Task
from racecraft.serve.races.state import announcement_of
from racecraft.serve.settings import STATE_FOLDER
from racecraft.serve.store.tables import Duel, Finalist, Race, now
from racecraft.serve.submissions.finalists import duels_of, finalists_of
from racecraft.serve.submissions.judge import ENTRY
from racecraft.serve.submissions.stages import final_of
from racecraft.serve.submissions.tasks import BENCH, BUG, submission_folder

if TYPE_CHECKING:
    from racecraft.replay.replay import Replay

FOLDER: Final = "finals"
DRIVEN: Final = "driven"
"""How the folder of a heat begins while it is judged."""


@dataclass(frozen=True, kw_only=True)
class _Field:
    """What a final is driven by, and by whom."""

    race_id: int
    announcement: Announcement
    terms: FinalTerms
    drivers: dict[int, Path]
    """By seed, the file that drives; replays call it by its seed alone, whatever its owner calls it."""


def final_folder(state: Path, job_id: str) -> Path:
    """Where the files of a final lie, by its job."""
    return state / FOLDER / job_id


def heat_file(folder: Path, number: int, heat: int) -> Path:
    """The replay of a duel's heat."""
    return folder / str(number) / f"heat-{heat}.replay"


def final(task: Task) -> dict[str, Any]:
    """Drive a final; everybody's place by seed."""
    for left in final_folder(task.home / STATE_FOLDER, task.job.id).glob(f"*/{DRIVEN}*"):
        shutil.rmtree(left, ignore_errors=True)  # of a worker that was killed
    field, winners = _field(task)
    plan = plan_final(field.terms.form, len(field.drivers))
    for planned in plan:
        if planned.number in winners:
            continue
        one, other = seats_of(plan, winners)[planned.number]
        assert one is not None
        assert other is not None
        duel = _drive(task, field, planned.number, (min(one, other), max(one, other)))
        winners[duel.number] = duel.winner
        with task.own_database.transaction() as session:
            session.merge(duel)
    places = final_places(field.terms.form, len(field.drivers), winners)
    return {"duels": len(plan), "places": {str(seed): place for seed, place in places.items()}}


def count(session: Session, job_id: str, result: dict[str, Any]) -> None:
    """Give the places of a final that is done, and end the race."""
    race = session.scalars(sa.select(Race).where(Race.final_job_id == job_id)).one()
    for seed, place in result["places"].items():
        session.get_one(Finalist, (race.id, int(seed))).place = place
    race.last_places = None
    race.closes = race.closes or now()


def _field(task: Task) -> tuple[_Field, dict[int, int]]:
    """Who drives by what, and who has won what already; the secret is in no job."""
    state = task.home / STATE_FOLDER
    with task.own_database.transaction() as session:
        race = session.scalars(sa.select(Race).where(Race.final_job_id == task.job.id)).one()
        terms = final_of(race)
        assert terms is not None
        drivers = {
            finalist.seed: submission_folder(state, submission.job_id) / ENTRY
            for finalist, submission, _ in finalists_of(session, race.id)
        }
        winners = {duel.number: duel.winner for duel in duels_of(session, race.id)}
    announcement = announcement_of(race)
    return _Field(race_id=race.id, announcement=announcement, terms=terms, drivers=drivers), winners


def _drive(task: Task, field: _Field, number: int, seeds: tuple[int, int]) -> Duel:
    """Have two drive their heats, and see who has won."""
    first, second = seeds
    one, other = _heat(task, field, number, 0, seeds), _heat(task, field, number, 1, (second, first))
    terms = field.announcement.document
    standings, first_won = duel_result(
        (one.cars[0], other.cars[1]),
        (one.cars[1], other.cars[0]),
        ranking=terms["ranking"],
        minimum_laps=terms["minimum_laps"],
    )
    results = {str(seed): standing.in_whole_ms() for seed, standing in zip(seeds, standings, strict=True)}
    winner = first if first_won else second
    return Duel(race_id=field.race_id, number=number, first=first, second=second, winner=winner, results=results)


def _heat(task: Task, field: _Field, number: int, heat: int, grid: tuple[int, int]) -> Replay:
    """What the judge says was driven, once it has come out the same from the duel's own start."""
    from racecraft.replay.replay import read_replay, write_replay
    from racecraft.replay.verification import verify

    announced, path = field.announcement, heat_file(final_folder(task.home / STATE_FOLDER, task.job.id), number, heat)
    names = tuple(f"seed {seed}" for seed in grid)
    told = {
        "document": dict(announced.document),
        "commitment": announced.commitment,
        "seed": announced.duel_seed(number),
        "track": task.job.payload["track"],
        "grid": [{"file": f"{seed}.safetensors", "name": name} for seed, name in zip(grid, names, strict=True)],
    }
    path.parent.mkdir(parents=True, exist_ok=True)
    with TemporaryDirectory(prefix=DRIVEN, dir=path.parent, ignore_cleanup_errors=True) as name:
        folder = Path(name)
        for seed in grid:
            try:
                shutil.copyfile(field.drivers[seed], folder / f"{seed}.safetensors")
            except OSError as error:
                hint = "Hold the final once more without it."
                raise RunError(f"The file of seed {seed} is gone.", hint=hint) from error
        with BENCH.asked(told, folder=folder) as (_, judged):
            replay = read_replay(judged)
    found = verify(replay, race=announced)
    if not found.is_genuine:
        raise RunError(f"The judge's result does not hold: {found.sentence}", hint=BUG)
    if replay.conditions.seed != announced.duel_seed(number):
        raise RunError("The judge's result does not hold: it is of another duel.", hint=BUG)
    public = Announcement(document=announced.document, commitment=announced.commitment)
    replay = replace(replay, names=names, race=public)
    write_replay(replay, path)
    return replay
