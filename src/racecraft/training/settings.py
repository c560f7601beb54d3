"""Everything that decides how a run trains, as one frozen value that run.json repeats."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, fields, replace
from pathlib import Path
from typing import Any, Final

from racecraft.agent import Hyperparameters, ModelMetadata
from racecraft.checks import check_choice, check_flag, check_type, check_whole
from racecraft.errors import ConfigError, RunError, did_you_mean
from racecraft.learn import DistillConfig, NetworkSpec, PPOConfig, SACConfig, network_names
from racecraft.learn.networks import PERCEPTION
from racecraft.learn.sb3 import SB3Config
from racecraft.sim import Randomization, Start, Vehicle, load_randomization, load_vehicle
from racecraft.sim.camera import CAMERAS
from racecraft.sim.columns import state_width
from racecraft.sim.objects import NO_OBJECTS, Objects
from racecraft.sim.simulation import DIRECTIONS
from racecraft.track import Track, join_names, load_tracks
from racecraft.training.lap_view import CRITICS_VIEW, NOTHING, TEACHERS_VIEW, LapView
from racecraft.training.nearby_view import NEARBY_COLUMNS
from racecraft.training.opponents import Opponents
from racecraft.training.regimes import (
    BRISK_SECONDS,
    FAST_STEPS,
    LONG_ROAD,
    LONG_SECONDS,
    METHODS,
    RACED_STEPS,
    TIME_TRIAL,
    AlgorithmConfig,
    check_regimes,
    regime_of,
)
from racecraft.training.rival_view import RIVAL_COLUMNS
from racecraft.training.stop import Until

DEFAULT_TRACK: Final = "reinvent_2018"
ARGUMENTS: Final = (
    *("reward", "actions", "sensors", "model_metadata", "hyperparameters", "parent", "root", "name", "reporter"),
    *("aws_log", "started", "recipe", "num_envs"),
)
"""Of `racecraft.train`, beside the settings: who misspells one is told."""
VEHICLE_OF_VERSION: Final = {"1": "v4", "2": "v4", "3": "v4", "4": "v4", "5": "v5", "6": "v6"}
_ADDED: Final = ("algorithm", "opponents", "sac", "distill", "sb3", "device", "camera", "tells_nearby")
"""Fields that runs of earlier versions lack."""
_DROPPED: Final = (("growth_steps", 0),)
"""Settings of PPO that runs of earlier versions have, with the value that meant nothing."""
CRITICS: Final = ("privileged", "lap", "camera")
_KINDS: Final[Mapping[str, tuple[type, str]]] = {
    "objects": (Objects, "racecraft.sim"),
    "start": (Start, "racecraft.sim"),
    "ppo": (PPOConfig, "racecraft.learn"),
    "sac": (SACConfig, "racecraft.learn"),
    "distill": (DistillConfig, "racecraft.learn"),
    "sb3": (SB3Config, "racecraft.learn.sb3"),
}
"""What settings that are dataclasses are, and where to take them from."""


@dataclass(frozen=True, kw_only=True)
class TrainSettings:
    """Settings of a training run, apart from its files (reward function, model metadata, hyperparameters)."""

    track: str = DEFAULT_TRACK
    """Name of a track, path of a track file, or several, as `racecraft.track.load_tracks` reads them."""
    until: Until = field(default_factory=lambda: Until.parse(TIME_TRIAL.until))
    """When to stop."""
    seed: int = 0
    """Key of every random number."""
    network: str = "RACECRAFT_SMALL"
    """Architecture, one of `racecraft.learn.network_names()`."""
    critic: str = TIME_TRIAL.critic
    """What the critic sees while training: ``privileged`` state; that and where on the ``lap`` the car is; or the
    ``camera`` alone, as AWS's."""
    vehicle: Vehicle = field(default_factory=Vehicle)
    """The car."""
    camera: str = "2018"
    """What it sees with, one of `racecraft.sim.camera.CAMERAS`; evaluations of the run do, too."""
    start: Start = field(default_factory=lambda: Start(spread=True))
    """Where training episodes start."""
    direction: str = "forward"
    """``forward``, ``reverse`` or ``alternate`` with every episode."""
    randomize: Randomization = field(default_factory=Randomization)
    """From what ranges every episode draws its light, friction, camera pose, ..."""
    objects: Objects = NO_OBJECTS
    """Boxes and bot cars on the track; evaluations have them, too."""
    algorithm: str = "ppo"
    """What improves the policy, one of `racecraft.training.regimes.METHODS`."""
    opponents: Opponents | None = None
    """Who drives the other cars of every race; None where the car is alone."""
    ppo: PPOConfig = field(default_factory=PPOConfig)
    """How PPO does it."""
    sac: SACConfig = field(default_factory=SACConfig)
    """How SAC does it."""
    distill: DistillConfig = field(default_factory=DistillConfig)
    """How distillation does it."""
    tells_nearby: bool = False
    """Whether a teacher among boxes and bots, and the critic it leaves behind, is told of the nearest of them."""
    sb3: SB3Config = field(default_factory=SB3Config)
    """How Stable-Baselines3 does it."""
    evaluate_every: int = TIME_TRIAL.evaluate_every
    """Camera steps between two evaluations, each followed by a checkpoint."""
    evaluation_trials: int = TIME_TRIAL.evaluation_trials
    """Cars that drive one lap in each evaluation."""
    num_threads: int = 0
    """Threads of simulator and learner; 0 takes one per core. Results repeat for the same number."""
    device: str = "cpu"
    """Where cars drive and the policy learns: ``cpu``, ``cuda``, or ``cuda:1`` of several GPUs."""

    def __post_init__(self) -> None:
        for name, choice, allowed in (
            ("algorithm", self.algorithm, tuple(METHODS)),
            ("network", self.network, network_names()),
            ("critic", self.critic, CRITICS),
            ("direction", self.direction, DIRECTIONS),
            ("camera", self.camera, CAMERAS),
        ):
            check_choice(name, choice, allowed)
        for name, value, low, high in (
            ("num_envs", self.num_envs, 1, regime_of(device=self.device).most_envs),
            ("seed", self.seed, 0, 2**32 - 1),
            ("evaluate_every", self.evaluate_every, 1, 10**9),
            ("evaluation_trials", self.evaluation_trials, 1, 100),
            ("num_threads", self.num_threads, 0, 1024),
        ):
            check_whole(name, value, low, high, is_plain=True)
        check_flag("tells_nearby", self.tells_nearby)
        self.randomize.check(self.vehicle, CAMERAS[self.camera])
        for name, (config, room) in _KINDS.items():
            check_type(name, getattr(self, name), config, f"use {room}.{config.__name__}(...)")
        kind, _, number = self.device.partition(":") if isinstance(self.device, str) else ("", "", "")
        if self.device != "cpu" and (kind != "cuda" or (":" in self.device and not number.isdecimal())):
            raise ConfigError(f"device is {self.device!r}; allowed are 'cpu', 'cuda', and 'cuda:1' for the second GPU.")
        if self.opponents is not None and not isinstance(self.opponents, Opponents):
            raise ConfigError(f"opponents are {self.opponents!r}; use racecraft.training.Opponents(...), or None.")
        chosen = {"algorithm": self.algorithm, "device": self.device}
        check_regimes(chosen, objects=self.objects, opponents=self.opponents, device=self.device)
        if self.critic == "lap" and (self.algorithm not in ("ppo", "distill") or self.device != "cpu"):
            raise ConfigError(
                f"critic is 'lap', which is for algorithm 'ppo' or 'distill' on device 'cpu'; it is {self.algorithm!r} "
                f"on {self.device!r}. Allowed there are 'privileged' and 'camera'."
            )
        if self.network == PERCEPTION and self.device != "cpu":
            raise ConfigError(f"network is {PERCEPTION!r}, which learns on device 'cpu'; it is {self.device!r}.")
        check_type("until", self.until, Until, "allowed is a text such as '5 laps'")
        if self.until.laps > self.evaluation_trials:
            object.__setattr__(self, "evaluation_trials", self.until.laps)

    @property
    def learning(self) -> AlgorithmConfig:
        """How the chosen algorithm learns."""
        learning: AlgorithmConfig = getattr(self, METHODS[self.algorithm].settings)
        return learning

    @property
    def num_envs(self) -> int:
        """Cars driven at once."""
        return self.learning.num_envs

    def network_spec(self, metadata: ModelMetadata) -> NetworkSpec:
        """The network for a model's action space and sensors."""
        space = metadata.action_space
        is_discrete = space.kind == "discrete"
        return NetworkSpec(
            name=self.network,
            num_actions=space.size if is_discrete else 2,
            is_discrete=is_discrete,
            state_size=self.state_size,
            is_squashed=METHODS[self.algorithm].is_squashed,
            lenses=metadata.suite.lenses,
            lidar_size=metadata.suite.lidar_size,
        )

    @property
    def initial_weights(self) -> str:
        """What an untrained network begins with, one of `racecraft.learn.networks.INITIAL_WEIGHTS`."""
        return self.ppo.initial_weights if self.algorithm == "ppo" else "orthogonal"

    @property
    def cars_per_race(self) -> int:
        """Cars that share a track."""
        return 1 if self.opponents is None else self.opponents.cars

    @property
    def num_objects(self) -> int:
        """Around every car: boxes, bots, and the other cars of its race."""
        return self.objects.count + self.cars_per_race - 1

    @property
    def state_size(self) -> int:
        """Columns of state that the critic sees; 0 where it sees the camera alone."""
        if self.critic == "camera":
            return 0
        near = len(NEARBY_COLUMNS) * self.tells_nearby + len(RIVAL_COLUMNS) * self.tells_rivals
        return state_width(self.num_objects) + self.lap_view.size + near

    @property
    def lap_view(self) -> LapView:
        """What of its lap the critic, and a teacher, is told."""
        if self.critic != "lap":
            return NOTHING
        return TEACHERS_VIEW if self.algorithm == "distill" else CRITICS_VIEW

    @property
    def tells_rivals(self) -> bool:
        """Whether a teacher, and its student's critic, is told of the other cars of its race."""
        return self.opponents is not None and self.algorithm == "distill"

    def to_dict(self) -> dict[str, Any]:
        """As JSON, for run.json."""
        return {**asdict(self), "until": str(self.until)}

    @classmethod
    def from_dict(cls, document: dict[str, Any]) -> TrainSettings:
        """From what `to_dict` gave.

        Raises:
            RunError: A field is missing or unknown.
            ConfigError: A value is outside its range.
        """
        try:
            values = dict(document)
            missing = [setting.name for setting in fields(cls) if setting.name not in (*values, *_ADDED)]
            if missing:
                raise RunError(f"The settings in run.json lack {', '.join(missing)}.")
            values["until"] = Until.parse(values["until"])
            values["vehicle"] = Vehicle(**values["vehicle"])
            values["start"] = Start(**values["start"])
            values["randomize"] = Randomization(**values["randomize"])
            values["objects"] = Objects.from_dict(values["objects"])
            values["opponents"] = Opponents.from_dict(values.get("opponents"))
            values["ppo"] = {name: value for name, value in values["ppo"].items() if (name, value) not in _DROPPED}
            configs = {method.settings: method.config for method in METHODS.values()}
            values |= {name: config(**values.get(name, {})) for name, config in configs.items()}
            return cls(**values)
        except (TypeError, AttributeError) as error:
            raise RunError(f"The settings in run.json do not fit this version of Racecraft: {error}.") from error


