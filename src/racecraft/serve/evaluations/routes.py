"""Evaluations: races against the clock, their laps, video and telemetry."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any, Final

from fastapi import APIRouter

from racecraft.checks import is_number
from racecraft.errors import RacecraftError
from racecraft.json_file import read_json_object
from racecraft.race.rules import RULE_SETS, RaceRules
from racecraft.run import RunFolder
from racecraft.serve.conditions import told_randomization, told_vehicle
from racecraft.serve.context import InContext, TakesPlace
from racecraft.serve.evaluations.asked import settle
from racecraft.serve.evaluations.schemas import EvaluateModel, EvaluationCard, EvaluationTerms, Telemetry
from racecraft.serve.jobs.schemas import JobInfo, job_info
from racecraft.serve.problems import NotFound
from racecraft.sim.objects import Objects
from racecraft.sim.randomization import Randomization
from racecraft.sim.vehicle import Vehicle

router = APIRouter(prefix="/api/models/{name}/evaluations", tags=["evaluations"])


def _number(text: str) -> float:
    value = float(text)
    if not is_number(value):
        raise ValueError(f"{text[:40]!r} is no number")
    return value


COLUMNS: Final[dict[str, Callable[[str], float | str]]] = {
    "episode": int,
    "steps": _number,
    "X": _number,
    "Y": _number,
    "yaw": _number,
    "steer": _number,
    "throttle": _number,
    "reward": _number,
    "progress": _number,
    "tstamp": _number,
    "episode_status": str,
}
MAX_ROWS: Final = 60_000


@router.get("")
def list_evaluations(name: str, context: InContext) -> list[EvaluationCard]:
    """A model's evaluations, newest first."""
    folder = context.garage.folder(name)
    found = []
    for path in sorted(folder.path.glob("evaluation-*/evaluation.json"), reverse=True)[:200]:
        try:
            found.append(_card(folder, path))
        except (RacecraftError, KeyError, TypeError, ValueError):  # a file of it says something else than it should
            continue
    return found


@router.post("", status_code=202, dependencies=[TakesPlace])
def evaluate_model(name: str, request: EvaluateModel, context: InContext) -> JobInfo:
    """Race a model against the clock."""
    folder = context.garage.folder(name)
    if request.rules not in RULE_SETS:
        raise NotFound(f"There are no rules {request.rules[:40]!r}; allowed are {', '.join(RULE_SETS)}.")
    info = folder.read_info()
    payload = settle(request, info)
    if request.track is not None:
        payload["track"] = context.courses.path_or_name(request.track)
    road = payload.get("track") or info.track
    cargo = context.mirror.share(folder, tracks=(road,))
    job = context.queue.add("evaluate", folder.name, payload, cargo=cargo)
    context.supervisor.wake()
    return job_info(job)


@router.get("/{stamp}/telemetry")
def get_telemetry(name: str, stamp: str, context: InContext) -> Telemetry:
    """Every step of an evaluation, as columns named as AWS names them; as far as its file can be read."""
    folder = context.garage.folder(name)
    path = folder.evaluation(stamp) / "evaluation-simtrace" / "0-iteration.csv"
    if not (stamp.isascii() and stamp.isdigit()) or not path.is_file():
        raise NotFound(f"Model {name!r} has no evaluation {stamp[:40]!r}.")
    columns: dict[str, list[Any]] = {column: [] for column in COLUMNS}
    with suppress(OSError, ValueError, IndexError), path.open(encoding="utf-8") as file:
        header = file.readline().strip().split(",")
        places = {column: header.index(column) for column in COLUMNS}
        for number, line in enumerate(file):
            if number >= MAX_ROWS:
                break
            cells = line.rstrip("\n").split(",")
            row = {column: kind(cells[places[column]]) for column, kind in COLUMNS.items()}
            for column, value in row.items():
                columns[column].append(value)
    return Telemetry(columns=columns)


def _card(folder: RunFolder, path: Path) -> EvaluationCard:
    stamp = path.parent.name.removeprefix("evaluation-")
    summary = read_json_object(path)
    conditions = summary.pop("conditions", None)
    metrics = folder.evaluation_metrics(stamp)
    laps = read_json_object(metrics)["metrics"] if metrics.is_file() else []
    picture, commands = path.parent / "racing-line.png", path.parent / "as-car.png"
    trace = path.parent / "evaluation-simtrace" / "0-iteration.csv"
    return EvaluationCard(
        stamp=stamp,
        track=str(summary.get("track", "")),
        summary=summary,
        laps=laps,
        picture=f"{path.parent.name}/{picture.name}" if picture.is_file() else None,
        video=summary.get("video"),
        telemetry=stamp if trace.is_file() else None,
        as_car="as_car" in summary,
        held=None if conditions is None else _terms(conditions),
        commands=f"{path.parent.name}/{commands.name}" if commands.is_file() else None,
    )


def _terms(conditions: dict[str, Any]) -> EvaluationTerms:
    """What a summary says of how it was driven."""
    return EvaluationTerms(
        rules=RaceRules.from_dict(conditions["rules"]).to_dict(),
        objects=Objects.from_dict(conditions["objects"]).to_dict(),
        vehicle=told_vehicle(Vehicle(**conditions["vehicle"])),
        randomize=told_randomization(Randomization(**conditions["randomize"])),
        seed=conditions["seed"],
    )
