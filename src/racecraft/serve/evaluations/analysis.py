"""What a run's files say: laps and corners of an evaluation, maps of a training, saliency, the report."""

from __future__ import annotations

import base64
import math
import tempfile
from functools import lru_cache
from pathlib import Path
from typing import Any, Final, Literal

import numpy as np
from fastapi import APIRouter, Query, Response
from numpy.typing import NDArray

from racecraft.analysis import (
    TracedLap,
    draw_maps,
    driven_direction,
    iterations_of,
    passages,
    read_laps,
    sectors_of,
    start_place,
)
from racecraft.errors import ConfigError, RacecraftError, TrackNotFound
from racecraft.json_file import read_json_object
from racecraft.judging.trained import is_road_of, trained_camera, trained_title, trained_tracks
from racecraft.learn import Learner
from racecraft.race.policy import WEIGHTS, load_policy
from racecraft.race.seeing import explain
from racecraft.run import RunFolder
from racecraft.serve.context import Computes, Context, InContext
from racecraft.serve.evaluations.objects import MAX_SHOWN, objects_of
from racecraft.serve.evaluations.paid import rewards_of
from racecraft.serve.evaluations.schemas import (
    EvaluationLaps,
    LapPassage,
    LapTrace,
    RoadObject,
    SaliencyPicture,
    TrainingMaps,
)
from racecraft.serve.problems import Conflict, NotFound
from racecraft.serve.tracks.schemas import TrackSector
from racecraft.sim.camera import CameraSpec
from racecraft.sim.views import driver_frames
from racecraft.track import Track, load_tracks

HTML: Final[dict[int | str, dict[str, Any]]] = {200: {"content": {"text/html": {}}}}
PNG: Final[dict[int | str, dict[str, Any]]] = {200: {"content": {"image/png": {}}}}
router = APIRouter(prefix="/api/models/{name}", tags=["analysis"])

MAX_FILES: Final = 24
"""Iterations that one map is drawn from; of more, every so many-th."""


@router.get("/evaluations/{stamp}/laps", dependencies=[Computes])
def get_laps(name: str, stamp: str, context: InContext) -> EvaluationLaps:
    """An evaluation's laps, step by step, and what each took for every sector of the track."""
    folder = context.garage.folder(name)
    track = evaluation_track(context, folder, stamp)
    trace = trace_of(folder, stamp)
    laps = read_laps(trace)
    driven = driven_direction(track, [lap.points for lap in laps])
    sectors = sectors_of(driven)
    objects = objects_of(folder, stamp, laps)
    reward, paid = rewards_of(folder, stamp, driven, trace, laps)
    return EvaluationLaps(
        reward=reward,
        track=track.name,
        length=track.length,
        is_reversed=driven is not track,
        sectors=[TrackSector.of(sector) for sector in sectors],
        laps=[
            _lap(
                driven,
                lap,
                [_passage(p) for p in passages(driven, lap, sectors)],
                paid.get(lap.number, [None] * len(lap.time)),
                objects.get(lap.number, []),
            )
            for lap in laps
        ],
    )


@router.get("/evaluations/{stamp}/saliency", dependencies=[Computes])
def get_saliency(
    name: str,
    stamp: str,
    context: InContext,
    lap: int = Query(ge=1, le=10**6),
    row: int = Query(ge=0, le=10**6),
    target: int | None = Query(None, ge=0, le=99),
) -> SaliencyPicture:
    """What the policy looked at in one step of a lap: its camera's image drawn anew, and Grad-CAM over it."""
    folder = context.garage.folder(name)
    track = evaluation_track(context, folder, stamp)
    found = next((traced for traced in read_laps(trace_of(folder, stamp)) if traced.number == lap), None)
    if found is None or row >= len(found.time):
        raise NotFound(f"Evaluation {stamp} of {name!r} has no step {row} in lap {lap}.")
    summary = read_json_object(folder.evaluation(stamp) / "evaluation.json")
    step, learner = _network(folder, summary.get("step"))
    spec = learner.spec
    driven, camera = driven_direction(track, [found.points]), lens_of(folder)
    frame = driver_frames(driven, [found.seen_from(camera.age)[row]], camera)[0]
    if target is not None and target >= spec.num_actions:
        raise NotFound(f"The policy of {name!r} has no output {target}; allowed are 0 to {spec.num_actions - 1}.")
    seen = explain(learner, frame, target=target)
    outputs = seen.outputs.astype(float)
    shares = np.exp(outputs - outputs.max()) if spec.is_discrete else outputs.clip(-1.0, 1.0)
    return SaliencyPicture(
        method="Grad-CAM",
        layer=seen.layer,
        step=step,
        height=frame.shape[0],
        width=frame.shape[1],
        frame=base64.b64encode(frame.tobytes()).decode(),
        saliency=base64.b64encode((seen.picture * 255).round().astype(np.uint8).tobytes()).decode(),
        policy=(shares / shares.sum() if spec.is_discrete else shares).round(5).tolist(),
        target=seen.target,
        is_discrete=spec.is_discrete,
    )


