"""Reward functions: AWS's ``reward_function(params)``, checked before it runs, and run in its own process.

    source = load_reward("racing")  # a preset, or the path of a reward_function.py
    validate_reward(source)
    with RewardWorker(source, tracks) as worker:
        rewards = worker(simulation.rows)  # (N,)

``params.py`` is the one place where a row of the simulation becomes the dict that the user sees.
"""

from racecraft.reward.check import Problem, check_reward, validate_reward
from racecraft.reward.dry_run import Outcome, Situation, dry_run, dry_run_on, situations
from racecraft.reward.params import format_params, make_params
from racecraft.reward.source import load_preset, load_reward, preset_names
from racecraft.reward.state import keeps_state
from racecraft.reward.worker import RewardWorker

__all__ = [
    "Outcome",
    "Problem",
    "RewardWorker",
    "Situation",
    "check_reward",
    "dry_run",
    "dry_run_on",
    "format_params",
    "keeps_state",
    "load_preset",
    "load_reward",
    "make_params",
    "preset_names",
    "situations",
    "validate_reward",
]
