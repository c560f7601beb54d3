"""What a run's files say about how its car learned and drives: laps, corners, maps, saliency, and a report of it all.

sim-traces, history, checkpoints ──▶ analysis ──▶ the console's pages, `racecraft report`
"""

from racecraft.analysis.corners import Passage, Sector, passages, sectors_of
from racecraft.analysis.laps import TracedLap, driven_direction, in_one, read_laps, split_laps, start_place
from racecraft.analysis.maps import TrackMaps, draw_maps, iterations_of
from racecraft.analysis.paid_laps import PaidLap, pay_laps
from racecraft.analysis.report import report, write_report

__all__ = [
    "PaidLap",
    "Passage",
    "Sector",
    "TracedLap",
    "TrackMaps",
    "draw_maps",
    "driven_direction",
    "in_one",
    "iterations_of",
    "passages",
    "pay_laps",
    "read_laps",
    "report",
    "sectors_of",
    "split_laps",
    "start_place",
    "write_report",
]
