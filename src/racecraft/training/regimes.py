"""The kinds of training, a row each: what one does where nothing else is said, and what does not go with it.

A training is of several kinds at once, say among objects on many tracks. `regime_of` reads the table from the top:
every default is that of the first row that applies and has one.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import TYPE_CHECKING, Any, Final

from racecraft.errors import ConfigError
from racecraft.learn import DistillConfig, PPOConfig, SACConfig
from racecraft.learn.sb3 import CONTINUOUS_ONLY, DISCRETE_ONLY, SB3_ALGORITHMS, SB3Config
from racecraft.sim import Start
from racecraft.sim.objects import NO_OBJECTS, Objects

if TYPE_CHECKING:
    from racecraft.training.opponents import Opponents

AlgorithmConfig = PPOConfig | SACConfig | DistillConfig | SB3Config
"""Settings of one algorithm."""


@dataclass(frozen=True, kw_only=True)
class Regime:
    """One kind of training: what `racecraft.training.train` takes; what is left out is decided by the rows below."""

    reward: str = ""
    actions: str = ""
    sensors: tuple[str, ...] = ()
    until: str = ""
    start: Start | None = None
    critic: str = ""
    algorithm: str = ""
    ppo: PPOConfig | None = None
    distill: DistillConfig | None = None
    evaluate_every: int = 0
    evaluation_trials: int = 0
    most_envs: int = 0
    """Cars at once, at most."""
    good: float = 0.0
    """Mean completion of an evaluation from which on the averaged weights drive."""
    only: Mapping[str, tuple[tuple[str, ...], str]] = field(default_factory=dict)
    """By setting: the values that are allowed, and why."""


CUDA: Final = Regime(
    algorithm="ppo",
    # A GPU is fast when it has much to do at once; minibatches and steps are a compromise with learning.
    ppo=PPOConfig(num_envs=1024, num_steps=8, minibatch_size=1024),
    most_envs=65536,
    evaluate_every=100_000,
    only={"algorithm": (("ppo",), "device {device!r} trains 'ppo' only")},
)
MANY_TRACKS: Final = Regime(
    # What the car meets, no single line prepares it for.
    start=Start(mode="random", lateral_jitter=0.12, heading_jitter=0.2),
    critic="privileged",
    # More cars see more of the tracks at once, and smaller steps keep what was learned on the others.
    ppo=PPOConfig(num_envs=128, minibatch_size=256, learning_rate=7e-4, ent_coef=0.005),
    evaluate_every=50_000,  # as one of them drives hundreds of metres
    evaluation_trials=24,
)
OBJECTS: Final = Regime(
    # 1 m/s, a reward that knows what is ahead, and a LIDAR, which sees what is beside the car.
    reward="dodge",
    actions="steady",
    sensors=("FRONT_FACING_CAMERA", "LIDAR"),
    until="20 laps or 10 minutes",
    # A teacher that is told where they stand learns the way round in seconds, and its student most of it in lessons
    # whose steps stay large for long; PPO alone comes there after minutes, if at all: docs/log/among-objects.md.
    algorithm="distill",
    distill=DistillConfig(
        teacher_steps=1_500_000, gamma=0.9, student_steps=300_000, rate_steps=100_000, buffer_size=64_000
    ),
    # Without one, boxes and other cars take ten times the steps of a lap on a free road.
    ppo=PPOConfig(num_envs=128, minibatch_size=256, learning_rate=7e-4, rate_steps=250_000, ent_coef=0.005),
    evaluate_every=25_000,
    evaluation_trials=20,  # the places differ from lap to lap: five would say little
    good=0.6,
)
WALK: Final = 1.0
"""m/s; who drives faster than that among objects learns as `FAST_OBJECTS` says."""
FAST_OBJECTS: Final = Regime(
    # What a car at 1 m/s must know of the next object happens within a second; a faster one turns in earlier, and
    # would rather run into something now and then than lift, were it not dear.
    reward="slalom",
    distill=DistillConfig(teacher_steps=1_500_000, gamma=0.97, student_steps=100_000, buffer_size=64_000),
)
DUEL: Final = Regime(
    # Pace, with dearer mistakes; time to find it; a LIDAR that sees who is beside.
    reward="duel",
    actions="continuous",
    sensors=("FRONT_FACING_CAMERA", "LIDAR"),
    until="10 minutes",
    start=Start(mode="random", lateral_jitter=0.05, shuffle=True),  # anywhere, and in any order
    critic="lap",
    # A teacher that is told where everybody is finds out in a minute how to pass; its student, which sees it, is faster
    # after two minutes than PPO alone after twenty: docs/log/self-play.md.
    algorithm="distill",
    distill=DistillConfig(
        num_envs=128,
        teacher_steps=3_000_000,
        teacher_rate_steps=1_200_000,
        student_steps=250_000,
        rate_steps=70_000,
        refining_rate=1e-3,  # whom it meets changes with it, and there is more to learn than from a road
        refining_rate_steps=1_000_000,
        buffer_size=64_000,
    ),
    # Of who learns without one: minutes, not seconds. Rollouts of two seconds tell what a line is worth, which short
    ppo=PPOConfig(
        num_envs=128,
        num_steps=32,
        minibatch_size=512,
        update_epochs=4,
        rate_steps=700_000,
        gamma=0.97,
        ent_coef=0.005,
    ),
    evaluate_every=50_000,
    only={
        "algorithm": (("ppo", "distill"), "among other cars only ppo and distill learn in this version"),
        "device": (("cpu",), "races of several cars are driven on the cpu"),
    },
)
RACED_STEPS: Final = 10_000
"""Of a teacher in a race, for every second that a training may take: 20 µs each, and it drives every car."""
FAST_STEPS: Final = 30_000
"""Of one that is to be fast alone: a third of the time, of two cores."""
FAST_DISTILL: Final = Regime(
    # Every fourth episode starts as a race does, since a car that comes from standing meets the first corner otherwise
    # than one that flies past the line, as the other three do.
    until="no better lap or 10 minutes",  # five laps are the least of it
    start=Start(advance=0.25, lateral_jitter=0.02, heading_jitter=math.radians(2.0)),
    distill=DistillConfig(teacher_steps=2_000_000),  # a teacher of continuous actions gets faster for so long
)
LONG_ROAD: Final = 45.0
"""m; who is to be fast there learns as `LONG_FAST_DISTILL` says, or `BRISK_FAST_DISTILL`."""
LONG_SECONDS: Final = 180.0
"""Wall clock that long lessons must leave something of."""
BRISK_SECONDS: Final = 100.0
"""And brisk ones."""
LONG_FAST_DISTILL: Final = Regime(
    # A teacher that knows all of the road takes longer, and its student the more so; it is told where it is and what
    # comes, or it drives each bend for itself: docs/log/fastest-lap.md.
    critic="lap",
    distill=DistillConfig(
        teacher_steps=5_000_000, teacher_rate_steps=2_000_000, student_steps=600_000, rate_steps=150_000
    ),
)
BRISK_FAST_DISTILL: Final = Regime(
    # The same for who has two minutes.
    critic="lap",
    distill=DistillConfig(
        teacher_steps=3_000_000, teacher_rate_steps=1_200_000, student_steps=250_000, rate_steps=70_000
    ),
)
TIME_TRIAL: Final = Regime(
    reward="racing",
    actions="default",
    sensors=("FRONT_FACING_CAMERA",),
    until="5 laps",
    start=Start(spread=True),
    critic="privileged",
    algorithm="ppo",
    ppo=PPOConfig(),
    distill=DistillConfig(),
    most_envs=4096,  # 80 MB of frames, and more would only wait for each other
    evaluate_every=4096,
    evaluation_trials=5,
    good=1.0,
)
"""Alone against the clock on one track, on the CPU: what all others differ from."""


def regimes_of(
    *,
    objects: Objects = NO_OBJECTS,
    opponents: Opponents | None = None,
    num_tracks: int = 1,
    most_speed: float = 0.0,
    device: str = "cpu",
    is_fast_distill: bool = False,
    lessons: str = "short",
) -> tuple[Regime, ...]:
    """The rows that apply, the most particular first."""
    rows = (
        (CUDA, device != "cpu"),
        (MANY_TRACKS, num_tracks > 1),
        (FAST_OBJECTS, objects != NO_OBJECTS and most_speed > WALK),
        (OBJECTS, objects != NO_OBJECTS),
        (DUEL, opponents is not None),
        (LONG_FAST_DISTILL, is_fast_distill and lessons == "long"),
        (BRISK_FAST_DISTILL, is_fast_distill and lessons == "brisk"),
        (FAST_DISTILL, is_fast_distill),
        (TIME_TRIAL, True),
    )
    return tuple(regime for regime, applies in rows if applies)


def regime_of(**circumstances: Any) -> Regime:
    """The whole row of a training; the arguments are those of `regimes_of`."""
    rows = regimes_of(**circumstances)
    names = [setting.name for setting in fields(Regime) if setting.name != "only"]
    return Regime(**{name: next(value for row in rows if (value := getattr(row, name))) for name in names})


def check_regimes(chosen: Mapping[str, Any], **circumstances: Any) -> None:
    """ConfigError where settings do not go with a training's kind; the other arguments are those of `regimes_of`."""
    for regime in regimes_of(**circumstances):
        for name, (allowed, reason) in regime.only.items():
            if chosen[name] not in allowed:
                raise ConfigError(f"{name} is {chosen[name]!r}; {reason.format(**chosen)}.")


