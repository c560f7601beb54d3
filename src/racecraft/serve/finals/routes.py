"""A league's finals: begun by organisers, looked at by everybody who may."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Path, Request
from fastapi.responses import FileResponse

from racecraft.replay.replay import read_replay
from racecraft.serve.context import Computes, InConsoles, InLeague, InPerson
from racecraft.serve.finals.schemas import FinalPage
from racecraft.serve.problems import Conflict
from racecraft.serve.races.replays import car_of, replay_of, road_of
from racecraft.serve.races.schemas import RaceReplay
from racecraft.serve.submissions.routes import OPEN_GRAIN

router = APIRouter(prefix="/api", tags=["league"])

Id = Annotated[int, Path(ge=0, lt=2**31)]
Number = Annotated[int, Path(ge=0, lt=1000)]


@router.post("/league/races/{race_id}/hold", status_code=202)
def hold_final(race_id: Id, consoles: InConsoles, person: InPerson) -> FinalPage:
    """Have a final driven by the first of its qualifying."""
    consoles.finals.hold(race_id, user_id=person.id)
    consoles.owner.supervisor.wake()
    return consoles.finals.page(race_id, user_id=person.id)


@router.get("/boards/{race_id}/final")
def get_final(race_id: Id, request: Request, consoles: InLeague) -> FinalPage:
    """A final as far as it is decided: who drives, and all duels."""
    return consoles.finals.page(race_id, user_id=request.state.user_id)


@router.get("/boards/{race_id}/duels/{duel}/heats/{heat}/film", dependencies=[Computes])
def get_duel_film(race_id: Id, duel: Number, heat: Number, request: Request, consoles: InLeague) -> RaceReplay:
    """A heat as soon as its duel is decided; its poses are rounded until the final is over."""
    path, is_over = consoles.finals.heat(race_id, duel, heat, user_id=request.state.user_id)
    recordings = [trial.recording for trial in read_replay(path).cars]
    grain = 1 if is_over else OPEN_GRAIN
    cars = [
        car_of(seed, name, recording, grain=grain, is_alone=False)
        for (seed, name), recording in zip(consoles.finals.racers(race_id, duel, heat), recordings, strict=True)
    ]
    name, track = consoles.league.track(race_id)
    return replay_of(name, track, cars, trial=heat, is_coarse=not is_over, objects=road_of(*recordings))


@router.get("/boards/{race_id}/duels/{duel}/heats/{heat}/replay")
def get_duel_replay(race_id: Id, duel: Number, heat: Number, request: Request, consoles: InLeague) -> FileResponse:
    """The replay file of a heat, for `racecraft verify`, once the final is over."""
    path, is_over = consoles.finals.heat(race_id, duel, heat, user_id=request.state.user_id)
    if not is_over:
        raise Conflict("Replays are published when the race is over; until then there is the film.")
    return FileResponse(path, media_type="application/octet-stream", filename=f"{race_id}-{duel}-{heat}.replay")
