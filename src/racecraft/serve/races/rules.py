"""By which rules and in which car models race, from what was asked for; and the sets of rules to choose from."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, get_args

from racecraft.race.rules import RaceRules, race_rules
from racecraft.serve.conditions import randomization_of, vehicle_of
from racecraft.sim.camera import CameraSpec
from racecraft.sim.randomization import Randomization
from racecraft.sim.vehicle import Vehicle

if TYPE_CHECKING:  # jobs do without messages
    from racecraft.serve.races.schemas import RaceSettings, RuleSet

CHOSEN: Final = ("max_resets", "offtrack_penalty", "collision_penalty", "time_limit", "direction")
"""Rules that whoever holds a race may choose one by one, besides the laps; the others are the set's."""


def rules_of(asked: RaceSettings, *, laps: int | None) -> RaceRules:
    """The rules that a request asks for.

    Args:
        asked: A set, and what differs from it.
        laps: To a race; by default the set's.
    """
    changes = {"laps": laps, **{name: getattr(asked, name) for name in CHOSEN}}
    return race_rules(asked.rules, {name: value for name, value in changes.items() if value is not None})


def car_of(asked: RaceSettings) -> tuple[Vehicle, Randomization]:
    """The car that a request asks for, and what is otherwise than the models know.

    Raises:
        ConfigError: One of them is none of ours, or the two together make a car that cannot be.
    """
    vehicle, randomize = vehicle_of(asked.vehicle), randomization_of(asked.randomize)
    randomize.check(vehicle, CameraSpec())
    return vehicle, randomize


def rule_sets() -> list[RuleSet]:
    """All that a race can be held by, the usual one first."""
    from racecraft.serve.races.schemas import RaceSettings, RuleSet

    names, told = get_args(RaceSettings.model_fields["rules"].annotation), RuleSet.model_fields
    rules = {name: race_rules(name, {}).to_dict() for name in names}
    return [RuleSet(name=name, **{key: rules[name][key] for key in rules[name] if key in told}) for name in names]
