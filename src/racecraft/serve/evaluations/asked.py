"""What an evaluation is asked for otherwise than its model learned: checked when it is asked, kept in its job.

request -> *settle* -> the job's payload -> `tasks.evaluate`
"""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING, Any, Final

from racecraft.errors import ConfigError
from racecraft.judging.trained import trained_camera, trained_vehicle
from racecraft.run import RunInfo
from racecraft.serve.conditions import randomization_of, vehicle_of
from racecraft.serve.road import OnRoad, road_objects

if TYPE_CHECKING:
    from racecraft.serve.evaluations.schemas import EvaluateModel

NUMBERED: Final = {"vehicle", "randomize"}
"""Settings that a payload has in numbers, whatever they were called."""
OF_ROAD: Final = {"objects", *OnRoad.model_fields}


def settle(request: EvaluateModel, info: RunInfo) -> dict[str, Any]:
    """The job's payload, but for its track.

    Args:
        request: What is left out is as the model learned it.
        info: Of the model's run.

    Raises:
        ConfigError: A setting is not allowed, or does not go with the others.
    """
    payload = request.model_dump(exclude_none=True, exclude={"race", *OF_ROAD, *NUMBERED})
    vehicle = trained_vehicle(info) if request.vehicle is None else vehicle_of(request.vehicle)
    randomize = randomization_of(request.randomize)
    randomize.check(vehicle, trained_camera(info))
    payload |= {"vehicle": asdict(vehicle), "randomize": asdict(randomize)}
    if request.race is not None:
        payload["objects"] = road_objects(request, request.race, count=request.objects).to_dict()
    elif given := sorted(OF_ROAD & request.model_fields_set):
        raise ConfigError(f"{given[0]} goes with a race: time-trial, object-avoidance or head-to-bot.")
    return payload
