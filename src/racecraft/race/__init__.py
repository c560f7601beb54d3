"""How good a driver is: evaluation, rules, statistics, standings, replays, video and the picture of the racing line."""

from racecraft.race.autopilot import Autopilot
from racecraft.race.conditions import Conditions
from racecraft.race.evaluation import Completion, completion, evaluate, trial_simulation
from racecraft.race.generalization import Generalization, TrackResult, generalize
from racecraft.race.policy import load_driver
from racecraft.race.race_replay import Replay, read_replay, write_replay
from racecraft.race.racing_line import draw_racing_line
from racecraft.race.recording import Recording
from racecraft.race.results import Evaluation, Lap, Trial
from racecraft.race.rules import RULE_SETS, RaceRules
from racecraft.race.standings import RANKINGS, places, ranking_score
from racecraft.race.statistics import Interval, mean_interval, wilson_interval
from racecraft.race.verification import Verification, verify
from racecraft.race.video import film
from racecraft.race.yardstick import OfficialRace, Placing, official_races, placings

__all__ = [
    "RANKINGS",
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
    "Replay",
    "TrackResult",
    "Trial",
    "Verification",
    "completion",
    "draw_racing_line",
    "evaluate",
    "film",
    "generalize",
    "load_driver",
    "mean_interval",
    "official_races",
    "places",
    "placings",
    "ranking_score",
    "read_replay",
    "trial_simulation",
    "verify",
    "wilson_interval",
    "write_replay",
]