def make_settings(
    *,
    metadata: ModelMetadata,
    hyperparameters: Hyperparameters | None = None,
    network: str = "",
    vehicle: Vehicle | str = "",
    track: str | Path | Sequence[str | Path] = DEFAULT_TRACK,
    randomize: Randomization | str | Path = "none",
    num_envs: int = 0,
    algorithm: str = "",
    critic: str = "",
    ppo: PPOConfig | None = None,
    **settings: Any,
) -> TrainSettings:
    """Settings from AWS's files and what the user says beyond them.

    Without hyperparameters the defaults are Racecraft's own, tuned for speed. With them training follows AWS:
    whole episodes per iteration, its batch size, epochs, losses and exploration; exactly if the critic is its own, too,
    the ``camera``.

    Args:
        metadata: Its network and version are used where `network` and `vehicle` are not given.
        hyperparameters: AWS's, or None.
        network: Overrides the metadata's.
        vehicle: Preset, file or parameters; by default the preset of the metadata's version.
        track: One track, or several; with several, episodes start anywhere, a little beside the line, unless `start`
            says otherwise.
        randomize: Preset, file or ranges of what differs from episode to episode.
        num_envs: Cars driven at once; 0 decides by itself.
        algorithm: One of `racecraft.training.regimes.METHODS`; by default the metadata's, or the one that suits the
            race where nothing else says how the policy learns.
        critic: One of `CRITICS`; by default ``privileged``, against opponents on one track ``lap``.
        ppo: How the policy improves, instead of hyperparameters.
        settings: Other fields of `TrainSettings`.

    Raises:
        ConfigError: There is no such setting, a value is outside its range, or two do not go together.
    """
    known = [setting.name for setting in fields(TrainSettings)]
    for name in settings:
        if name not in known:
            raise ConfigError(f"There is no setting {name!r}. {did_you_mean(name, [*known, *ARGUMENTS])}".rstrip())
    if not isinstance(vehicle, Vehicle):
        vehicle = load_vehicle(vehicle or VEHICLE_OF_VERSION[metadata.version])
    if not isinstance(randomize, Randomization):
        randomize = load_randomization(randomize)
    roads, until = load_tracks(track), settings.get("until")
    kept = join_names(track)
    if kept.encode(errors="ignore").decode() != kept:
        raise ConfigError(f"track is {kept!r}; a run keeps that as text, which the name of the file has to be.")
    circumstances: dict[str, Any] = {
        "objects": settings.get("objects", NO_OBJECTS),
        "opponents": settings.get("opponents"),
        "num_tracks": len(roads),
        "device": settings.get("device", "cpu"),
    }
    network = network or metadata.neural_network
    if not algorithm:
        is_told = hyperparameters is not None or ppo is not None or network != "RACECRAFT_SMALL"
        is_taught = not is_told and critic in ("", "privileged") and metadata.training_algorithm != "sac"
        algorithm = regime_of(**circumstances).algorithm if is_taught else of_the_files(metadata)
    _check_actions(algorithm, metadata)
    method, is_continuous = METHODS[algorithm], metadata.action_space.kind == "continuous"
    is_fast = algorithm == "distill" and is_continuous
    circumstances["most_speed"] = metadata.action_space.most_speed if algorithm == "distill" else 0.0
    regime = regime_of(**circumstances, is_fast_distill=is_fast, lessons=_lessons(roads, until))
    is_raced = circumstances["opponents"] is not None
    pace = RACED_STEPS if is_raced else FAST_STEPS if is_fast else 0
    lessons = _as_long_as(until, regime.distill, pace=pace)
    usual = {
        "start": regime.start,
        "evaluation_trials": regime.evaluation_trials,
        "distill": lessons,
        "tells_nearby": algorithm == "distill" and circumstances["objects"] != NO_OBJECTS,
    }
    settings = {**usual, **settings}
    if settings.get("evaluate_every", 0) == 0:
        settings["evaluate_every"] = regime.evaluate_every
    if hyperparameters is not None and not method.is_awss:
        raise ConfigError(
            f"hyperparameters.json is for AWS's algorithms, {algorithm} is none of them.", hint="Leave it out."
        )
    if algorithm == "sac" and "sac" not in settings:
        theirs: dict[str, Any] = {} if hyperparameters is None else hyperparameters.to_sac()
        settings["sac"] = SACConfig(**theirs)
    if num_envs and method.settings != "ppo":
        check_whole("num_envs", num_envs, 1, TIME_TRIAL.most_envs, is_plain=True)
        settings[method.settings] = replace(settings.get(method.settings, method.config()), num_envs=num_envs)
    if hyperparameters is not None:
        if ppo is not None:
            raise ConfigError("ppo and hyperparameters both say how the policy improves; give one of them.")
        learning: dict[str, Any] = hyperparameters.to_ppo(is_exact=critic == "camera", is_continuous=is_continuous)
        ppo = PPOConfig(**learning, num_envs=num_envs or min(hyperparameters.num_episodes_between_training, 64))
    elif ppo is None:
        assert regime.ppo is not None
        ppo = regime.ppo
        if is_continuous:
            # A Gaussian keeps its spread by itself; a bonus for entropy would make it grow and the car restless.
            ppo = replace(ppo, ent_coef=0.0)
    if hyperparameters is None and num_envs:
        ppo = _with_num_envs(ppo, num_envs, most=regime.most_envs)
    return TrainSettings(
        track=kept,
        randomize=randomize,
        vehicle=vehicle,
        network=network,
        algorithm=algorithm,
        critic=critic or regime.critic,
        ppo=ppo,
        **settings,
    )


