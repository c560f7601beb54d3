"""What a new run is made of: what the user says, what a parent run says otherwise, and the defaults."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

from racecraft.agent import ActionSpace, Hyperparameters, ModelMetadata, action_space
from racecraft.reward import load_reward
from racecraft.run import RunFolder
from racecraft.sim.objects import NO_OBJECTS
from racecraft.training.parent import Parent, is_starter, open_parent
from racecraft.training.regimes import METHODS, TIME_TRIAL, regime_of
from racecraft.training.settings import DEFAULT_TRACK, TrainSettings, make_settings, of_the_files
from racecraft.training.start import read_settings, start_run
from racecraft.training.stop import Until
from racecraft.training.taught import taught, teachers_arrays

_ITS_OWN = ("until", "seed", "algorithm", "tells_nearby", "num_threads")
"""Settings that no run has of its parent."""
_OF_THE_TRACK = ("start", "evaluate_every", "evaluation_trials", "distill")
"""Settings that follow from the tracks, so they are a parent's only on its tracks."""


@dataclass(frozen=True, kw_only=True)
class Plan:
    """A run to be started."""

    settings: TrainSettings
    reward: str
    """Source of the reward function."""
    metadata: ModelMetadata
    hyperparameters: Hyperparameters | None
    parent: Parent | None
    foreign: bool = False
    """Whether the reward function is somebody else's."""

    @property
    def notes(self) -> tuple[str, ...]:
        """Sentences for the user about the files and the parent."""
        metadata, notes = self.metadata, list(self.metadata.notes)
        if self.hyperparameters is not None:
            notes += self.hyperparameters.notes_for(metadata.action_space.kind, metadata.training_algorithm)
        if self.parent is not None:
            notes.append(f"Begins with the weights of {self.parent.name}.")
            notes += self.parent.check(self.settings.network_spec(metadata), metadata)
        return tuple(notes)

    def start(self, *, root: str | Path = "runs", name: str | None = None) -> RunFolder:
        """Make the run folder; see `racecraft.training.start.start_run`."""
        return start_run(
            self.settings,
            reward=self.reward,
            metadata=self.metadata,
            hyperparameters=self.hyperparameters,
            root=root,
            name=name,
            parent=self.parent,
            foreign=self.foreign,
        )


