"""How good a driver is: evaluation, rules, statistics, standings, video and the picture of the racing line."""

from racecraft.race.autopilot import Autopilot
from racecraft.race.evaluation import Completion, completion, evaluate, trial_simulation
from racecraft.race.generalization import Generalization, TrackResult, generalize
from racecraft.race.racing_line import draw_racing_line
from racecraft.race.recording import Recording
from racecraft.race.results import Evaluation, Lap, Trial
from racecraft.race.rules import RULE_SETS, RaceRules
from racecraft.race.standings import RANKINGS, places, ranking_score
from racecraft.race.statistics import Interval, mean_interval, wilson_interval
from racecraft.race.video import film
from racecraft.race.yardstick import OfficialRace, Placing, official_races, placings

__all__ = [
    "RANKINGS",
    "RULE_SETS",
    "Autopilot",
    "Completion",
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
    "draw_racing_line",
    "evaluate",
    "film",
    "generalize",
    "mean_interval",
    "official_races",
    "places",
    "placings",
    "ranking_score",
    "trial_simulation",
    "wilson_interval",
]
