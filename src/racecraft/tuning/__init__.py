"""Search: better hyperparameters and constants of a reward function, by trials that are runs.

Optuna (the extra ``tune``) is imported when a search begins, not before.
"""

from __future__ import annotations

from racecraft.tuning.constants import find_constants, rewrite_constants
from racecraft.tuning.outcome import Outcome, TrialOutcome
from racecraft.tuning.space import HYPERPARAMETERS, Parameter, make_space
from racecraft.tuning.start import make_tuning, plan_of, space_of, start_tuning
from racecraft.tuning.study import GOALS, Tuning, check_limits

__all__ = [
    "GOALS",
    "HYPERPARAMETERS",
    "Outcome",
    "Parameter",
    "TrialOutcome",
    "Tuning",
    "check_limits",
    "find_constants",
    "make_space",
    "make_tuning",
    "plan_of",
    "rewrite_constants",
    "space_of",
    "start_tuning",
]
