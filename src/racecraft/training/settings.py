"""Everything that decides how a run trains, as one frozen value that run.json repeats."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field, fields, replace
from pathlib import Path
from typing import Any, Final

from racecraft.agent import Hyperparameters, ModelMetadata
from racecraft.checks import check_choice, check_type, check_whole
from racecraft.errors import ConfigError, RunError, did_you_mean
from racecraft.learn import DistillConfig, NetworkSpec, PPOConfig, SACConfig, network_names
from racecraft.learn.sb3 import CONTINUOUS_ONLY, DISCRETE_ONLY, SB3_ALGORITHMS, SB3Config
from racecraft.sim import CameraSpec, Randomization, Start, Vehicle, load_randomization, load_vehicle
from racecraft.sim.columns import state_width
from racecraft.sim.objects import NO_OBJECTS, Objects
from racecraft.sim.simulation import DIRECTIONS
from racecraft.track import join_names, load_tracks
from racecraft.training.lap_place import LAP_COLUMNS
from racecraft.training.opponents import Opponents
from racecraft.training.stop import Until

DEFAULT_TRACK: Final = "reinvent_2018"
VEHICLE_OF_VERSION: Final = {"1": "v4", "2": "v4", "3": "v4", "4": "v4", "5": "v5", "6": "v6"}
ALGORITHMS: Final = ("ppo", "sac", "distill", *(f"sb3:{name}" for name in SB3_ALGORITHMS))
SQUASHED: Final = ("sac", "sb3:sac", "sb3:td3")
"""Algorithms whose best action is the hyperbolic tangent of the policy's mean."""
_ADDED: Final = ("algorithm", "opponents", "sac", "distill", "sb3", "device")
"""Fields that runs of earlier versions lack."""
_DROPPED: Final = (("growth_steps", 0),)
"""Settings of PPO that runs of earlier versions have, with the value that meant nothing."""
CRITICS: Final = ("privileged", "lap", "camera")
EVALUATE_EVERY: Final = 4096
FAR_EVALUATE_EVERY: Final = 50_000
"""Camera steps between two evaluations where there are several tracks: one of them drives hundreds of metres."""
FAR_TRIALS: Final = 24
FAR_PPO: Final = PPOConfig(num_envs=128, minibatch_size=256, learning_rate=7e-4, ent_coef=0.005)
"""For many tracks: more cars see more of them at once, and smaller steps keep what was learned on the others."""
RACE_EVALUATE_EVERY: Final = 25_000
RACE_TRIALS: Final = 20
"""Laps of an evaluation among objects, whose places differ from lap to lap: five would say little."""
RACE_PPO: Final = PPOConfig(num_envs=128, minibatch_size=256, learning_rate=7e-4, rate_steps=250_000, ent_coef=0.005)
"""Among boxes and other cars, which take ten times the steps of a lap on a free road."""
RACE_GOOD: Final = 0.6
"""Mean completion of an evaluation from which on, among objects, the averaged weights drive."""
FAST_DISTILL: Final = DistillConfig(teacher_steps=2_000_000)
"""For continuous actions, whose teacher goes on getting faster for so long."""
FAST_START: Final = Start(advance=0.25, lateral_jitter=0.02, heading_jitter=math.radians(2.0))
"""Where episodes start then: every fourth as a race does, since a car that comes from standing meets the first corner
otherwise than one that flies past the line, as the other three do."""
DUEL_EVALUATE_EVERY: Final = 50_000
DUEL_PPO: Final = PPOConfig(
    num_envs=128,
    num_steps=32,
    minibatch_size=512,
    update_epochs=4,
    rate_steps=700_000,
    gamma=0.97,
    ent_coef=0.005,
)
"""Against other models: minutes, not seconds. Rollouts of two seconds tell what a line is worth, which short ones leave
to the critic."""
RACING: Final = Start(mode="random", lateral_jitter=0.05, shuffle=True)
"""Where races of several cars start: anywhere, and in any order."""
SCATTERED: Final = Start(mode="random", lateral_jitter=0.12, heading_jitter=0.2)
"""Where episodes on several tracks start: what the car meets there, no single line prepares it for."""
MAX_ENVS: Final = 4096  # cars; 80 MB of frames, and more would only wait for each other
MAX_CUDA_ENVS: Final = 65536  # on a GPU
CUDA_PPO: Final = PPOConfig(num_envs=1024, num_steps=8, minibatch_size=1024)
"""A GPU is fast when it has much to do at once; minibatches and steps are a compromise with learning."""
CUDA_EVALUATE_EVERY: Final = 100_000

