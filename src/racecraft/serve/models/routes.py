"""Models: the garage, new ones, training, and their files."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any, Final

from fastapi import APIRouter, Query, Response
from fastapi.responses import FileResponse

from racecraft.agent import Hyperparameters, ModelMetadata, action_space
from racecraft.errors import ConfigError
from racecraft.learn import PPOConfig
from racecraft.reward import load_preset, preset_names
from racecraft.run import RunFolder, read_stretches, stretch_at
from racecraft.run.history import read_history
from racecraft.run.starters import starter_names, unpack_starter
from racecraft.serve.conditions import randomization_of, vehicle_of
from racecraft.serve.context import (
    Computes,
    Context,
    InConsoles,
    InContext,
    InUser,
    MakesModel,
    TakesPlace,
    Trains,
)
from racecraft.serve.jobs.schemas import JobInfo, job_info
from racecraft.serve.models.again import again
from racecraft.serve.models.demonstration import demonstration, evolution
from racecraft.serve.models.garage import RACED, finite
from racecraft.serve.models.schemas import (
    CloneModel,
    Demonstration,
    Evolution,
    HistoryPage,
    ModelCard,
    ModelChange,
    ModelDetail,
    NewModel,
    TrainOn,
    Tuning,
)
from racecraft.serve.problems import Conflict, NotFound
from racecraft.serve.road import road_objects
from racecraft.sim import Objects
from racecraft.training import Until
from racecraft.training.opponents import SELF, Opponents
from racecraft.training.parent import open_parent
from racecraft.training.reached import is_reached
from racecraft.training.regimes import TIME_TRIAL
from racecraft.training.settings import TrainSettings, make_settings
from racecraft.training.start import read_settings, replace_reward, start_run

router = APIRouter(prefix="/api/models", tags=["models"])

FILES: Final = {".png": "image/png", ".mp4": "video/mp4", ".csv": "text/csv", ".json": "application/json"}
FOLDERS: Final = ("evaluation-", "mp4", "metrics")


@router.get("")
def list_models(context: InContext) -> list[ModelCard]:
    """The garage, newest first."""
    return context.garage.cards()


@router.post("", status_code=201, dependencies=[MakesModel])
def create_model(request: NewModel, context: InContext, consoles: InConsoles, user: InUser) -> ModelCard:
    """A new model from settings that may all be left out; training starts at once unless told otherwise."""
    if request.train:
        consoles.quotas.require(user, "places", "minutes")
    source = load_preset(request.reward) if request.reward in preset_names() else request.reward
    metadata = _metadata(request)
    parameters = None if request.hyperparameters is None else Hyperparameters.from_dict(request.hyperparameters)
    settings = make_settings(
        metadata=metadata,
        hyperparameters=parameters,
        track=[context.courses.path_or_name(name) for name in dict.fromkeys((request.track, *request.more_tracks))],
        direction=request.direction,
        network=request.network,
        vehicle="" if request.vehicle == "" else vehicle_of(request.vehicle),
        seed=request.seed,
        until=Until.parse(request.until),
        objects=_objects(request),
        opponents=_opponents(context, request),
        randomize=randomization_of(request.randomize),
        critic=request.critic,
        algorithm=request.algorithm or ("" if request.tuning is None else "ppo"),
    )
    if request.tuning is not None:
        if parameters is not None:
            raise ConfigError("tuning and hyperparameters both say how the policy improves; give one of them.")
        if settings.algorithm != "ppo":
            raise ConfigError(f"tuning is for ppo; the algorithm is {settings.algorithm!r}.")
        settings = replace(settings, ppo=_tuned(settings.ppo, request.tuning))
    if request.name is not None:
        context.garage.require_new(request.name)
    folder = start_run(
        settings,
        reward=source,
        metadata=metadata,
        hyperparameters=parameters,
        root=context.garage.runs,
        name=context.garage.new_name() if request.name is None else request.name,
        foreign=context.garage.is_foreign(source),
    )
    if request.train:
        _train(context, folder, until=None)
    context.mirror.copy(folder.name)
    card = context.garage.card(folder.name)
    if request.tags:
        context.garage.tag(folder.name, request.tags)
        card = card.model_copy(update={"tags": request.tags})
    return card


@router.post("/starters/{starter}", status_code=201, dependencies=[MakesModel])
def bring_starter(starter: str, context: InContext) -> ModelCard:
    """A policy that comes with Racecraft, as a model of one's own; the one there is, if it was brought before."""
    if starter not in starter_names():
        raise NotFound(f"There is no starter {starter[:80]!r}.")
    folder = unpack_starter(starter, context.garage.runs)
    context.mirror.copy(folder.name)
    return context.garage.card(folder.name)