@router.get("/maps", dependencies=[Computes])
def get_maps(
    name: str,
    context: InContext,
    first: int = Query(0, ge=0, le=10**9),
    last: int = Query(10**9, ge=0, le=10**9),
) -> TrainingMaps:
    """Rewards, speeds, actions and exits of a training on its track, of the iterations from `first` to `last`."""
    folder = context.garage.folder(name)
    track = _trained_road(folder)
    iterations = iterations_of(folder.training_simtrace)
    wanted = [iteration for iteration in iterations if first <= iteration <= last]
    if len(wanted) > MAX_FILES:
        wanted = [wanted[index] for index in np.linspace(0, len(wanted) - 1, MAX_FILES).round().astype(int)]
    maps = draw_maps(track, folder.training_simtrace, wanted)
    return TrainingMaps(
        iterations=iterations,
        shown=wanted,
        episodes=maps.episodes,
        rows=maps.rows,
        grid=maps.grid.round(3).tolist(),
        visits=maps.visits.tolist(),
        reward=_known(maps.reward),
        speed=_known(maps.speed),
        steering=_known(maps.steering_angle),
        action=maps.action.tolist(),
        usage=maps.usage.round(5).tolist(),
        exits=maps.exits.round(3).tolist(),
    )


@router.get(
    "/report", response_class=Response, responses={200: {"content": {"text/html": {}}}}, dependencies=[Computes]
)
def get_report(name: str, context: InContext) -> Response:
    """The run's report: one HTML file that needs nothing else."""
    from racecraft.analysis import report

    folder = context.garage.folder(name)
    _trained_road(folder)
    headers = {"Content-Disposition": f'attachment; filename="{folder.name}-report.html"'}
    return Response(report(folder), media_type="text/html", headers=headers)


@router.get(
    "/evaluations/{stamp}/share.html",
    response_class=Response,
    responses={200: {"content": {"text/html": {}}}},
    dependencies=[Computes],
)
def get_share(name: str, stamp: str, context: InContext, language: Literal["en", "de"] = "en") -> Response:
    """An evaluation's best lap as one HTML file that opens offline, with the replay inside."""
    from racecraft.analysis.share import share

    folder = context.garage.folder(name)
    trace_of(folder, stamp)
    headers = {"Content-Disposition": f'attachment; filename="{folder.name}.html"'}
    return Response(
        share(folder, stamp, language=language, max_numbers=MAX_SHOWN), media_type="text/html", headers=headers
    )


@router.get(
    "/evaluations/{stamp}/share.png",
    response_class=Response,
    responses={200: {"content": {"image/png": {}}}},
    dependencies=[Computes],
)
def get_picture(name: str, stamp: str, context: InContext, language: Literal["en", "de"] = "en") -> Response:
    """The same lap as a picture: racing line, time, medal."""
    from racecraft.analysis.share import draw_share

    folder = context.garage.folder(name)
    trace_of(folder, stamp)
    with tempfile.TemporaryDirectory() as place:
        path = Path(place) / "share.png"
        data = draw_share(folder, stamp, path, language=language, max_numbers=MAX_SHOWN).read_bytes()
    headers = {"Content-Disposition": f'attachment; filename="{folder.name}.png"'}
    return Response(data, media_type="image/png", headers=headers)


