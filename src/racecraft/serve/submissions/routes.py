"""A league's races: made by organisers, entered by members, looked at by everybody who may."""

from __future__ import annotations

import asyncio
import json
from functools import partial
from typing import Annotated, Final

from fastapi import APIRouter, Path, Query, Request, Response
from fastapi.concurrency import run_in_threadpool
from fastapi.responses import FileResponse

from racecraft.errors import ConfigError, RunError
from racecraft.judging.race import FORMAT
from racecraft.limits import Medals
from racecraft.race.entry_file import pack_entry
from racecraft.serve.context import Computes, Consoles, InConsoles, InLeague, InPerson
from racecraft.serve.groups.groups import require_open
from racecraft.serve.problems import NotFound
from racecraft.serve.races.replays import cars_there, replay_of, trial_of
from racecraft.serve.races.schemas import MAX_CARS, RaceReplay, ReplayCar
from racecraft.serve.schemas import RunName
from racecraft.serve.submissions.board import Board, Row
from racecraft.serve.submissions.data import data_of
from racecraft.serve.submissions.infos import seconds_of
from racecraft.serve.submissions.schemas import (
    BoardPage,
    BoardRow,
    Disqualify,
    EnterModel,
    LeagueRace,
    LeagueRaceChange,
    NewLeagueRace,
    SeasonResult,
    SeasonRow,
    Stage,
    SubmissionChange,
    SubmissionInfo,
)
from racecraft.serve.submissions.season import SeasonStanding, read_season

router = APIRouter(prefix="/api", tags=["league"])

Id = Annotated[int, Path(ge=0, lt=2**31)]
ARRIVES_S: Final = 120.0
"""32 MB at 2 Mbit/s; who sends a byte now and then holds nobody's place for longer."""
OPEN_GRAIN: Final = 50
"""mm and mrad that films of an open race are rounded to: in a step of 1/15 s that is 0.75 m/s, so that nobody reads a
driver's choices off them and trains another one by those."""
Top = Annotated[int, Query(ge=1, le=500)]


@router.get("/league/races")
def list_league_races(consoles: InConsoles, person: InPerson) -> list[LeagueRace]:
    """The races of one's groups, newest first."""
    return consoles.league.races(person.id)


@router.post("/groups/{group_id}/races", status_code=201)
def create_league_race(group_id: Id, body: NewLeagueRace, consoles: InConsoles, person: InPerson) -> LeagueRace:
    """A race for a group."""
    consoles.groups.require(group_id, person.id, organiser=True)
    final = consoles.league.announce(body, group_id)
    races, permit = consoles.of(person.id).races, partial(require_open, group_id=group_id)
    number = races.create(body, user_id=person.id, group_id=group_id, final=final, permit=permit)
    consoles.league.begin(number, body)
    return consoles.league.get(number, person.id)


@router.get("/groups/{group_id}/season")
def get_season(group_id: Id, consoles: InConsoles, person: InPerson) -> list[SeasonRow]:
    """Points of a group's races that are over, most first, and what led to them."""
    consoles.groups.require(group_id, person.id)
    with consoles.owner.database.transaction() as session:
        return _season(read_season(session, group_id), me=person.id)


@router.patch("/league/races/{race_id}")
def change_league_race(race_id: Id, body: LeagueRaceChange, consoles: InConsoles, person: InPerson) -> LeagueRace:
    """Another title, description, end or audience."""
    consoles.league.change(race_id, body, user_id=person.id)
    return consoles.league.get(race_id, person.id)


@router.post("/league/races/{race_id}/follow")
def follow_race(race_id: Id, body: Stage, consoles: InConsoles, person: InPerson) -> LeagueRace:
    """Let only the first of another race of the group enter this one, as in a final after qualifying."""
    consoles.league.follow(race_id, body, user_id=person.id)
    return consoles.league.get(race_id, person.id)


@router.delete("/league/races/{race_id}/follow")
def follow_no_race(race_id: Id, consoles: InConsoles, person: InPerson) -> LeagueRace:
    """Let everybody of the group enter a race again."""
    consoles.league.follow_none(race_id, user_id=person.id)
    return consoles.league.get(race_id, person.id)


@router.delete("/league/races/{race_id}", status_code=204)
def delete_league_race(race_id: Id, consoles: InConsoles, person: InPerson) -> Response:
    """Put a race away."""
    consoles.league.remove(race_id, user_id=person.id)
    return Response(status_code=204)


