"""deepracer-for-cloud's ``DR_`` settings: what each becomes here, or why it becomes nothing.

Names: deepracer-for-cloud, docs/reference.md and defaults/*.env of 2020 to 2026.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache
from typing import Annotated, Any, Final

from pydantic import Field

from racecraft.agent.aws_file import AwsModel, Number, Whole, file_model, validate
from racecraft.errors import SourceError, did_you_mean
from racecraft.importing.env_file import EnvFile, EnvSetting, parse_env
from racecraft.importing.layout import (
    CUSTOM_FILES,
    HYPERPARAMETERS,
    METADATA,
    REWARD,
    RUN_ENV,
    find_root,
    is_of_others,
)
from racecraft.importing.source import Source
from racecraft.race.rules import RULE_SETS, RaceRules
from racecraft.run.training_params import TrainingParams

TRAINING: Final = {
    "DR_WORLD_NAME": "world_name",
    "DR_RACE_TYPE": "race_type",
    "DR_ENABLE_DOMAIN_RANDOMIZATION": "enable_domain_randomization",
    "DR_TRAIN_REVERSE_DIRECTION": "reverse_dir",
    "DR_TRAIN_ALTERNATE_DRIVING_DIRECTION": "alternate_driving_direction",
    "DR_TRAIN_CHANGE_START_POSITION": "change_start_position",
    "DR_TRAIN_ROUND_ROBIN_ADVANCE_DIST": "round_robin_advance_dist",
    "DR_TRAIN_START_POSITION_OFFSET": "start_position_offset",
    "DR_TRAIN_MIN_EVAL_TRIALS": "min_eval_trials",
    "DR_TRAIN_BEST_MODEL_METRIC": "best_model_metric",
}
"""Settings of the training job, and the field of `TrainingParams` that each is."""

EVALUATION: Final = {
    "DR_EVAL_NUMBER_OF_TRIALS": "laps",
    "DR_EVAL_IS_CONTINUOUS": "is_continuous",
    "DR_EVAL_MAX_RESETS": "max_resets",
    "DR_EVAL_OFF_TRACK_PENALTY": "offtrack_penalty",
    "DR_EVAL_COLLISION_PENALTY": "collision_penalty",
    "DR_EVAL_REVERSE_DIRECTION": "is_reverse",
}
"""Settings of an evaluation, and the rule of a race that each is."""

FILES: Final = {
    "DR_LOCAL_S3_REWARD_KEY": REWARD,
    "DR_LOCAL_S3_MODEL_METADATA_KEY": METADATA,
    "DR_LOCAL_S3_HYPERPARAMETERS_KEY": HYPERPARAMETERS,
}
"""Settings that say which file of ``custom_files`` is meant: what follows their first part counts."""

CUSTOM_PREFIX: Final = "DR_LOCAL_S3_CUSTOM_FILES_PREFIX"
"""Which folder the files of a model are taken from, where there are several: deepracer-on-the-spot keeps them so."""
MODEL_PREFIX: Final = "DR_LOCAL_S3_MODEL_PREFIX"
PRETRAINED: Final = "DR_LOCAL_S3_PRETRAINED"
PRETRAINED_PREFIX: Final = "DR_LOCAL_S3_PRETRAINED_PREFIX"
PRETRAINED_CHECKPOINT: Final = "DR_LOCAL_S3_PRETRAINED_CHECKPOINT"
PRETRAINING: Final = (PRETRAINED, PRETRAINED_PREFIX, PRETRAINED_CHECKPOINT)
"""Whether a model goes on from another one's weights, that one's name, and which of its checkpoints."""

ALIASES: Final = {
    "DR_CHANGE_START_POSITION": "DR_TRAIN_CHANGE_START_POSITION",
    "DR_ALTERNATE_DRIVING_DIRECTION": "DR_TRAIN_ALTERNATE_DRIVING_DIRECTION",
    "DR_TRAIN_ROUND_ROBIN_ADVANCE_DISTANCE": "DR_TRAIN_ROUND_ROBIN_ADVANCE_DIST",
    "DR_EVAL_NUMBER_OF_RESETS": "DR_EVAL_MAX_RESETS",
    "DR_COLLISION_PENALTY": "DR_EVAL_COLLISION_PENALTY",
}
"""Other names that some versions used; the proper one counts where both are given."""

OBJECTS: Final = {
    "DR_OA_NUMBER_OF_OBSTACLES": "NUMBER_OF_OBSTACLES",
    "DR_OA_MIN_DISTANCE_BETWEEN_OBSTACLES": "MIN_DISTANCE_BETWEEN_OBSTACLES",
    "DR_OA_RANDOMIZE_OBSTACLE_LOCATIONS": "RANDOMIZE_OBSTACLE_LOCATIONS",
    "DR_OA_IS_OBSTACLE_BOT_CAR": "IS_OBSTACLE_BOT_CAR",
    "DR_OA_OBSTACLE_TYPE": "OBSTACLE_TYPE",
    "DR_OA_OBJECT_POSITIONS": "OBJECT_POSITIONS",
    "DR_H2B_NUMBER_OF_BOT_CARS": "NUMBER_OF_BOT_CARS",
    "DR_H2B_BOT_CAR_SPEED": "BOT_CAR_SPEED",
    "DR_H2B_IS_LANE_CHANGE": "IS_LANE_CHANGE",
    "DR_H2B_LOWER_LANE_CHANGE_TIME": "LOWER_LANE_CHANGE_TIME",
    "DR_H2B_UPPER_LANE_CHANGE_TIME": "UPPER_LANE_CHANGE_TIME",
    "DR_H2B_LANE_CHANGE_DISTANCE": "LANE_CHANGE_DISTANCE",
    "DR_H2B_MIN_DISTANCE_BETWEEN_BOT_CARS": "MIN_DISTANCE_BETWEEN_BOT_CARS",
    "DR_H2B_RANDOMIZE_BOT_CAR_LOCATIONS": "RANDOMIZE_BOT_CAR_LOCATIONS",
    "DR_H2B_BOT_CAR_PENALTY": "BOT_CAR_PENALTY",
}
"""Obstacles and bot cars, and what AWS calls them in ``training_params.yaml``."""

NO_EFFECT: Final = {
    "DR_CAR_*": "looks and names do not change the driving",
    "DR_DISPLAY_NAME": "looks and names do not change the driving",
    "DR_RACER_NAME": "looks and names do not change the driving",
    "DR_EVAL_CHECKPOINT": "say it with racecraft evaluate --checkpoint last; best is the default",
    "DR_EVAL_SAVE_MP4": "racecraft evaluate films by itself",
    "DR_EVAL_DEBUG_REWARD": "an evaluation sums AWS's default reward",
    "DR_EVAL_RESET_BEHIND_DIST": "there is nothing on the track to be put behind",
    "DR_EVAL_OPP_*": "there are no opponents in an evaluation",
    "DR_*_RTF": "the simulator runs as fast as it can",
    "DR_TARGET_REWARD_SCORE": "hyperparameters.json has it as term_cond_avg_score",
    "DR_TRAIN_MAX_STEPS_PER_ITERATION": "an iteration has 10,000 steps at the most",
    "DR_TRAIN_MULTI_CONFIG": "all cars drive on one track; worker-*.env files are not read",
    "DR_WORKERS": "cars drive side by side in one process: racecraft train --num-envs",
    "DR_RUN_ID": "runs do not share a machine's ports",
    "DR_EXPERIMENT_NAME": "import the experiment's own folder",
    "DR_LOCAL_S3_*": "there is no S3 here",
    "DR_LOCAL_ACCESS_KEY_ID": "there is no S3 here",
    "DR_LOCAL_SECRET_ACCESS_KEY": "there is no S3 here",
    "DR_UPLOAD_*": "nothing is uploaded",
    "DR_REMOTE_*": "there is no S3 here",
    "DR_CLOUD*": "there is no cloud here",
    "DR_AWS_*": "there is no cloud here",
    "DR_KINESIS_*": "there is no cloud here",
    "DR_TELEGRAF_*": "metrics go into the run folder",
    "DR_CAMERA_*": "racecraft evaluate films by itself",
    "DR_ENABLE_EXTRA_KVS_OVERLAY": "racecraft evaluate films by itself",
    "DR_GAZEBO_ARGS": "there is no Gazebo here",
    "DR_GUI_ENABLE": "there is no Gazebo here",
    "DR_WEBVIEWER_PORT": "there is no Gazebo here",
    "DR_ROBOMAKER_*": "there are no containers here",
    "DR_SAGEMAKER_*": "there are no containers here",
    "DR_SIMAPP_*": "there are no containers here",
    "DR_MINIO_*": "there are no containers here",
    "DR_ANALYSIS_*": "there are no containers here",
    "DR_COACH_*": "there are no containers here",
    "DR_DOCKER_*": "there are no containers here",
    "DR_DISPLAY": "there are no containers here",
    "DR_HOST_X": "there are no containers here",
    "DR_QUIET_ACTIVATE": "there is no shell to set up",
    "CUDA_VISIBLE_DEVICES": "the simulator needs no GPU",
}
"""Known settings without a meaning here, and why; ``*`` stands for anything."""


@dataclass(frozen=True)
class DrfcSettings:
    """What ``run.env`` and ``system.env`` say to Racecraft."""

    params: TrainingParams
    """The training job; obstacles and bots are in its ``extra``."""
    given: dict[str, str]
    """Fields of `params` and of its ``extra`` that were given, and as what: ``DR_WORLD_NAME=reinvent_base``."""
    rules: RaceRules | None
    """Rules of its evaluations, where some are given; the direction is forward unless the file says otherwise."""
    rules_given: dict[str, str]
    """Rules that were given, and as what."""
    files: dict[str, str]
    """Which file of ``custom_files`` stands for which of ours; perhaps its last part alone is what lies there."""
    used: dict[str, str]
    """Other settings that have a meaning, and what each becomes."""
    prefix: str
    """Name of the model; empty where it is not given."""
    pretrained: str
    """Name of the model whose weights it was to go on from; empty where there is none."""
    pretraining: tuple[str, ...]
    """The settings that say so, as they were given."""
    pretrained_checkpoint: str
    """Which of them: ``best`` or ``last``."""
    without_effect: dict[str, str]
    """Known settings that mean nothing here, and why."""
    unknown: dict[str, str]
    """Other settings, and a suggestion or an empty string."""
    notes: tuple[str, ...]


def read_drfc(env: EnvFile, *, name: str) -> DrfcSettings:
    """Sort the settings of a deepracer-for-cloud folder by what they mean here.

    Args:
        env: ``system.env`` and ``run.env`` together.
        name: What messages call them.

    Raises:
        ConfigError: A setting that has a meaning here has a value that is not allowed.
    """
    settings, notes = _renamed(env)
    meant = (*TRAINING, *EVALUATION, *OBJECTS, MODEL_PREFIX, *PRETRAINING)
    unresolved = {key: setting for key, setting in settings.items() if setting.is_variable and key in meant}
    notes += [
        f"{key}={s.value} names a variable, which is not resolved; its default counts." for key, s in unresolved.items()
    ]
    values = {key: s.value for key, s in settings.items() if key not in unresolved and s.value not in ("", "None")}
    params, given = _params(values, name=name)
    rules, rules_given = _rules(values, name=name)
    without_effect, unknown = _others(settings)
    files, used = _files(values)
    without_effect.update(
        {key: "not given: its default counts" for key in meant if key in settings and not values.get(key)}
    )
    for key in unresolved:
        del without_effect[key]
    if MODEL_PREFIX in values:
        used[f"{MODEL_PREFIX}={values[MODEL_PREFIX]}"] = "name of the run, and of the folder of its history"
    pretrained = values.get(PRETRAINED_PREFIX, "") if values.get(PRETRAINED, "").lower() == "true" else ""
    why = "counts until the model has weights of its own" if pretrained else "there is no other model to go on from"
    without_effect.update({f"{key}={values[key]}": why for key in PRETRAINING if key in values})
    return DrfcSettings(
        params=params,
        given=given,
        rules=rules,
        rules_given=rules_given,
        files=files,
        used=used,
        prefix=values.get(MODEL_PREFIX, ""),
        pretrained=pretrained,
        pretraining=tuple(f"{key}={values[key]}" for key in PRETRAINING if key in values),
        pretrained_checkpoint="best" if values.get(PRETRAINED_CHECKPOINT) == "best" else "last",
        without_effect=without_effect,
        unknown=unknown,
        notes=tuple(notes),
    )


def root_of(source: Source) -> str:
    """The folder of the model, see `find_root`; of several in ``custom_files`` the one that run.env names is meant.

    Raises:
        SourceError: There are several models, or nothing that is understood.
    """
    try:
        return find_root(source.files, source=source.title)
    except SourceError:
        root = _root_named(source)
        if root is None:
            raise
        return root


def _root_named(source: Source) -> str | None:
    """The folder of the model that the outermost run.env names; None where it names none that is there."""
    roots = (name.removesuffix(RUN_ENV) for name in source.files if f"/{name}".endswith(f"/{RUN_ENV}"))
    ours = (root for root in roots if not is_of_others(root))
    root = min(ours, key=lambda root: root.count("/"), default=None)
    if root is None:
        return None
    env = parse_env(source.text(root + RUN_ENV), name=RUN_ENV)
    values = {key: setting.value for key, setting in env.settings.items()}
    folder = values.get(CUSTOM_PREFIX, "").strip("/")
    if folder.startswith(f"{CUSTOM_FILES}/") and f"{root}{folder}/{REWARD}" in source.files:
        return f"{root}{folder}/"
    return root if f"{root}{CUSTOM_FILES}/{_files(values)[0].get(REWARD)}" in source.files else None


def meaning(name: str) -> str | None:
    """Why a known setting has no effect here; None where it has one, or is not known."""
    if name in (*TRAINING, *EVALUATION, *FILES, *OBJECTS, *ALIASES, MODEL_PREFIX, *PRETRAINING):
        return None
    for pattern, why in NO_EFFECT.items():
        start, star, end = pattern.partition("*")
        if name == pattern or (star and name.startswith(start) and name.endswith(end)):
            return why
    return None


def _renamed(env: EnvFile) -> tuple[dict[str, EnvSetting], list[str]]:
    """The settings under their proper names."""
    settings, notes = dict(env.settings), list(env.notes)
    for alias, proper in ALIASES.items():
        setting = settings.pop(alias, None)
        if setting is None:
            continue
        if proper in settings:
            notes.append(f"{alias} has no effect, as {proper} is given too.")
        else:
            settings[proper] = replace(setting, name=proper)
    return settings, notes


def _params(values: Mapping[str, str], *, name: str) -> tuple[TrainingParams, dict[str, str]]:
    model = _training_model()
    known = {key: value for key, value in values.items() if key in TRAINING}
    checked = validate(model, known, name=name)
    fields = {field: getattr(checked, key) for key, field in TRAINING.items()}
    extra = {OBJECTS[key]: value for key, value in values.items() if key in OBJECTS}
    names = {**TRAINING, **OBJECTS}
    given = {names[key]: f"{key}={value}" for key, value in values.items() if key in names}
    return TrainingParams(**fields, extra=extra), given


@dataclass(frozen=True)
class _Evaluation:
    """The evaluation's settings, as the file has them; the defaults are deepracer-for-cloud's."""

    laps: Annotated[Whole, Field(ge=1, le=1000, description="1 to 1000 laps")] = RULE_SETS["drfc"].laps
    is_continuous: Annotated[bool, Field(description="True or False")] = RULE_SETS["drfc"].is_continuous
    max_resets: Annotated[Whole, Field(ge=0, le=1_000_000, description="0 to 1000000")] = RULE_SETS["drfc"].max_resets
    offtrack_penalty: Annotated[Number, Field(ge=0, le=600, description="0 to 600 s")] = RULE_SETS[
        "drfc"
    ].offtrack_penalty
    collision_penalty: Annotated[Number, Field(ge=0, le=600, description="0 to 600 s")] = RULE_SETS[
        "drfc"
    ].collision_penalty
    is_reverse: Annotated[bool, Field(description="True or False")] = False


def _rules(values: Mapping[str, str], *, name: str) -> tuple[RaceRules | None, dict[str, str]]:
    known = {key: value for key, value in values.items() if key in EVALUATION}
    if not known:
        return None, {}
    checked = validate(_evaluation_model(), known, name=name)
    fields: dict[str, Any] = {field: getattr(checked, key) for key, field in EVALUATION.items()}
    fields["direction"] = "reverse" if fields.pop("is_reverse") else "forward"
    if not fields["is_continuous"]:
        fields["max_resets"] = 0  # "your evaluation trial will end if your car goes off track"
    return replace(RULE_SETS["drfc"], **fields), {EVALUATION[key]: f"{key}={value}" for key, value in known.items()}


def _files(values: Mapping[str, str]) -> tuple[dict[str, str], dict[str, str]]:
    """Which files of ``custom_files`` are meant, by what follows the first part of their keys, often a variable."""
    files, used = {}, {}
    for key, file in FILES.items():
        parts = values.get(key, "").split("/")
        plain = parts[max((n for n, part in enumerate(parts) if "$" in part or "`" in part), default=-1) + 1 :]
        place = "/".join(plain[1:] if len(plain) == len(parts) > 1 else plain)
        if plain and plain[-1]:
            files[file] = place
            used[f"{key}={values[key]}"] = f"{CUSTOM_FILES}/{place}"
        elif key in values:
            used[f"{key}={values[key]}"] = f"cannot be resolved: {CUSTOM_FILES}/{file}"
    return files, used


def _others(settings: Mapping[str, EnvSetting]) -> tuple[dict[str, str], dict[str, str]]:
    """Settings without effect, and unknown ones."""
    meant = [*TRAINING, *EVALUATION, *FILES, *OBJECTS, MODEL_PREFIX, *PRETRAINING]
    without_effect, unknown = {}, {}
    for key in settings:
        if key in meant:
            continue
        why = meaning(key)
        if why is not None:
            without_effect[key] = why
        else:
            unknown[key] = did_you_mean(key, [*meant, *(name for name in NO_EFFECT if "*" not in name)])
    return without_effect, unknown


@cache
def _training_model() -> type[AwsModel]:
    names = {field: key for key, field in TRAINING.items()}
    return file_model(TrainingParams, rename=lambda field: names.get(field, field))


@cache
def _evaluation_model() -> type[AwsModel]:
    names = {field: key for key, field in EVALUATION.items()}
    return file_model(_Evaluation, rename=lambda field: names.get(field, field))
