"""`import_run`: from a folder, archive or file of the original to a run folder that can be trained.

Nothing foreign is run: the reward function is parsed and checked as text, and tried where it will be trained, in the
worker process; the run is marked, so that this never happens outside of its walls. The new run folder appears whole or
not at all.
"""

from __future__ import annotations

import re
import shutil
from contextlib import ExitStack
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Final

from racecraft.agent import Hyperparameters, ModelMetadata, action_space
from racecraft.checks import check_type
from racecraft.errors import SourceError, TrackNotFound, did_you_mean, printable
from racecraft.importing.drfc import DrfcSettings, read_drfc, root_of
from racecraft.importing.env_file import EnvFile, parse_env
from racecraft.importing.history import History, keep_history
from racecraft.importing.job import job_settings
from racecraft.importing.layout import (
    BUCKET,
    CUSTOM_FILES,
    EXPERIMENTS,
    HYPERPARAMETERS,
    METADATA,
    PLACES,
    REWARD,
    RUN,
    RUN_ENV,
    SYSTEM_ENV,
    TRAINING_PARAMS,
    hint_at,
    is_below,
    is_of_others,
    role,
    runs_inside,
)
from racecraft.importing.model_files import BEST, LAST, NONE, ModelFiles, choose_model, find_models
from racecraft.importing.own import OwnRun, read_own
from racecraft.importing.policy_weights import has_critic
from racecraft.importing.report import ImportedRun, failure, unused_files
from racecraft.importing.source import Source, SourceFile, open_source
from racecraft.importing.weights import open_model, or_other_weights, read_weights, save_weights
from racecraft.json_file import parse_json_object
from racecraft.learn.learner import Weights
from racecraft.race.rules import RaceRules
from racecraft.reward import check_reward, load_reward, validate_reward
from racecraft.reward.sandbox import find_confinement
from racecraft.run import RunFolder
from racecraft.run.atomic import write_json
from racecraft.run.training_params import TrainingParams
from racecraft.track import Track, load_track, track_names
from racecraft.training.regimes import TIME_TRIAL
from racecraft.training.settings import DEFAULT_TRACK, make_settings, of_the_files
from racecraft.training.start import require_trainable, write_run

ORIGINAL: Final = "original"
"""Folder of a run for what came with it."""
_WORLD: Final = re.compile(r"[A-Za-z0-9_-]{1,100}")
_ALIKE: Final = ("reinvent_base", "reinvent_carpet", "reinvent_concrete", "reinvent_wood")  # the route of 2018


@dataclass
class _Model:
    """What was read so far."""

    source: Source
    root: str
    kind: str = "folder of a model"
    drfc: DrfcSettings | None = None
    used: dict[str, str] = field(default_factory=dict)
    unused: dict[str, str] = field(default_factory=dict)
    unknown: dict[str, str] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)
    weights: ModelFiles | None = None
    """Whose weights the run begins with."""
    is_pretrained: bool = False
    """They are those of another model, which this one was to go on from."""
    unread: str = ""
    """Weights of which nobody knows what they answer."""

    def find(self, name: str) -> str:
        """Path of a settings file, or an empty string."""
        places = PLACES[name]
        if self.drfc is not None and name in self.drfc.files:
            places = (f"{CUSTOM_FILES}/{self.drfc.files[name]}", *places)
        roots = [self.root]
        if name in (RUN_ENV, SYSTEM_ENV) and CUSTOM_FILES in (parts := self.root.split("/")):  # one model of several
            roots.append("".join(f"{part}/" for part in parts[: parts.index(CUSTOM_FILES)]))
        found = [root + place for root in roots for place in places if root + place in self.source.files]
        return found[0] if found else ""

    def shown(self, name: str) -> str:
        """A path below the model's root."""
        return name.removeprefix(self.root)

    def note_elsewhere(self, name: str) -> None:
        """Say where a settings file lies that is none of this model's."""
        known = [self.root + place for place in PLACES[name]]
        found = [file for file in self.source.files if file.endswith(f"/{name}") and not is_of_others(file)]
        self.notes += [
            f"{file} was left out: the model's own would lie in {self.root or 'the outermost folder'}."
            for file in sorted(set(found).difference(known))[:1]
        ]