def of_the_files(metadata: ModelMetadata) -> str:
    """AWS's algorithm that a model's metadata names."""
    return "sac" if metadata.training_algorithm == "sac" else "ppo"


def _lessons(roads: Sequence[Track], until: Until | None) -> str:
    """What a training has time for on a long road: ``long``, ``brisk`` or ``short`` lessons; elsewhere, short ones."""
    if len(roads) != 1 or roads[0].length < LONG_ROAD:
        return "short"
    seconds = (isinstance(until, Until) and until.seconds) or math.inf
    return "long" if seconds >= LONG_SECONDS else "brisk" if seconds >= BRISK_SECONDS else "short"


def _as_long_as(until: Until | None, distill: DistillConfig | None, *, pace: int) -> DistillConfig | None:
    """The same lessons, for a training of few steps by a teacher of few: at most five to one of the student's.

    Args:
        until: When the training ends.
        distill: The lessons of one that has time for them.
        pace: Teacher's steps at most for every second that it may take; 0 for any number.
    """
    if not isinstance(until, Until) or distill is None:
        return distill
    most = [distill.teacher_steps]
    if until.steps:
        most.append(5 * until.steps)
    if until.seconds and pace:
        most.append(max(1, round(pace * until.seconds)))
    return replace(distill, teacher_steps=min(most))


def _with_num_envs(ppo: PPOConfig, num_envs: int, *, most: int) -> PPOConfig:
    """The same PPO with other cars: rollouts of about as many samples."""
    check_whole("num_envs", num_envs, 1, most, is_plain=True)
    num_steps = max(1, round(ppo.num_envs * ppo.num_steps / num_envs))
    minibatch_size = min(ppo.minibatch_size, num_envs * num_steps)
    return replace(ppo, num_envs=num_envs, num_steps=num_steps, minibatch_size=minibatch_size)


def _check_actions(algorithm: str, metadata: ModelMetadata) -> None:
    """Refuse an algorithm that cannot choose among these actions."""
    check_choice("algorithm", algorithm, tuple(METHODS))
    kind, allowed = metadata.action_space.kind, METHODS[algorithm].actions
    if kind not in allowed:
        preset = "default" if allowed[0] == "discrete" else allowed[0]
        raise ConfigError(
            f"{algorithm} needs a {allowed[0]} action space; this one is {kind}.",
            hint=f"Choose other actions, such as {preset} (--actions {preset}).",
        )
