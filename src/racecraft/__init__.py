"""Racecraft: autonomous racing with reinforcement learning, on your own machine.

    from racecraft import train, evaluate

    result = train("reinvent_2018", reward="racing", until="5 laps", seed=1)
    evaluation = evaluate(result.run, laps=3)

Everything public is here; the packages below are the rooms it lives in (see ARCHITECTURE.md).
"""

from __future__ import annotations

import sys
from importlib import import_module

from racecraft.version import VERSION

TYPE_CHECKING = False  # `typing` would take two thirds of this import, which nobody can interrupt without a stack trace
__version__ = VERSION

_HOME = {
    "CameraSpec": "sim",
    "Hyperparameters": "agent",
    "ModelMetadata": "agent",
    "RaceRules": "race",
    "RacecraftEnv": "env",
    "RacecraftError": "errors",
    "RacecraftVectorEnv": "env",
    "RewardWorker": "reward",
    "Randomization": "sim",
    "Simulation": "sim",
    "Start": "sim",
    "Track": "track",
    "Vehicle": "sim",
    "action_space": "agent",
    "check_reward": "reward",
    "draw_track": "track",
    "evaluate": "judging.evaluation:evaluate_run",
    "generalize": "judging.generalization:generalize_run",
    "generate_track": "track",
    "load_reward": "reward",
    "load_track": "track",
    "load_tracks": "track",
    "race_models": "judging.race",
    "rate_models": "judging.ladder",
    "read_replay": "replay",
    "resume": "training",
    "track_names": "track",
    "train": "training",
    "verify": "replay",
}
"""Where each public name lives below ``racecraft``, and after a colon what it is called there."""

__all__ = sorted(_HOME)

if TYPE_CHECKING:
    from typing import Any

    from racecraft.agent import Hyperparameters as Hyperparameters
    from racecraft.agent import ModelMetadata as ModelMetadata
    from racecraft.agent import action_space as action_space
    from racecraft.env import RacecraftEnv as RacecraftEnv
    from racecraft.env import RacecraftVectorEnv as RacecraftVectorEnv
    from racecraft.errors import RacecraftError as RacecraftError
    from racecraft.judging.evaluation import evaluate_run
    from racecraft.judging.generalization import generalize_run
    from racecraft.judging.ladder import rate_models as rate_models
    from racecraft.judging.race import race_models as race_models
    from racecraft.race import RaceRules as RaceRules
    from racecraft.replay import read_replay as read_replay
    from racecraft.replay import verify as verify
    from racecraft.reward import RewardWorker as RewardWorker
    from racecraft.reward import check_reward as check_reward
    from racecraft.reward import load_reward as load_reward
    from racecraft.sim import CameraSpec as CameraSpec
    from racecraft.sim import Randomization as Randomization
    from racecraft.sim import Simulation as Simulation
    from racecraft.sim import Start as Start
    from racecraft.sim import Vehicle as Vehicle
    from racecraft.track import Track as Track
    from racecraft.track import draw_track as draw_track
    from racecraft.track import generate_track as generate_track
    from racecraft.track import load_track as load_track
    from racecraft.track import load_tracks as load_tracks
    from racecraft.track import track_names as track_names
    from racecraft.training import resume as resume
    from racecraft.training import train as train

    evaluate = evaluate_run
    generalize = generalize_run


def __getattr__(name: str) -> Any:
    """Import on first use, so that ``import racecraft`` costs nothing."""
    if name in _HOME:
        home, _, inside = _HOME[name].partition(":")
        return getattr(import_module(f"racecraft.{home}"), inside or name)
    raise AttributeError(f"module 'racecraft' has no attribute {name!r}")


def __dir__() -> list[str]:
    return [*sorted(_HOME), "__version__"]


if "gymnasium" in sys.modules:  # it may be the importer: gymnasium.make("racecraft:Racecraft-v0")
    import_module("racecraft.env")