def import_run(
    path: str | Path,
    *,
    root: str | Path = "runs",
    name: str | None = None,
    track: str = "",
    reward: str | Path = "",
    network: str = "",
    checkpoint: str | int = BEST,
) -> ImportedRun:
    """Make a run from files of the original.

    Args:
        path: A deepracer-for-cloud folder, a model's folder or archive, or a ``reward_function.py``.
        root: Where runs lie.
        name: Name of the run; by default made from the model's.
        track: Name or file of a track, instead of the world that the files name; a run of ours goes on where it is the
            very road that it was trained on, and else begins anew.
        reward: Preset or file, instead of the reward function among the files.
        network: Instead of the network that the files name; then it begins with fresh weights.
        checkpoint: Which weights it begins with, where there are several: ``best``, ``last``, an iteration or a file's
            name; ``none`` for fresh ones.

    Raises:
        RacecraftError: Nothing is understood, something is wrong in the files, or hostile. No run was made.
    """
    check_type("checkpoint", checkpoint, (str, int), "use best, last, none, an iteration or a file's name")
    checkpoint = str(checkpoint)
    with ExitStack() as stack:
        source = stack.enter_context(open_source(path))
        root_inside = "" if source.reward else root_of(source)
        runs = runs_inside(source.files, root_inside)
        source = replace(source, files={name: file for name, file in source.files.items() if not is_below(name, runs)})
        model = _Model(source, root_inside)
        if runs:
            model.unused[min(runs) + (f" and {len(runs) - 1} more" if len(runs) > 1 else "")] = (
                "runs of Racecraft's own"
            )
        outer = re.sub(r"[^/]+/$", "", model.root)
        if model.root and any(file.startswith(f"{outer}{CUSTOM_FILES}/") for file in source.files):
            model.notes.append(
                f"{outer}{CUSTOM_FILES}/ was left out, as it is for the next training, not of this model."
            )
        params, given = _read_params(model)
        is_foreign = not reward and bool(source.reward or model.find(REWARD))
        model.weights = _find_weights(model, checkpoint, network)
        text = _read_reward(model, reward)
        metadata = _read_metadata(model)
        own = _read_own(model, checkpoint, track, is_other=bool(reward or network))
        hyperparameters = (
            None if own is not None and not own.has_hyperparameters else _read_hyperparameters(model, metadata)
        )
        if own is not None:
            tracks, label = list(own.tracks), own.settings.track
            model.kind, model.used["run.json"] = "archive of Racecraft", f"every setting, track {label}"
        else:
            where, label = _find_track(model, params, given, track)
            tracks = [where]
        job = job_settings(params, given)
        model.used.update(job.used)
        model.unused.update(job.unused)
        tensors = None
        if own is None and model.weights is not None:
            with or_other_weights(model.weights):
                tensors = stack.enter_context(open_model(source, model.weights))
        if own is not None:
            settings = own.settings
        else:
            settings = make_settings(
                metadata=metadata,
                hyperparameters=hyperparameters,
                network=network,
                track=label,
                algorithm=of_the_files(metadata),
                critic="camera" if tensors is not None and has_critic(tensors) else "",
                **job.values,
            )
        require_trainable(settings, metadata)
        spec = settings.network_spec(metadata)
        weights: Weights = {}
        if tensors is not None:
            with or_other_weights(model.weights):
                weights = read_weights(tensors, spec, metadata.suite, model.notes)
        if network:
            model.used[f"--network {network}"] = "network"
        rules = _race_rules(model, settings.direction)

        folder = RunFolder.create(root, name=name, prefix=_prefix(model))
        try:
            place = folder.path if own is not None else folder.path / ORIGINAL
            history = keep_history(_history_files(model), _history_root(model), place)
            if own is not None:
                model.used.update(own.restore(folder, model.notes))
            if model.weights is not None and weights:
                save_weights(folder, weights, spec, _origin(model, model.weights, has_critic=not spec.state_size))
            report = _report(model, folder, tracks[0], history, kept_in=ORIGINAL if own is None else "")
            if rules is not None:
                write_json(folder.race_rules, rules.to_dict())
            (folder.path / ORIGINAL).mkdir(exist_ok=True)
            write_json(folder.path / ORIGINAL / "import.json", {**report.to_dict(), "source": printable(source.title)})
            params = replace(params, world_name=tracks[0].name)
            write_run(folder, settings, tracks, text, metadata, hyperparameters, params, foreign=is_foreign)
        except BaseException as error:
            shutil.rmtree(folder.path, ignore_errors=True)
            if isinstance(error, OSError):
                raise failure(error, folder.path) from error
            raise
        return report