Learning = PPOConfig | SACConfig | DistillConfig | SB3Config
"""Settings of one algorithm."""


@dataclass(frozen=True, kw_only=True)
class TrainSettings:
    """Settings of a training run, apart from its files (reward function, model metadata, hyperparameters)."""

    track: str = DEFAULT_TRACK
    """Name of a track, path of a track file, or several, as `racecraft.track.load_tracks` reads them."""
    until: Until = field(default_factory=lambda: Until(laps=5))
    """When to stop."""
    seed: int = 0
    """Key of every random number."""
    network: str = "RACECRAFT_SMALL"
    """Architecture, one of `racecraft.learn.network_names()`."""
    critic: str = "privileged"
    """What the critic sees while training: ``privileged`` state; that and where on the ``lap`` the car is; or the
    ``camera`` alone, as AWS's."""
    vehicle: Vehicle = field(default_factory=Vehicle)
    """The car."""
    start: Start = field(default_factory=lambda: Start(spread=True))
    """Where training episodes start."""
    direction: str = "forward"
    """``forward``, ``reverse`` or ``alternate`` with every episode."""
    randomize: Randomization = field(default_factory=Randomization)
    """From what ranges every episode draws its light, friction, camera pose, ..."""
    objects: Objects = NO_OBJECTS
    """Boxes and bot cars on the track; evaluations have them, too."""
    algorithm: str = "ppo"
    """What improves the policy, one of `ALGORITHMS`."""
    opponents: Opponents | None = None
    """Who drives the other cars of every race; None where the car is alone."""
    ppo: PPOConfig = field(default_factory=PPOConfig)
    """How PPO does it."""
    sac: SACConfig = field(default_factory=SACConfig)
    """How SAC does it."""
    distill: DistillConfig = field(default_factory=DistillConfig)
    """How distillation does it."""
    sb3: SB3Config = field(default_factory=SB3Config)
    """How Stable-Baselines3 does it."""
    evaluate_every: int = EVALUATE_EVERY
    """Camera steps between two evaluations, each followed by a checkpoint."""
    evaluation_trials: int = 5
    """Cars that drive one lap in each evaluation."""
    num_threads: int = 0
    """Threads of simulator and learner; 0 takes one per core. Results repeat for the same number."""
    device: str = "cpu"
    """Where cars drive and the policy learns: ``cpu``, ``cuda``, or ``cuda:1`` of several GPUs."""

    def __post_init__(self) -> None:
        for name, choice, allowed in (
            ("algorithm", self.algorithm, ALGORITHMS),
            ("network", self.network, network_names()),
            ("critic", self.critic, CRITICS),
            ("direction", self.direction, DIRECTIONS),
        ):
            check_choice(name, choice, allowed)
        for name, value, low, high in (
            ("num_envs", self.num_envs, 1, MAX_ENVS if self.device == "cpu" else MAX_CUDA_ENVS),
            ("seed", self.seed, 0, 2**32 - 1),
            ("evaluate_every", self.evaluate_every, 1, 10**9),
            ("evaluation_trials", self.evaluation_trials, 1, 100),
            ("num_threads", self.num_threads, 0, 1024),
        ):
            check_whole(name, value, low, high, is_plain=True)
        self.randomize.check(self.vehicle, CameraSpec())
        check_type("objects", self.objects, Objects, "use racecraft.sim.Objects(...)")
        kind, _, number = self.device.partition(":") if isinstance(self.device, str) else ("", "", "")
        if self.device != "cpu" and (kind != "cuda" or (":" in self.device and not number.isdecimal())):
            raise ConfigError(f"device is {self.device!r}; allowed are 'cpu', 'cuda', and 'cuda:1' for the second GPU.")
        if self.device != "cpu" and self.algorithm != "ppo":
            raise ConfigError(f"algorithm is {self.algorithm!r}; device {self.device!r} trains 'ppo' only.")
        if self.opponents is not None and not isinstance(self.opponents, Opponents):
            raise ConfigError(f"opponents are {self.opponents!r}; use racecraft.training.Opponents(...), or None.")
        if self.opponents is not None and self.algorithm != "ppo":
            raise ConfigError(f"algorithm is {self.algorithm!r}; among other cars only ppo learns in this version.")
        if self.opponents is not None and self.device != "cpu":
            raise ConfigError(f"device is {self.device!r}; races of several cars are driven on the cpu.")
        if self.critic == "lap" and (self.algorithm, self.device) != ("ppo", "cpu"):
            raise ConfigError(
                f"critic is 'lap', which is for algorithm 'ppo' on device 'cpu'; it is {self.algorithm!r} on "
                f"{self.device!r}. Allowed there are 'privileged' and 'camera'."
            )
        check_type("until", self.until, Until, "allowed is a text such as '5 laps'")
        if self.until.laps > self.evaluation_trials:
            object.__setattr__(self, "evaluation_trials", self.until.laps)

    @property
    def learning(self) -> Learning:
        """How the chosen algorithm learns."""
        named: dict[str, Learning] = {"ppo": self.ppo, "sac": self.sac, "distill": self.distill, "sb3": self.sb3}
        return named[self.algorithm.split(":")[0]]

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
            is_squashed=self.algorithm in SQUASHED,
            lenses=metadata.suite.lenses,
            lidar_size=metadata.suite.lidar_size,
        )

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
        return state_width(self.num_objects) + (LAP_COLUMNS if self.critic == "lap" else 0)

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
            for name, config in (
                ("ppo", PPOConfig),
                ("sac", SACConfig),
                ("distill", DistillConfig),
                ("sb3", SB3Config),
            ):
                values[name] = config(**values.get(name, {}))
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
    whole episodes per iteration, its batch size, epochs, losses and exploration.

    Args:
        metadata: Its network and version are used where `network` and `vehicle` are not given.
        hyperparameters: AWS's, or None.
        network: Overrides the metadata's.
        vehicle: Preset, file or parameters; by default the preset of the metadata's version.
        track: One track, or several; with several, episodes start anywhere, a little beside the line, unless `start`
            says otherwise.
        randomize: Preset, file or ranges of what differs from episode to episode.
        num_envs: Cars driven at once; 0 decides by itself.
        algorithm: One of `ALGORITHMS`; by default the metadata's.
        critic: One of `CRITICS`; by default ``privileged``, against opponents on one track ``lap``.
        ppo: How the policy improves, instead of hyperparameters.
        settings: Other fields of `TrainSettings`.

    Raises:
        ConfigError: There is no such setting, a value is outside its range, or two do not go together.
    """
    known = [setting.name for setting in fields(TrainSettings)]
    for name in settings:
        if name not in known:
            raise ConfigError(f"There is no setting {name!r}. {did_you_mean(name, [*known, 'num_envs'])}".rstrip())
    if not isinstance(vehicle, Vehicle):
        vehicle = load_vehicle(vehicle or VEHICLE_OF_VERSION[metadata.version])
    if not isinstance(randomize, Randomization):
        randomize = load_randomization(randomize)
    is_far = len(load_tracks(track)) > 1
    if is_far:
        settings = {"start": SCATTERED, "evaluation_trials": FAR_TRIALS, **settings}
    is_race = settings.get("objects", NO_OBJECTS) != NO_OBJECTS
    if is_race:
        settings = {"evaluation_trials": RACE_TRIALS, **settings}
    is_cuda = settings.get("device", "cpu") != "cpu"
    is_duel = settings.get("opponents") is not None
    if is_duel:
        settings = {"start": RACING, **settings}
    suited, often = PPOConfig(), EVALUATE_EVERY
    if is_far:
        suited, often = FAR_PPO, FAR_EVALUATE_EVERY
    elif is_race:
        suited, often = RACE_PPO, RACE_EVALUATE_EVERY
    elif is_duel:
        suited, often = DUEL_PPO, DUEL_EVALUATE_EVERY
    if settings.get("evaluate_every", 0) == 0:
        settings["evaluate_every"] = max(often, CUDA_EVALUATE_EVERY) if is_cuda else often
    algorithm = algorithm or ("sac" if metadata.training_algorithm == "sac" else "ppo")
    _check_actions(algorithm, metadata)
    if not critic:
        critic = "lap" if is_duel and not is_far else "privileged"
    if algorithm == "sac" and "sac" not in settings:
        if hyperparameters is not None:
            hyperparameters.check_algorithm("sac")
        theirs: dict[str, Any] = {} if hyperparameters is None else hyperparameters.to_sac()
        settings["sac"] = SACConfig(**theirs)
    if hyperparameters is not None and algorithm not in ("ppo", "sac"):
        raise ConfigError(
            f"hyperparameters.json is for AWS's algorithms, {algorithm} is none of them.", hint="Leave it out."
        )
    kind = algorithm.split(":")[0]
    if algorithm == "distill" and metadata.action_space.kind == "continuous":
        settings = {"distill": FAST_DISTILL, **({} if is_far else {"start": FAST_START}), **settings}
    if num_envs and kind != "ppo":
        check_whole("num_envs", num_envs, 1, MAX_ENVS, is_plain=True)
        begin: dict[str, Any] = {"sac": SACConfig(), "distill": DistillConfig(), "sb3": SB3Config()}
        settings[kind] = replace(settings.get(kind, begin[kind]), num_envs=num_envs)
    if hyperparameters is not None:
        if ppo is not None:
            raise ConfigError("ppo and hyperparameters both say how the policy improves; give one of them.")
        learning: dict[str, Any] = hyperparameters.to_ppo()
        ppo = PPOConfig(**learning, num_envs=num_envs or min(hyperparameters.num_episodes_between_training, 64))
    elif ppo is None:
        ppo = CUDA_PPO if is_cuda else suited
        if metadata.action_space.kind == "continuous":
            # A Gaussian keeps its spread by itself; a bonus for entropy would make it grow and the car restless.
            ppo = replace(ppo, ent_coef=0.0)
    if hyperparameters is None and num_envs:
        ppo = _with_num_envs(ppo, num_envs, most=MAX_CUDA_ENVS if is_cuda else MAX_ENVS)
    return TrainSettings(
        track=join_names(track),
        randomize=randomize,
        vehicle=vehicle,
        network=network or metadata.neural_network,
        algorithm=algorithm,
        critic=critic,
        ppo=ppo,
        **settings,
    )


def _with_num_envs(ppo: PPOConfig, num_envs: int, *, most: int) -> PPOConfig:
    """The same PPO with other cars: rollouts of about as many samples."""
    check_whole("num_envs", num_envs, 1, most, is_plain=True)
    num_steps = max(1, round(ppo.num_envs * ppo.num_steps / num_envs))
    minibatch_size = min(ppo.minibatch_size, num_envs * num_steps)
    return replace(ppo, num_envs=num_envs, num_steps=num_steps, minibatch_size=minibatch_size)


def _check_actions(algorithm: str, metadata: ModelMetadata) -> None:
    """Refuse an algorithm that cannot choose among these actions."""
    kind, name = metadata.action_space.kind, algorithm.removeprefix("sb3:")
    check_choice("algorithm", algorithm, ALGORITHMS)
    if kind == "discrete" and name in CONTINUOUS_ONLY:
        raise ConfigError(
            f"{algorithm} needs a continuous action space; this one is discrete.", hint="Give --actions continuous."
        )
    if kind == "continuous" and name in DISCRETE_ONLY:
        raise ConfigError(
            f"{algorithm} needs a discrete action space; this one is continuous.", hint="Give --actions default."
        )