def make_plan(
    track: str | Path | Sequence[str | Path] | None = None,
    *,
    reward: str | Path | None = None,
    until: str | Until = "",
    actions: ActionSpace | str | None = None,
    sensors: Sequence[str] = (),
    model_metadata: str | Path | None = None,
    hyperparameters: str | Path | None = None,
    seed: int = 0,
    parent: str | Path | Parent | None = None,
    algorithm: str = "",
    **settings: Any,
) -> Plan:
    """Everything a run needs, read and checked; the arguments are those of `racecraft.training.train`.

    Raises:
        RacecraftError: An input is wrong.
    """
    if parent is not None and not isinstance(parent, Parent):
        parent = open_parent(parent)
    theirs = None if parent is None else parent.folder
    before = None if theirs is None else read_settings(theirs)
    objects = settings.get("objects", NO_OBJECTS if before is None else before.objects)
    opponents = settings.get("opponents", None if before is None else before.opponents)
    is_crowded = objects != NO_OBJECTS or opponents is not None
    regime, method = regime_of(objects=objects, opponents=opponents), METHODS.get(algorithm, METHODS["ppo"])
    if model_metadata is not None:
        metadata = ModelMetadata.load(model_metadata)
    elif theirs is None or actions is not None:
        suited = regime.actions if "discrete" in method.actions else "continuous"
        chosen = suited if actions is None else actions
        space = action_space(chosen) if isinstance(chosen, str) else chosen
        if theirs is None:
            suite = regime.sensors if method.sees_all else TIME_TRIAL.sensors
            metadata = ModelMetadata(
                action_space=space, neural_network="RACECRAFT_SMALL", sensors=tuple(sensors or suite)
            )
        else:
            metadata = replace(theirs.read_model_metadata(), action_space=space)
    else:
        metadata = theirs.read_model_metadata()
    if theirs is not None and model_metadata is None and sensors:
        metadata = replace(metadata, sensors=tuple(sensors))
    if reward or theirs is None:
        kind = {"objects": objects, "opponents": opponents, "most_speed": metadata.action_space.most_speed}
        source, is_foreign = load_reward(reward or regime_of(**kind).reward), False
    else:
        source, is_foreign = theirs.read_reward_function(), theirs.read_info().foreign
    if algorithm:
        metadata = _with_algorithm(metadata, algorithm)
    parameters = None if hyperparameters is None else Hyperparameters.load(hyperparameters)
    is_new_track = parent is not None and (track is not None or is_starter(parent.saved))
    is_taught = False
    if theirs is not None:
        if parameters is None and "ppo" not in settings:
            parameters = theirs.read_hyperparameters()
        may_be_fast = is_new_track and metadata.action_space.kind == "continuous"
        said = {"hyperparameters": parameters, **settings}
        is_taught = not algorithm and (is_crowded or may_be_fast) and _is_taught(before, metadata, said)
        algorithm = algorithm or ("distill" if is_taught else of_the_files(metadata))
    is_fast = algorithm == "distill" and metadata.action_space.kind == "continuous"
    usual = regime_of(objects=objects, opponents=opponents, is_fast_distill=is_fast).until
    limit = Until.parse(until or usual) if isinstance(until, str) else until
    if theirs is not None:
        inherited = _inherited(theirs, metadata, is_new_track=is_new_track, follows_aws=parameters is not None)
        if model_metadata is not None:
            inherited.pop("vehicle")  # the file's version decides
        if is_taught:
            inherited.pop("distill", None)
        of_the_parent = inherited.pop("track")
        track = of_the_parent if track is None else track
        settings = {**inherited, **settings}
    made = make_settings(
        metadata=metadata,
        hyperparameters=parameters,
        track=DEFAULT_TRACK if track is None else track,
        until=limit,
        seed=seed,
        algorithm=algorithm,
        **settings,
    )
    if is_taught and is_crowded:
        made = replace(made, distill=replace(made.distill, student_steps=1))  # it knows its lessons
    if parent is not None and "distill" not in settings and teachers_arrays(parent.saved, made, metadata):
        made = replace(made, distill=taught(made.distill))
    return Plan(
        settings=made,
        reward=source,
        metadata=metadata,
        hyperparameters=parameters,
        parent=parent,
        foreign=is_foreign,
    )


def _with_algorithm(metadata: ModelMetadata, algorithm: str) -> ModelMetadata:
    """The metadata that says, as far as AWS's file can, what trains."""
    is_sac = algorithm == "sac" and metadata.action_space.kind == "continuous"
    return replace(metadata, training_algorithm="sac" if is_sac else "clipped_ppo")


def _is_taught(before: TrainSettings | None, metadata: ModelMetadata, said: Mapping[str, Any]) -> bool:
    """Whether a child of a taught model gets a teacher as well.

    Where others are about, PPO's step needs its critic; on another road, fast laps need one that knows it.
    """
    is_told = any(said.get(name) for name in ("hyperparameters", "ppo", "distill", "critic", "device"))
    was_taught = before is not None and before.algorithm == "distill"
    return was_taught and not is_told and of_the_files(metadata) == "ppo"


def _inherited(folder: RunFolder, metadata: ModelMetadata, *, is_new_track: bool, follows_aws: bool) -> dict[str, Any]:
    """The settings of a parent that its child has as well, unless the user says otherwise."""
    theirs = read_settings(folder)
    left_out = {*_ITS_OWN, *(_OF_THE_TRACK if is_new_track else ())}
    if is_new_track and theirs.critic != "camera":
        left_out.add("critic")  # how much of a lap it should know hangs on its length
    values = {setting.name: getattr(theirs, setting.name) for setting in fields(theirs) if setting.name not in left_out}
    is_same_kind = folder.read_model_metadata().action_space.kind == metadata.action_space.kind
    if follows_aws:
        del values["ppo"]
        values["num_envs"] = theirs.ppo.num_envs
    elif not is_same_kind:
        del values["ppo"]  # what suits a table of actions does not suit a Gaussian
    return values