def _read_params(model: _Model) -> tuple[TrainingParams, dict[str, str]]:
    """The job's settings, and which of them were given; says what kind of model it is."""
    source = model.source
    if source.reward:
        model.kind = "reward function"
    envs = [name for name in (model.find(SYSTEM_ENV), model.find(RUN_ENV)) if name]
    if envs or any(name.startswith(f"{model.root}{CUSTOM_FILES}/") for name in source.files):
        model.kind = "deepracer-for-cloud folder"
        read = [parse_env(source.text(name), name=model.shown(name)) for name in envs]
        env = EnvFile(
            {key: setting for file in read for key, setting in file.settings.items()},
            tuple(note for file in read for note in file.notes),
        )
        drfc = model.drfc = read_drfc(env, name=RUN_ENV)
        model.used.update(drfc.used)
        for aws, place in list(drfc.files.items()):
            base = place.rpartition("/")[2]
            there = [one for one in (place, base) if f"{model.root}{CUSTOM_FILES}/{one}" in source.files]
            if not there and base != aws:
                near = [file for file in source.files if file.startswith(f"{model.root}{CUSTOM_FILES}/")]
                raise SourceError(
                    f"run.env names {place!r} as the {aws}, but {CUSTOM_FILES}/{place} is not there.",
                    hint=did_you_mean(f"{model.root}{CUSTOM_FILES}/{place}", near),
                )
            drfc.files[aws] = there[0] if there else base
            for key, became in drfc.used.items():
                if became == f"{CUSTOM_FILES}/{place}":
                    model.used[key] = f"{CUSTOM_FILES}/{drfc.files[aws]}"
        model.unused.update(drfc.without_effect)
        model.unknown.update(drfc.unknown)
        model.notes += drfc.notes
        return drfc.params, drfc.given
    place = model.find(TRAINING_PARAMS)
    if not place:
        return TrainingParams(), {}
    params = TrainingParams.from_yaml(source.text(place), name=model.shown(place))
    given = {key: f"{key.upper()}: {getattr(params, key)}" for key in sorted(params.given)}
    given |= {str(key): str(key) for key in params.extra}
    model.used[model.shown(place)] = "settings of the training"
    return params, given


def _find_weights(model: _Model, checkpoint: str, network: str) -> ModelFiles | None:
    """The trained weights among the files, if they are wanted and can be understood."""
    if checkpoint not in (BEST, NONE) and network:
        raise SourceError(
            f"--checkpoint {checkpoint[:80]} asks for weights, and --network begins with fresh ones; give one of them."
        )
    if network or model.root + RUN in model.source.files:
        return None
    names = [file.name for file in _history_files(model) if role(file.name) == "weights"]
    if not model.find(METADATA):
        if checkpoint not in (BEST, NONE):
            raise SourceError(
                f"{model.source.title} has no {METADATA}, without which nobody knows what weights answer."
            )
        if checkpoint == BEST and (found := find_models(names)):
            model.unread = found[-1].name
            model.notes.append(f"{model.unread} was left out: without a {METADATA} nobody knows what it answers.")
        return None
    drfc = model.drfc
    if drfc is not None and drfc.pretrained and checkpoint != NONE and not find_models(names):
        other = f"{_bucket(model)}{drfc.pretrained}/"
        names = [name for name in model.source.files if name.startswith(other) and role(name) == "weights"]
        model.is_pretrained = True
        checkpoint = drfc.pretrained_checkpoint if checkpoint == BEST else checkpoint
        begins = "fresh ones, since they are not among the files"
        if find_models(names):
            begins = f"the {checkpoint} ones" if checkpoint in (BEST, LAST) else f"those of {checkpoint}"
            for label in drfc.pretraining:
                del model.unused[label]
                model.used[label] = "weights to begin with"
        model.notes.append(f"The model was to go on from the weights of {drfc.pretrained!a}; it begins with {begins}.")
    return choose_model(model.source, names, checkpoint, model.notes)


def _read_own(model: _Model, checkpoint: str, track: str, *, is_other: bool) -> OwnRun | None:
    """The run of an archive of ours, without its weights where fresh ones are wanted; None where it begins anew."""
    if model.root + RUN not in model.source.files:
        return None
    if checkpoint not in (BEST, LAST, NONE):
        raise SourceError(
            f"{model.source.title} is a run of Racecraft, which comes with all checkpoints and goes on from the last; "
            f"--checkpoint is {checkpoint[:80]!r}, and allowed are best, last and none."
        )
    own = None if is_other else read_own(model.source, model.root, track=track)
    if own is None:
        model.notes.append(
            "What the run has learned was left out, as its reward, network or road is another now: import it as it is, "
            "and racecraft train --from takes its weights along."
        )
    return own if own is None or checkpoint != NONE else replace(own, files={})