@router.get("/account/data")
def download_data(consoles: InConsoles, person: InPerson) -> Response:
    """All that is kept of who asks; their models are archives of their own."""
    names = [card.name for card in consoles.of(person.id).garage.cards()]
    document = {**data_of(consoles.owner.database, person.id), "models": names}
    text = json.dumps(document, indent=2, ensure_ascii=False, default=str)
    headers = {"Content-Disposition": 'attachment; filename="racecraft-my-data.json"'}
    return Response(text, media_type="application/json", headers=headers)


@router.get("/boards/{race_id}")
def get_board(race_id: Id, request: Request, consoles: InLeague, top: Top = 100) -> BoardPage:
    """The board of a race; where it is public without an account, too."""
    user: int | None = request.state.user_id
    race, board, running = consoles.league.board(race_id, user_id=user, top=top)
    mine = next((row for row in board.rows if user is not None and row.user == user), None)
    medals = consoles.league.medals(race_id)
    return BoardPage(
        race=race,
        entrants=board.entrants,
        ranked=board.ranked,
        running=running,
        rows=[_row(row, first=board.first_ms, is_me=row is mine, medals=medals) for row in board.rows],
        mine=mine.row if mine is not None else None,
        beaten=_beaten(mine, board),
    )


@router.get("/boards/{race_id}/season", dependencies=[Computes])
def get_board_season(race_id: Id, request: Request, consoles: InLeague) -> list[SeasonRow]:
    """The season that a race belongs to, as far as whoever sees the board may see it: others the public races alone."""
    user: int | None = request.state.user_id
    race = consoles.league.get(race_id, user)
    with consoles.owner.database.transaction() as session:
        found = read_season(session, race.group, public=race.part == "spectator")
    return _season(found, me=user)


@router.get("/boards/{race_id}/race.json")
def get_league_announcement(race_id: Id, request: Request, consoles: InLeague) -> Response:
    """What is published of a race, for `racecraft verify --race`: secret and whole board are in it when it is over."""
    told = consoles.league.published(race_id, user_id=request.state.user_id)
    text = json.dumps({"format": FORMAT, **told}, indent=2, ensure_ascii=False)
    return Response(text, media_type="application/json")


@router.get("/boards/{race_id}/replays/{submission_id}")
def get_submission_replay(race_id: Id, submission_id: Id, request: Request, consoles: InLeague) -> FileResponse:
    """The replay file of a submission, for `racecraft verify`, once the race is over."""
    path = consoles.entries.replay(race_id, submission_id, user_id=request.state.user_id)
    return FileResponse(path, media_type="application/octet-stream", filename=f"{race_id}-{submission_id}.replay")


@router.get("/boards/{race_id}/film", dependencies=[Computes])
def get_film(
    race_id: Id,
    request: Request,
    consoles: InLeague,
    submissions: Annotated[str, Query(max_length=200, pattern=r"^\d{1,9}(,\d{1,9})*$")],
) -> RaceReplay:
    """The trial that the first of some submissions is ranked by, of all of them side by side, once starts are known.

    Those whose replay is gone or damaged are named, and the others shown.
    """
    entries, user = consoles.entries, request.state.user_id
    wanted = list(dict.fromkeys(int(part) for part in submissions.split(",")))
    if len(wanted) > MAX_CARS:
        raise ConfigError(f"A film shows at most {MAX_CARS} cars, {len(wanted)} were asked for.")
    driven = {number: entries.driven(race_id, number, user_id=user) for number in wanted}
    named, trial = entries.names(wanted), entries.counted_trial(wanted[0])

    def car_of(number: int) -> ReplayCar:
        path, is_over = driven[number]
        if not path.is_file():
            raise NotFound(f"Submission {number} has no replay.")
        return trial_of(path, trial, entry=number, model=named[number], grain=1 if is_over else OPEN_GRAIN)

    cars, missing = cars_there({number: named[number] for number in wanted}, car_of)
    is_coarse = not all(is_over for _, is_over in driven.values())
    return replay_of(*consoles.league.track(race_id), cars, trial=trial, is_coarse=is_coarse, missing=missing)


@router.post(
    "/league/races/{race_id}/submissions",
    status_code=202,
    openapi_extra={
        "requestBody": {
            "required": True,
            "content": {"application/octet-stream": {"schema": {"type": "string", "format": "binary"}}},
        }
    },
)
async def submit(
    race_id: Id, request: Request, consoles: InConsoles, person: InPerson, model: RunName
) -> SubmissionInfo:
    """A model's file, as `racecraft submit` packs it; judged as a job. The same file again is the same submission."""
    await run_in_threadpool(consoles.league.get, race_id, person.id, member=True)  # before 32 MB are read for nothing
    async with consoles.uploads.place(person.id):  # a few of 32 MB at a time, of each and of all
        try:
            data = await asyncio.wait_for(request.body(), ARRIVES_S)
        except TimeoutError as error:
            raise RunError(f"The file took more than {ARRIVES_S:.0f} s to arrive.", hint="Send it again.") from error
    return await run_in_threadpool(_submit, consoles, race_id, data, model, person.id)


