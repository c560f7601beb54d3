"""Searches for better numbers of a model."""

from __future__ import annotations

from fastapi import APIRouter, Response

from racecraft.serve.context import InContext, MakesModel, Trains
from racecraft.serve.jobs.schemas import JobInfo, job_info
from racecraft.serve.models.schemas import ModelCard
from racecraft.serve.tuning.schemas import KeepTrial, NewTuning, TunableNumber, TuningCard

router = APIRouter(prefix="/api/models/{name}/tunings", tags=["tunings"])


@router.get("")
def list_tunings(name: str, context: InContext) -> list[TuningCard]:
    """A model's searches, newest first."""
    return context.tunings.cards(name)


@router.get("/space")
def get_tuning_space(name: str, context: InContext) -> list[TunableNumber]:
    """Everything that may be searched, and between which bounds it usually is."""
    return context.tunings.space(name)


@router.post("", status_code=202, dependencies=[Trains])
def start_tuning(name: str, request: NewTuning, context: InContext) -> JobInfo:
    """Search better numbers for a model by short trainings; the model itself stays as it is."""
    job = context.tunings.start(name, request)
    context.supervisor.wake()
    return job_info(job)


@router.post("/{tuning}/keep", status_code=201, dependencies=[MakesModel])
def keep_trial(name: str, tuning: str, request: KeepTrial, context: InContext) -> ModelCard:
    """Make a model of a trial, the best one by default."""
    fresh = context.tunings.keep(name, tuning, request)
    context.mirror.copy(fresh)
    return context.garage.card(fresh)


@router.delete("/{tuning}", status_code=204)
def delete_tuning(name: str, tuning: str, context: InContext) -> Response:
    """Remove a search with its trials; models that were made of them stay."""
    context.tunings.remove(name, tuning)
    return Response(status_code=204)
