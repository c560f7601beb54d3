"""How good a driver is: the rules of a race, the marshal who judges by them, evaluation and its statistics."""

from racecraft.race.autopilot import Autopilot
from racecraft.race.conditions import Conditions
from racecraft.race.evaluation import Completion, completion, evaluate, trial_simulation
from racecraft.race.generalization import Generalization, TrackResult, generalize
from racecraft.race.policy import load_driver
from racecraft.race.recording import Recording
from racecraft.race.results import Evaluation, Lap, Trial
from racecraft.race.rules import RULE_SETS, RaceRules
from racecraft.race.statistics import Interval, mean_interval, wilson_interval
from racecraft.race.yardstick import OfficialRace, Placing, official_races, placings

__all__ = [
    "RULE_SETS",
    "Autopilot",
    "Completion",
    "Conditions",
    "Evaluation",
    "Generalization",
    "Interval",
    "Lap",
    "OfficialRace",
    "Placing",
    "RaceRules",
    "Recording",
    "TrackResult",
    "Trial",
    "completion",
    "evaluate",
    "generalize",
    "load_driver",
    "mean_interval",
    "official_races",
    "placings",
    "trial_simulation",
    "wilson_interval",
]