@router.post("/league/races/{race_id}/enter", status_code=202)
def enter_model(race_id: Id, body: EnterModel, consoles: InConsoles, person: InPerson) -> SubmissionInfo:
    """A model of one's own garage; it is packed and judged like one from elsewhere."""
    data = pack_entry(consoles.of(person.id).garage.folder(body.model), checkpoint=body.checkpoint)
    return _submit(consoles, race_id, data, body.model, person.id)


@router.get("/league/races/{race_id}/submissions")
def list_submissions(
    race_id: Id, consoles: InConsoles, person: InPerson, everybody: bool = False
) -> list[SubmissionInfo]:
    """One's own submissions, newest first; for an organiser everybody's."""
    return consoles.entries.submissions(race_id, user_id=person.id, everybody=everybody)


@router.get("/league/races/{race_id}/submissions/{submission_id}")
def get_submission(race_id: Id, submission_id: Id, consoles: InConsoles, person: InPerson) -> SubmissionInfo:
    """One of one's own."""
    return consoles.entries.submission(race_id, submission_id, user_id=person.id)


@router.patch("/league/races/{race_id}/submissions/{submission_id}", status_code=204)
def rename_model(
    race_id: Id, submission_id: Id, body: SubmissionChange, consoles: InConsoles, person: InPerson
) -> Response:
    """Another name for somebody's entry, if the one it has will not do; it stays."""
    consoles.entries.rename_model(race_id, submission_id, body.model, user_id=person.id)
    return Response(status_code=204)


@router.post("/league/races/{race_id}/submissions/{submission_id}/disqualify", status_code=204)
def disqualify(race_id: Id, submission_id: Id, body: Disqualify, consoles: InConsoles, person: InPerson) -> Response:
    """A submission does not count, for a reason that its owner reads."""
    consoles.entries.disqualify(race_id, submission_id, body.reason, user_id=person.id)
    return Response(status_code=204)


@router.post("/league/races/{race_id}/submissions/{submission_id}/restore", status_code=204)
def restore_submission(race_id: Id, submission_id: Id, consoles: InConsoles, person: InPerson) -> Response:
    """It counts again."""
    consoles.entries.disqualify(race_id, submission_id, "", user_id=person.id)
    return Response(status_code=204)


@router.post("/league/races/{race_id}/submissions/{submission_id}/accept", status_code=204)
def accept_submission(race_id: Id, submission_id: Id, consoles: InConsoles, person: InPerson) -> Response:
    """Let stand what drives like somebody else's entry."""
    consoles.entries.accept(race_id, submission_id, user_id=person.id)
    return Response(status_code=204)


@router.post("/league/races/{race_id}/submissions/{submission_id}/judge", status_code=202)
def judge_again(race_id: Id, submission_id: Id, consoles: InConsoles, person: InPerson) -> Response:
    """Have it driven once more."""
    consoles.entries.judge_again(race_id, submission_id, user_id=person.id)
    consoles.owner.supervisor.wake()
    return Response(status_code=202)


def _submit(consoles: Consoles, race_id: int, data: bytes, model: str, user_id: int) -> SubmissionInfo:
    number = consoles.entries.submit(race_id, data, model=model, user_id=user_id)
    consoles.owner.supervisor.wake()
    return consoles.entries.submission(race_id, number, user_id=user_id)


def _season(found: list[SeasonStanding], *, me: int | None) -> list[SeasonRow]:
    return [
        SeasonRow(
            name=one.name,
            points=one.points,
            races=one.races,
            wins=one.wins,
            is_me=me is not None and one.user == me,
            results=[SeasonResult(**vars(result)) for result in one.results],
        )
        for one in found
    ]


def _row(row: Row, *, first: int | None, is_me: bool, medals: Medals | None) -> BoardRow:
    best = seconds_of(row.best_lap_ms)
    return BoardRow(
        place=row.place,
        row=row.row,
        submission=row.submission,
        name=row.name,
        model=row.model,
        is_me=is_me,
        score=seconds_of(row.score_ms),
        gap=None if row.score_ms is None or first is None else (row.score_ms - first) / 1000,
        best_lap=best,
        medal=medals.won_by(best) if medals is not None and best is not None else "",
        resets=row.resets,
        completion=row.completion,
    )


def _beaten(mine: Row | None, board: Board) -> float | None:
    """Per cent of the others; None for who is alone."""
    if mine is None or board.entrants < 2:
        return None
    return round(100 * board.behind / (board.entrants - 1), 1)