_KINDS: Final = (("discrete", CONTINUOUS_ONLY), ("continuous", DISCRETE_ONLY))
"""Kinds of action space, with the algorithms of Stable-Baselines3 that are for others only."""


@dataclass(frozen=True, kw_only=True)
class Method:
    """An algorithm, as far as others must know it."""

    settings: str
    """Field of `TrainSettings` that holds its own."""
    config: type[AlgorithmConfig]
    """What is in there."""
    actions: tuple[str, ...] = ("discrete", "continuous")
    """Kinds of action space that it can choose from."""
    is_squashed: bool = False
    """Whether its best action is the hyperbolic tangent of the policy's mean."""
    is_awss: bool = False
    """Whether AWS's hyperparameters are for it."""
    sees_all: bool = True
    """Whether it learns with every sensor, not with one camera only."""


METHODS: Final[Mapping[str, Method]] = {
    "ppo": Method(settings="ppo", config=PPOConfig, is_awss=True),
    "sac": Method(settings="sac", config=SACConfig, actions=("continuous",), is_squashed=True, is_awss=True),
    "distill": Method(settings="distill", config=DistillConfig),
    **{
        f"sb3:{name}": Method(
            settings="sb3",
            config=SB3Config,
            actions=tuple(kind for kind, others in _KINDS if name not in others),
            is_squashed=name in CONTINUOUS_ONLY,
            sees_all=False,
        )
        for name in SB3_ALGORITHMS
    },
}
"""The algorithms by name."""