def _origin(model: _Model, weights: ModelFiles, *, has_critic: bool) -> dict[str, Any]:
    """Where weights come from, for the checkpoint; and for the user."""
    shown = " and ".join(path.removeprefix(_history_root(model)) for path in weights.paths)
    model.used[shown] = "weights of the policy and the critic" if has_critic else "weights of the policy"
    if not has_critic:
        model.notes.append("The model's critic is not in the files: should it be trained, its critic begins anew.")
    origin = {"file": weights.name, "iteration": weights.iteration, "steps": weights.steps}
    return {name: value for name, value in origin.items() if value != -1}


def _read_reward(model: _Model, reward: str | Path) -> str:
    name = model.source.reward or model.find(REWARD)
    if reward:
        text = load_reward(reward)
        model.used[f"--reward {reward}"] = REWARD
        if name:
            model.unused[model.shown(name)] = "--reward was given"
    elif not name and model.weights is not None:
        text = load_reward(TIME_TRIAL.reward)
        model.notes.append(f"There is no {REWARD}: should it be trained, then with the preset {TIME_TRIAL.reward!r}.")
    elif not name:
        if any(file.startswith(f"{model.root}{EXPERIMENTS}/") for file in model.source.files):
            raise SourceError(
                f"{model.source.title} has no {REWARD} of its own, but experiments.",
                hint=f"Import the folder of one of them, which is in {EXPERIMENTS}/.",
            )
        if model.unread:
            raise SourceError(
                f"{model.source.title} has {model.unread}, but no {METADATA}, without which nobody knows what it "
                f"answers, and no {REWARD} to train anew with.",
                hint=f"Put the model's own {METADATA} beside it. --reward FILE or PRESET begins with fresh weights.",
            )
        raise SourceError(
            f"{model.source.title} has no {REWARD}, without which nothing can be trained.",
            hint=hint_at(model.source.files, (REWARD,))
            or "Give one with --reward: a file, or a preset such as centerline; 'racecraft reward list' lists them.",
        )
    else:
        text = model.source.text(name)
        model.used[model.shown(name)] = REWARD
        walls = find_confinement()
        if not walls.is_complete:
            model.notes.append(
                f"This system cannot lock in somebody else's reward function (no {walls.missing}), so it does not run "
                "it: read it, and if you trust it, give it as your own with --reward FILE."
            )
    validate_reward(text)
    model.notes += [f"warning: {problem}" for problem in check_reward(text)[:3]]
    return text


def _read_metadata(model: _Model) -> ModelMetadata:
    name = model.find(METADATA)
    if not name:
        model.notes.append(f"There is no {METADATA}: Racecraft's own actions and network were chosen.")
        model.note_elsewhere(METADATA)
        return ModelMetadata(action_space=action_space("default"), neural_network="RACECRAFT_SMALL")
    metadata, shown = _metadata_in(model, name), model.shown(name)
    if model.weights is not None and not model.is_pretrained:
        beside = f"{model.weights.paths[0].rpartition('/')[0]}/{METADATA}"
        if beside in model.source.files and _metadata_in(model, beside) != metadata:
            model.notes.append(
                f"{shown} has changed since: what the model learned with counts; --checkpoint none begins anew."
            )
            metadata, shown = _metadata_in(model, beside), model.shown(beside)
    model.used[shown] = f"{_actions(metadata)}, {metadata.neural_network}, version {metadata.version}"
    model.notes += metadata.notes
    return metadata


def _metadata_in(model: _Model, name: str) -> ModelMetadata:
    shown = model.shown(name)
    return ModelMetadata.from_dict(parse_json_object(model.source.text(name), name=shown), name=shown)


def _actions(metadata: ModelMetadata) -> str:
    space = metadata.action_space
    return f"{space.size} actions" if space.kind == "discrete" else "continuous actions"