@router.get("/{name}")
def get_model(name: str, context: InContext) -> ModelDetail:
    """A model, whole."""
    folder = context.garage.folder(name)
    card = context.garage.card(name)
    info = folder.read_info()
    parameters = folder.read_hyperparameters()
    jobs = [job for job in context.queue.list(run=name, limit=20) if job.kind == "train"]
    return ModelDetail(
        **card.model_dump(),
        reward=folder.read_reward_function(),
        model_metadata=folder.read_model_metadata().to_dict(),
        hyperparameters=parameters.to_dict() if parameters is not None else None,
        settings=finite(info.settings),
        seed=info.seed,
        checkpoints=context.garage.checkpoints(folder),
        stretches=context.garage.stretches(folder),
        job=job_info(jobs[0]) if jobs else None,
        notes=folder.read_notes(),
    )


@router.patch("/{name}")
def change_model(name: str, request: ModelChange, context: InContext) -> ModelCard:
    """Rename or tag a model, or write about it."""
    if request.notes is not None:
        context.garage.folder(name).write_notes(request.notes)
        context.mirror.copy(name)
    if request.tags is not None:
        context.garage.tag(name, request.tags)
    if request.name is not None and request.name != name:
        context.garage.rename(name, request.name)
        context.mirror.forget(name)
        name = request.name
        context.mirror.copy(name)
    return context.garage.card(name)


@router.delete("/{name}", status_code=204)
def delete_model(name: str, context: InContext) -> Response:
    """Put a model into the trash."""
    context.garage.remove(name)
    context.mirror.forget(name)
    return Response(status_code=204)


@router.post("/{name}/restore", dependencies=[MakesModel])
def restore_model(name: str, context: InContext) -> ModelCard:
    """Bring a deleted model back."""
    context.garage.restore(name)
    context.mirror.copy(name)
    return context.garage.card(name)


@router.post("/{name}/clone", status_code=201, dependencies=[MakesModel])
def clone_model(name: str, request: CloneModel, context: InContext) -> ModelCard:
    """A new model with the same settings, untrained, or a branch from one of its checkpoints."""
    folder = context.garage.folder(name)
    if request.name is not None:
        context.garage.require_new(request.name)
    settings, reward, metadata = read_settings(folder), folder.read_reward_function(), folder.read_model_metadata()
    hyperparameters, parent = folder.read_hyperparameters(), None
    if request.step is not None:
        parent = open_parent(f"{folder.path}@{request.step}")
        stretch = stretch_at(read_stretches(folder), request.step)
        reward, metadata = stretch.reward_function, ModelMetadata.from_dict(stretch.model_metadata)
        given = stretch.hyperparameters
        hyperparameters = None if given is None else Hyperparameters.from_dict(given)
        settings = TrainSettings.from_dict({**settings.to_dict(), **stretch.settings, "track": stretch.track})
    copy = start_run(
        settings,
        reward=reward,
        metadata=metadata,
        hyperparameters=hyperparameters,
        parent=parent,
        root=context.garage.runs,
        name=request.name or context.garage.name_beside(name),
        foreign=folder.read_info().foreign or context.garage.is_foreign(reward),
    )
    context.mirror.copy(copy.name)
    return context.garage.card(copy.name)


@router.post("/{name}/train", status_code=202, dependencies=[Trains])
def train_model(name: str, request: TrainOn, context: InContext) -> JobInfo:
    """Train a model, or go on training it, if wanted with a changed reward function."""
    folder = context.garage.folder(name)
    until = read_settings(folder).until if request.until is None else Until.parse(request.until)
    _require_idle(context, folder)
    if is_reached(folder, until, is_changed=request.reward is not None):
        card = context.garage.card(name)
        raise Conflict(
            f"Model {folder.name!r} has come as far as it is to go already, and would learn nothing.",
            hint="Say in the field when it is to end instead; steps and minutes count from its beginning, "
            f"{card.steps:,} and {card.seconds / 60:.1f} so far.",
        )
    if request.reward is not None:
        replace_reward(folder, request.reward, foreign=context.garage.is_foreign(request.reward))
    return _train(context, folder, until=request.until)


@router.post("/{name}/stop", status_code=202)
def stop_model(name: str, context: InContext) -> JobInfo:
    """Stop a model's training after the iteration under way; it is saved and can go on later."""
    job = context.queue.active(context.garage.folder(name).name)
    if job is None:
        raise Conflict(f"Model {name!r} is not being trained.")
    context.queue.cancel(job.id)
    return job_info(context.queue.get(job.id) or job)


@router.get("/{name}/again")
def get_again(name: str, context: InContext) -> NewModel:
    """What a model is made of, as the request for a new one."""
    return again(context.garage.folder(name), context.garage.card(name))


