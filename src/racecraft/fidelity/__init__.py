"""Logs that the original wrote, held against the simulator, and cars fitted to them.

log -> *replay* -> rules (agreement), dynamics (error), rewards (agreement)
log -> *calibrate* -> vehicle file
camera frame -> *fit_frame* -> pose of the lens, likeness of our frame from there
"""

from racecraft.fidelity.calibrate import Calibration, calibrate
from racecraft.fidelity.comparison import Comparison, replay
from racecraft.fidelity.differences import Difference, Differences
from racecraft.fidelity.frame import FrameFit, draw_frame, fit_frame
from racecraft.fidelity.logs import Log, read_logs
from racecraft.fidelity.picture import draw_comparison
from racecraft.fidelity.rules import TrackRules

__all__ = [
    "Calibration",
    "Comparison",
    "Difference",
    "Differences",
    "FrameFit",
    "Log",
    "TrackRules",
    "calibrate",
    "draw_comparison",
    "draw_frame",
    "fit_frame",
    "read_logs",
    "replay",
]