def _read_hyperparameters(model: _Model, metadata: ModelMetadata) -> Hyperparameters | None:
    name = model.find(HYPERPARAMETERS)
    if model.root + RUN in model.source.files and name != model.root + HYPERPARAMETERS:
        name = ""  # what a run of ours leaves for AWS's tools is never read back: ours may lie outside of AWS's ranges
    if not name and model.weights is not None and model.root + RUN not in model.source.files:
        # ours are for small networks that know nothing: a step of theirs would ruin what this one has learned
        model.notes.append(f"There is no {HYPERPARAMETERS}: it goes on with AWS's defaults.")
        model.note_elsewhere(HYPERPARAMETERS)
        return Hyperparameters()
    if not name:
        model.notes.append(f"There is no {HYPERPARAMETERS}: it trains with Racecraft's own settings.")
        model.note_elsewhere(HYPERPARAMETERS)
        return None
    shown = model.shown(name)
    hyperparameters = Hyperparameters.from_dict(parse_json_object(model.source.text(name), name=shown), name=shown)
    episodes = hyperparameters.num_episodes_between_training
    model.used[shown] = f"PPO as AWS's, {episodes} episodes to an iteration"
    model.notes += hyperparameters.notes_for(metadata.action_space.kind, metadata.training_algorithm)
    return hyperparameters


def _find_track(model: _Model, params: TrainingParams, given: dict[str, str], chosen: str) -> tuple[Track, str]:
    """The track, and what run.json calls it."""
    label = given.get("world_name", "")
    if chosen:
        track = load_track(chosen)
        model.used[f"--track {chosen}"] = f"track {track.name}"
        if label:
            model.unused[label] = "--track was given"
        return track, chosen
    if not label:
        model.notes.append(f"No file names a track: {DEFAULT_TRACK} was chosen. --track chooses another.")
        return load_track(DEFAULT_TRACK), DEFAULT_TRACK
    world = params.world_name
    try:
        if not _WORLD.fullmatch(world):  # a name from a stranger must not become a path
            raise TrackNotFound("not a name")
        track = load_track(world)
    except TrackNotFound as error:
        alike = f"--track {DEFAULT_TRACK} is much like it." if world in _ALIKE else did_you_mean(world, track_names())
        raise TrackNotFound(
            f"The model drives on {world[:80]!r}, which is not among Racecraft's tracks.",
            hint=f"Give its route with --track FILE.npy, or another track with --track NAME. {alike}".rstrip(),
        ) from error
    model.used[label] = f"track {track.name}"
    return track, world


def _race_rules(model: _Model, direction: str) -> RaceRules | None:
    drfc = model.drfc
    if drfc is None or drfc.rules is None:
        return None
    rules = drfc.rules
    if "is_reverse" not in drfc.rules_given:
        rules = replace(rules, direction="reverse" if direction == "reverse" else "forward")
    for rule, label in drfc.rules_given.items():
        value = rules.direction if rule == "is_reverse" else getattr(rules, rule)
        model.used[label] = f"race_rules.json: {'direction' if rule == 'is_reverse' else rule} {value}"
    if not rules.is_continuous and "max_resets" in drfc.rules_given:
        model.notes.append("DR_EVAL_MAX_RESETS has no effect: without DR_EVAL_IS_CONTINUOUS a mistake ends the trial.")
    return rules


def _prefix(model: _Model) -> str:
    if model.drfc is not None and model.drfc.prefix:
        return model.drfc.prefix
    return model.root.rstrip("/").rpartition("/")[2] or model.source.stem


def _history_root(model: _Model) -> str:
    """The folder that the history's paths are kept below."""
    if model.drfc is None:
        return model.root
    return f"{_bucket(model)}{model.drfc.prefix or 'rl-deepracer-sagemaker'}/"


def _bucket(model: _Model) -> str:
    """Where models are; an experiment has none of its own."""
    return re.sub(rf"(^|/){EXPERIMENTS}/[^/]+/$", r"\1", model.root) + f"{BUCKET}/"


def _history_files(model: _Model) -> list[SourceFile]:
    root = _history_root(model)
    reward = model.source.reward
    return [file for name, file in model.source.files.items() if name.startswith(root) and name != reward]


def _report(model: _Model, folder: RunFolder, track: Track, history: History, *, kept_in: str) -> ImportedRun:
    read = () if model.weights is None else model.weights.paths
    left = [file for file in _history_files(model) if file.name not in read]
    model.unused.update(unused_files(left, _history_root(model)))
    model.unused.update({name: f"left out: {why}" for name, why in history.refused.items()})
    if model.source.num_links:
        model.unused[f"{model.source.num_links} links"] = "links are not followed"
    return ImportedRun(
        run=folder.path,
        kind=f"{model.kind}, {model.source.title}",
        track=track.name,
        used=model.used,
        unused=model.unused,
        unknown=model.unknown,
        kept=history.files,
        kept_in=kept_in,
        notes=model.notes,
    )
