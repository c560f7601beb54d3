"""Sweeps: a table of settings, each trained with the same seeds, and what can be told apart.

One seed tells little: the same settings reach their laps after 4,000 steps with one and after 20,000 with the next.
"""

from __future__ import annotations

from racecraft.sweeping.board import Board, Figure, Place, board_of
from racecraft.sweeping.plan import Setting, SweepPlan, read_sweep
from racecraft.sweeping.sweep import Sweep, make_sweep, sweep_names

__all__ = [
    "Board",
    "Figure",
    "Place",
    "Setting",
    "Sweep",
    "SweepPlan",
    "board_of",
    "make_sweep",
    "read_sweep",
    "sweep_names",
]