def trace_of(folder: RunFolder, stamp: str) -> Path:
    """An evaluation's sim-trace.

    Raises:
        NotFound: There is no such evaluation.
    """
    path = folder.evaluation(stamp) / "evaluation-simtrace" / "0-iteration.csv"
    if not (stamp.isascii() and stamp.isdigit()) or not path.is_file():
        raise NotFound(f"Model {folder.name!r} has no evaluation {stamp[:40]!r}.")
    return path


def evaluation_track(context: Context, folder: RunFolder, stamp: str) -> Track:
    """Where an evaluation was driven.

    Raises:
        NotFound: There is no such evaluation, or its track is gone.
        Conflict: There is another by that name now.
    """
    trace_of(folder, stamp)
    summary, info = read_json_object(folder.evaluation(stamp) / "evaluation.json"), folder.read_info()
    name = str(summary.get("track", ""))
    try:
        trained = load_tracks(info.track)
    except TrackNotFound:
        trained = ()
    try:
        track = next((track for track in trained if track.name == name), None) or context.courses.load(name)
    except TrackNotFound as error:
        raise NotFound(f"The track {name!r} is not there any more.") from error
    if not is_road_of(summary, info, track):
        raise Conflict(
            f"The track {name!r} was changed since this model was evaluated on it.", hint="Train a new model on it."
        )
    return track


def lens_of(folder: RunFolder) -> CameraSpec:
    """What the model sees through; of a stereo camera the left lens."""
    return folder.read_model_metadata().suite.camera(trained_camera(folder.read_info())).left_lens


def _trained_road(folder: RunFolder) -> Track:
    """The first track of a training."""
    info = folder.read_info()
    try:
        return trained_tracks(info)[0]
    except TrackNotFound as error:
        raise NotFound(f"The track {trained_title(info)!r} is not there any more.") from error
    except ConfigError as error:
        raise Conflict(
            f"The track {trained_title(info)!r} was changed since this model was trained on it.",
            hint="Train a new model on it.",
        ) from error


@lru_cache(maxsize=4)
def _loaded(folder: Path, checkpoint: int | str, _: str) -> tuple[int, Learner]:
    step, policy = load_policy(RunFolder(folder), checkpoint=checkpoint, num_threads=1)
    return step, policy.learner


def _network(folder: RunFolder, step: Any) -> tuple[int, Learner]:
    """The network that drove an evaluation, or the best there is where its checkpoint is no longer kept."""
    entries = folder.checkpoints.entries()
    kept: int | str = step if any(entry.step == step for entry in entries) else "best"
    mark = ",".join(entry.file for entry in entries)
    try:
        return _loaded(folder.path, kept, mark)
    except RacecraftError:
        raise
    except (KeyError, ValueError) as error:
        raise NotFound(f"Model {folder.name!r} has no checkpoint that can be read ({WEIGHTS}).") from error


def _lap(
    track: Track, lap: TracedLap, through: list[LapPassage | None], paid: list[float | None], objects: list[RoadObject]
) -> LapTrace:
    return LapTrace(
        number=lap.number,
        status=lap.status,
        is_complete=lap.is_complete,
        seconds=round(lap.seconds, 3),
        penalty_seconds=round(lap.penalty_seconds, 3),
        start=round(start_place(track, lap), 3),
        time=lap.time.round(4).tolist(),
        share=lap.share.round(5).tolist(),
        x=lap.points[:, 0].round(4).tolist(),
        y=lap.points[:, 1].round(4).tolist(),
        heading=lap.heading.round(4).tolist(),
        speed=lap.speed.round(4).tolist(),
        throttle=lap.throttle.round(4).tolist(),
        steering=lap.steering_angle.round(5).tolist(),
        puts=list(lap.puts),
        reward=paid,
        objects=objects,
        passages=through,
    )


def _passage(passage: Any) -> LapPassage | None:
    if passage is None:
        return None
    return LapPassage(
        seconds=round(passage.seconds, 4),
        entry_speed=round(passage.entry_speed, 3),
        slowest=round(passage.slowest, 3),
        exit_speed=round(passage.exit_speed, 3),
    )


def _known(values: NDArray[np.float64]) -> list[list[float | None]]:
    return [[round(value, 5) if math.isfinite(value) else None for value in row] for row in values.tolist()]
