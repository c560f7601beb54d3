"""What a new run is made of: what the user says, what a parent run says otherwise, and the defaults."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

import numpy as np

from racecraft.agent import ActionSpace, Hyperparameters, ModelMetadata, action_space
from racecraft.checks import check_type
from racecraft.errors import ConfigError
from racecraft.learn import PPOConfig
from racecraft.reward import load_reward
from racecraft.run import RunFolder
from racecraft.sim.objects import NO_OBJECTS
from racecraft.training.parent import Parent, is_starter, open_parent
from racecraft.training.regimes import METHODS, TIME_TRIAL, Regime, regime_of
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
    if isinstance(seed, np.integer):
        seed = int(seed)  # JSON, in which a run keeps it, does not know NumPy's
    check_type("algorithm", algorithm, str, "use a name such as 'ppo'")
    check_type("ppo", settings.get("ppo"), (PPOConfig, type(None)), "use racecraft.learn.PPOConfig(...)")
    if parent is not None and not isinstance(parent, Parent):
        parent = open_parent(parent)
    before = None if parent is None else read_settings(parent.folder)
    company: dict[str, Any] = {
        "objects": settings.get("objects", NO_OBJECTS if before is None else before.objects),
        "opponents": settings.get("opponents", None if before is None else before.opponents),
    }
    metadata = _metadata(parent, regime_of(**company), actions, sensors, model_metadata, algorithm)
    source, is_foreign = _reward(parent, reward, company, metadata)
    parameters = None if hyperparameters is None else Hyperparameters.load(hyperparameters)
    is_crowded = company != {"objects": NO_OBJECTS, "opponents": None}
    is_continuous = metadata.action_space.kind == "continuous"
    is_taught = False
    if parent is not None and before is not None:
        if parameters is None and "ppo" not in settings:
            parameters = parent.folder.read_hyperparameters()
        is_new_track = track is not None or is_starter(parent.saved)
        said = {"hyperparameters": parameters, **settings}
        may_be = not algorithm and (is_crowded or (is_new_track and is_continuous))
        is_taught = may_be and _is_taught(before, metadata, said)
        algorithm = algorithm or ("distill" if is_taught else of_the_files(metadata))
        inherited = _inherited(parent, before, metadata, is_new_track=is_new_track, follows_aws=parameters is not None)
        if model_metadata is not None:
            del inherited["vehicle"]  # the file's version decides
        if is_taught:
            inherited.pop("distill", None)
        of_the_parent = inherited.pop("track")
        track = of_the_parent if track is None else track
        settings = {**inherited, **settings}
    usual = regime_of(**company, is_fast_distill=algorithm == "distill" and is_continuous).until
    made = make_settings(
        metadata=metadata,
        hyperparameters=parameters,
        track=DEFAULT_TRACK if track is None else track,
        until=Until.parse(until or usual) if isinstance(until, str) else until,
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


def _metadata(
    parent: Parent | None,
    regime: Regime,
    actions: ActionSpace | str | None,
    sensors: Sequence[str],
    file: str | Path | None,
    algorithm: str,
) -> ModelMetadata:
    """What the policy sees and does: as a file says, or the parent, or what suits the kind of training."""
    if file is not None:
        for name, given in (("actions", actions), ("sensors", sensors)):
            if given:
                raise ConfigError(f"{name} and model_metadata both say what a car's {name} are; give one of them.")
        return _with_algorithm(ModelMetadata.load(file), algorithm)
    check_type("sensors", sensors, (list, tuple), "use a list of AWS's sensor names")
    space = action_space(actions) if isinstance(actions, str) else actions
    if parent is not None:
        made = parent.folder.read_model_metadata()
        made = replace(made, action_space=space or made.action_space, sensors=tuple(sensors) or made.sensors)
    else:
        method = METHODS.get(algorithm, METHODS["ppo"])
        usual = regime.actions if "discrete" in method.actions else "continuous"
        made = ModelMetadata(
            action_space=space or action_space(usual),
            neural_network="RACECRAFT_SMALL",
            sensors=tuple(sensors) or (regime.sensors if method.sees_all else TIME_TRIAL.sensors),
        )
    return _with_algorithm(made, algorithm)


def _reward(
    parent: Parent | None, reward: str | Path | None, company: Mapping[str, Any], metadata: ModelMetadata
) -> tuple[str, bool]:
    """Source of the reward function, and whether it is somebody else's."""
    if parent is not None and not reward:
        return parent.folder.read_reward_function(), parent.folder.read_info().foreign
    most_speed = metadata.action_space.most_speed
    return load_reward(reward or regime_of(**company, most_speed=most_speed).reward), False


def _with_algorithm(metadata: ModelMetadata, algorithm: str) -> ModelMetadata:
    """The metadata that says, as far as AWS's file can, what trains, if that is said."""
    if not algorithm:
        return metadata
    is_sac = algorithm == "sac" and metadata.action_space.kind == "continuous"
    return replace(metadata, training_algorithm="sac" if is_sac else "clipped_ppo")


def _is_taught(before: TrainSettings, metadata: ModelMetadata, said: Mapping[str, Any]) -> bool:
    """Whether a child of a taught model gets a teacher as well.

    Where others are about, PPO's step needs its critic; on another road, fast laps need one that knows it.
    """
    is_told = any(said.get(name) for name in ("hyperparameters", "ppo", "distill", "critic", "device"))
    return before.algorithm == "distill" and not is_told and of_the_files(metadata) == "ppo"


def _inherited(
    parent: Parent, before: TrainSettings, metadata: ModelMetadata, *, is_new_track: bool, follows_aws: bool
) -> dict[str, Any]:
    """The settings of a parent that its child has as well, unless the user says otherwise."""
    left_out = {*_ITS_OWN, *(_OF_THE_TRACK if is_new_track else ())}
    if is_new_track and before.critic != "camera":
        left_out.add("critic")  # how much of a lap it should know hangs on its length
    values = {setting.name: getattr(before, setting.name) for setting in fields(before) if setting.name not in left_out}
    is_same_kind = parent.folder.read_model_metadata().action_space.kind == metadata.action_space.kind
    if follows_aws:
        del values["ppo"]
        values["num_envs"] = before.ppo.num_envs
    elif not is_same_kind:
        del values["ppo"]  # what suits a table of actions does not suit a Gaussian
    return values
