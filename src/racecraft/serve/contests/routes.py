"""Heats on one road, and ladders."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from fastapi import APIRouter, Query, Response
from fastapi import Path as PathPart
from fastapi.responses import FileResponse

from racecraft.contest.terms import TOGETHER
from racecraft.errors import ReplayError
from racecraft.serve.contests.files import MATCHES, REPLAY, VIDEO, read_match
from racecraft.serve.contests.schemas import ContestCard, ContestDetail, NewHeat, NewLadder
from racecraft.serve.context import Computes, InContext, TakesPlace
from racecraft.serve.evaluations.objects import MAX_SHOWN
from racecraft.serve.problems import NotFound
from racecraft.serve.races.ghost_schemas import EvaluatedCard
from racecraft.serve.races.ghosts import read_beside
from racecraft.serve.races.replays import car_of, replay_of, road_of
from racecraft.serve.races.schemas import RaceReplay, ReplayCar

if TYPE_CHECKING:
    from racecraft.analysis.share_heat import Placed

router = APIRouter(prefix="/api/contests", tags=["contests"])

Id = Annotated[str, PathPart(max_length=40)]


@router.get("")
def list_contests(context: InContext) -> list[ContestCard]:
    """Heats and ladders, newest first."""
    return context.contests.cards()


@router.post("/heats", status_code=202, dependencies=[TakesPlace])
def start_heat(request: NewHeat, context: InContext) -> ContestDetail:
    """Let two to eight models race on one road."""
    contest = context.contests.start_heat(request)
    context.supervisor.wake()
    return context.contests.get(contest)


@router.post("/ladders", status_code=202, dependencies=[TakesPlace])
def start_ladder(request: NewLadder, context: InContext) -> ContestDetail:
    """Rate models by many races."""
    contest = context.contests.start_ladder(request)
    context.supervisor.wake()
    return context.contests.get(contest)


@router.get("/ghosts")
def list_evaluated(
    track: Annotated[str, Query(max_length=200)],
    context: InContext,
    direction: Literal["forward", "reverse"] = "forward",
) -> list[EvaluatedCard]:
    """Evaluations whose best trial may be a ghost on a track in a direction, model by model, the newest first."""
    return context.contests.evaluated(track, direction)


@router.get("/{contest}")
def get_contest(contest: Id, context: InContext) -> ContestDetail:
    """A heat or a ladder with its result."""
    context.follower.see(context.contests.job(contest))
    return context.contests.get(contest)


@router.delete("/{contest}", status_code=204)
def delete_contest(contest: Id, context: InContext) -> Response:
    """Remove a heat or a ladder with its files."""
    context.follower.see(context.contests.job(contest))
    context.contests.remove(contest)
    return Response(status_code=204)


@router.get("/{contest}/video")
def get_heat_video(contest: Id, context: InContext) -> FileResponse:
    """The film of a heat."""
    path = context.contests.file(contest, VIDEO)
    return FileResponse(path, media_type="video/mp4", filename="heat.mp4", content_disposition_type="inline")


@router.get("/{contest}/replay.file")
def get_heat_file(contest: Id, context: InContext) -> FileResponse:
    """The replay file of a heat, for `racecraft verify`."""
    path = context.contests.file(contest, REPLAY)
    return FileResponse(path, media_type="application/octet-stream", filename="heat.replay")


@router.get(
    "/{contest}/share.html",
    response_class=Response,
    responses={200: {"content": {"text/html": {}}}},
    dependencies=[Computes],
)
def get_heat_share(contest: Id, context: InContext, language: Literal["en", "de"] = "en") -> Response:
    """A heat as one HTML file that opens offline, with the replay inside."""
    from racecraft.analysis.share_heat import share_heat

    file, found = context.contests.file(contest, REPLAY), context.contests.get(contest)
    text = share_heat(file, _placed(found), title=_title(found), language=language, max_numbers=MAX_SHOWN)
    return Response(text, media_type="text/html", headers={"Content-Disposition": 'attachment; filename="heat.html"'})


@router.get(
    "/{contest}/share.png",
    response_class=Response,
    responses={200: {"content": {"image/png": {}}}},
    dependencies=[Computes],
)
def get_heat_picture(contest: Id, context: InContext, language: Literal["en", "de"] = "en") -> Response:
    """The winner's racing line and the result as a picture, with the replay inside."""
    from racecraft.analysis.share_heat import draw_heat

    file, found = context.contests.file(contest, REPLAY), context.contests.get(contest)
    with tempfile.TemporaryDirectory() as place:
        path, rows = Path(place) / "heat.png", _placed(found)
        data = draw_heat(file, rows, path, title=_title(found), language=language, max_numbers=MAX_SHOWN).read_bytes()
    return Response(data, media_type="image/png", headers={"Content-Disposition": 'attachment; filename="heat.png"'})


@router.get("/{contest}/replay", dependencies=[Computes])
def get_contest_replay(
    contest: Id, context: InContext, match: Annotated[int | None, Query(ge=0, lt=100_000)] = None
) -> RaceReplay:
    """A heat step by step, or one race of a ladder by its number; who came in first stands first."""
    from racecraft.replay.replay import read_replay

    found = context.contests.get(contest)
    if not found.is_ladder:
        file = context.contests.file(contest, REPLAY)
        driven = [car.recording for car in read_replay(file, max_numbers=MAX_SHOWN).cars]
        if any(row.car >= len(driven) for row in found.heat):
            raise ReplayError(f"{file.name} does not have all cars of the heat.")
        cars = [car_of(row.car, row.name, driven[row.car], is_alone=False) for row in found.heat]
        track, road, ghosts = found.tracks[0], road_of(*driven), read_beside(context.contests.folder(contest))
    else:
        document = read_match(context.contests.file(contest, MATCHES), match or 0)
        row = next((one for one in found.matches if one.number == (match or 0)), None)
        if row is None:
            raise NotFound(f"The ladder has no race {match}.")
        order = sorted(range(len(row.models)), key=lambda car: row.places[car])
        two, road, ghosts = document["cars"], [], []
        before: dict[str, Any] = {"objects": []}  # in files from before they were kept
        try:
            cars = [ReplayCar(entry=car, model=row.models[car], **(before | two[car])) for car in order]
        except (LookupError, TypeError, ValueError) as error:
            raise NotFound(f"The ladder has no race {match}.") from error
        if found.kind in TOGETHER:  # what stood there stood there for both, as whoever drove longer saw it
            road = max(cars, key=lambda car: len(car.trace)).objects
            cars = [car.model_copy(update={"objects": []}) for car in cars]
        track = document["track"]
    return replay_of(track, context.courses.load(track), cars, trial=0, objects=road, ghosts=ghosts)


def _title(contest: ContestDetail) -> str:
    return contest.title or " – ".join(contest.models)


def _placed(contest: ContestDetail) -> list[Placed]:
    """The result of a heat, the winner first.

    Raises:
        NotFound: It has none.
    """
    from racecraft.analysis.share_heat import Placed

    if not contest.heat:
        raise NotFound("The heat has no result to share.")
    return [
        Placed(car=row.car, name=row.name, place=row.place, score=row.score, best_lap=row.best, gap=row.gap)
        for row in contest.heat
    ]
