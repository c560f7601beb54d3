"""Simulation: the Python face of the native core. It owns the batch's buffers and hands them out as NumPy views."""

from racecraft.sim.camera import CameraSpec
from racecraft.sim.columns import ROW_COLUMNS, STATE_COLUMNS, STATUS_NAMES
from racecraft.sim.simulation import CONTROL_DT, MAX_STEERING, Simulation, Start, instruction_set
from racecraft.sim.vehicle import Vehicle, load_vehicle

__all__ = [
    "CONTROL_DT",
    "MAX_STEERING",
    "ROW_COLUMNS",
    "STATE_COLUMNS",
    "STATUS_NAMES",
    "CameraSpec",
    "Simulation",
    "Start",
    "Vehicle",
    "instruction_set",
    "load_vehicle",
]
