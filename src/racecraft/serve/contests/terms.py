"""What a heat or a ladder is held by: settled from the request when it is made, kept in its job, told on its page.

request -> *settle* -> payload["terms"] -> *terms_of* -> the job, the page
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from typing import TYPE_CHECKING, Any, Final

from racecraft.contest.terms import TOGETHER
from racecraft.race.rules import RaceRules
from racecraft.serve.conditions import randomization_of, vehicle_of
from racecraft.serve.races.rules import car_of, rules_of
from racecraft.sim.objects import Objects
from racecraft.sim.randomization import Randomization
from racecraft.sim.vehicle import Vehicle

if TYPE_CHECKING:  # jobs do without messages
    from racecraft.serve.contests.schemas import NewHeat, NewLadder

RACES: Final = {"none": "time-trial", "boxes": "object-avoidance", "bots": "head-to-bot"}
"""Kind of race by what is on the road."""


@dataclass(frozen=True, kw_only=True)
class Terms:
    """Everything but the models, the roads and the seed, whole."""

    rules: RaceRules
    objects: Objects
    vehicle: Vehicle
    randomize: Randomization

    def to_dict(self) -> dict[str, Any]:
        """As JSON."""
        return {
            "rules": self.rules.to_dict(),
            "objects": self.objects.to_dict(),
            "vehicle": asdict(self.vehicle),
            "randomize": asdict(self.randomize),
        }


def settle(request: NewHeat | NewLadder) -> Terms:
    """What a new heat or ladder is held by.

    Raises:
        ConfigError: A setting does not go with the others.
    """
    from racecraft.serve.contests.schemas import NewHeat
    from racecraft.serve.road import road_objects

    rules, race = rules_of(request, laps=request.laps), RACES[request.objects or "none"]
    if isinstance(request, NewHeat) or request.kind in TOGETHER:
        rules = replace(rules, is_continuous=True)  # as `shared_road` holds it
    else:
        race = request.kind
    vehicle, randomize = car_of(request)
    objects = road_objects(request, race, count=request.count)
    return Terms(rules=rules, objects=objects, vehicle=vehicle, randomize=randomize)


def terms_of(payload: Mapping[str, Any]) -> Terms:
    """What the job of a heat or a ladder is held by; of one from before that was kept, what its request says."""
    if kept := payload.get("terms"):
        has_car = "vehicle" in kept  # else it is from before that was kept, too
        return Terms(
            rules=RaceRules.from_dict(kept["rules"]),
            objects=Objects.from_dict(kept["objects"]),
            vehicle=Vehicle(**kept["vehicle"]) if has_car else vehicle_of(payload["vehicle"]),
            randomize=Randomization(**kept["randomize"])
            if has_car
            else randomization_of(payload.get("randomize", "none")),
        )
    from racecraft.serve.contests.schemas import NewHeat, NewLadder

    kind: type[NewHeat] | type[NewLadder] = NewLadder if "schedule" in payload else NewHeat
    said = {name: value for name, value in payload.items() if name in kind.model_fields}
    return settle(kind.model_validate({"time_limit": 0.0, **said}))