@router.get("/{name}/demonstration", dependencies=[Computes])
def get_demonstration(name: str, context: InContext, road: Annotated[int, Query(ge=0, lt=10_000)] = 0) -> Demonstration:
    """The lap that a model's best checkpoint drives on one of its roads, by number, among what it met there."""
    found = demonstration(context.garage.folder(name), road=road)
    if found is None:
        raise NotFound(f"Model {name!r} has no checkpoint, or no road {road}, to drive a lap.")
    return found


@router.get("/{name}/evolution", dependencies=[Computes])
def get_evolution(name: str, context: InContext) -> Evolution:
    """Laps of a model's training from one start, and where a film of them is."""
    folder = _of_one_road(context, name)
    return evolution(folder)


@router.post("/{name}/evolution", status_code=202, dependencies=[TakesPlace])
def film_evolution(name: str, context: InContext) -> JobInfo:
    """Film how a model learned."""
    job = context.queue.add("evolution", _of_one_road(context, name).name, {})
    context.supervisor.wake()
    return job_info(job)


@router.get("/{name}/history")
def get_history(name: str, context: InContext, offset: int = 0) -> HistoryPage:
    """Points of a training's curves from a byte offset on."""
    points, end = read_history(context.garage.folder(name).history, offset=offset)
    return HistoryPage(points=points, offset=end)


@router.get("/{name}/files/{path:path}")
def get_file(name: str, path: str, context: InContext) -> FileResponse:
    """A picture, video or log of a model."""
    folder = context.garage.folder(name)
    parts = Path(path).parts
    if not parts or ".." in parts or Path(path).is_absolute() or not parts[0].startswith(FOLDERS):
        raise NotFound(f"Model {name!r} has no file {path[:80]!r}.")
    file = folder.path.joinpath(*parts)
    kind = FILES.get(file.suffix)
    if kind is None or not file.is_file() or not file.resolve().is_relative_to(folder.path.resolve()):
        raise NotFound(f"Model {name!r} has no file {path[:80]!r}.")
    return FileResponse(file, media_type=kind)


def _of_one_road(context: Context, name: str) -> RunFolder:
    folder = context.garage.folder(name)
    if context.garage.card(name).num_tracks != 1:
        raise NotFound(f"Model {name!r} learned on several roads, and no one lap shows that.")
    return folder


def _train(context: Context, folder: RunFolder, *, until: str | None) -> JobInfo:
    _require_idle(context, folder)
    cargo = context.mirror.share_training(folder)
    job = context.queue.add("train", folder.name, {"until": until}, cargo=cargo)
    context.supervisor.wake()
    return job_info(job)


def _require_idle(context: Context, folder: RunFolder) -> None:
    if context.queue.active(folder.name) is not None:
        raise Conflict(f"Model {folder.name!r} is being trained already.")


def _metadata(request: NewModel) -> ModelMetadata:
    if request.model_metadata is None:
        sensors = tuple(request.sensors or TIME_TRIAL.sensors)
        return ModelMetadata(
            action_space=action_space(request.actions), sensors=sensors, neural_network="RACECRAFT_SMALL"
        )
    if request.sensors is not None:
        raise ConfigError("sensors and model_metadata both name sensors; give one of them.")
    return ModelMetadata.from_dict(request.model_metadata)


def _opponents(context: Context, request: NewModel) -> Opponents | None:
    if request.race != RACED:
        if request.opponents or request.cars is not None:
            raise ConfigError(f"opponents and cars go with the race {RACED}; this one is a {request.race}.")
        return None
    drivers = tuple(str(context.garage.folder(name).path.resolve()) for name in request.opponents)
    return Opponents(drivers=drivers or (SELF,), cars=request.cars or 2)


def _objects(request: NewModel) -> Objects:
    race = "time-trial" if request.race == RACED else request.race
    if race == "time-trial" and request.objects is not None and request.race != RACED:
        raise ConfigError("objects go with the races object-avoidance and head-to-bot; this one is a time-trial.")
    return road_objects(request, race, count=request.objects, placement="random")


def _tuned(ppo: PPOConfig, tuning: Tuning) -> PPOConfig:
    changes: dict[str, Any] = {
        "learning_rate": tuning.lr,
        "ent_coef": tuning.beta_entropy,
        "gamma": tuning.discount_factor,
        "update_epochs": tuning.num_epochs,
        "minibatch_size": tuning.batch_size,
        "value_loss": None if tuning.loss_type is None else "huber" if tuning.loss_type == "huber" else "mse",
    }
    return replace(ppo, **{name: value for name, value in changes.items() if value is not None})
