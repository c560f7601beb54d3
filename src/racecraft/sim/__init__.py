"""Simulation: the Python face of the native core. It owns the batch's buffers and hands them out as NumPy views."""

from racecraft.sim.camera import CameraSpec
from racecraft.sim.columns import OBJECT_COLUMNS, OBJECT_HEADER, ROW_COLUMNS, STATE_COLUMNS, STATUS_NAMES
from racecraft.sim.cuda_simulation import CudaSimulation
from racecraft.sim.objects import (
    NO_OBJECTS,
    Bots,
    Objects,
    Obstacles,
    has_aws_meaning,
    objects_for_race,
    objects_from_aws,
)
from racecraft.sim.randomization import CONDITIONS, Randomization, load_randomization
from racecraft.sim.simulation import (
    CONTROL_DT,
    MAX_STEERING,
    Simulation,
    Start,
    core_build,
    instruction_set,
    slower_than_could_be,
)
from racecraft.sim.vehicle import Vehicle, load_vehicle

__all__ = [
    "CONDITIONS",
    "CONTROL_DT",
    "MAX_STEERING",
    "NO_OBJECTS",
    "OBJECT_COLUMNS",
    "OBJECT_HEADER",
    "ROW_COLUMNS",
    "STATE_COLUMNS",
    "STATUS_NAMES",
    "Bots",
    "CameraSpec",
    "CudaSimulation",
    "Objects",
    "Obstacles",
    "Randomization",
    "Simulation",
    "Start",
    "Vehicle",
    "core_build",
    "has_aws_meaning",
    "instruction_set",
    "load_randomization",
    "load_vehicle",
    "objects_for_race",
    "objects_from_aws",
    "slower_than_could_be",
]
