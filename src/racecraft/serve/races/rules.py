"""By which rules models race, from what was asked for; and the sets of rules to choose from."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict
from typing import TYPE_CHECKING, Any, Final, get_args

from racecraft.race.rules import RaceRules, race_rules
from racecraft.sim.randomization import PRESETS as RANDOMIZATIONS

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


def rule_sets() -> list[RuleSet]:
    """All that a race can be held by, the usual one first."""
    from racecraft.serve.races.schemas import RaceSettings, RuleSet

    names, told = get_args(RaceSettings.model_fields["rules"].annotation), RuleSet.model_fields
    rules = {name: race_rules(name, {}).to_dict() for name in names}
    return [RuleSet(name=name, **{key: rules[name][key] for key in rules[name] if key in told}) for name in names]


def randomization_name(ranges: Mapping[str, Any]) -> str:
    """The preset that ranges are, empty where they are none of this version's."""
    for name, preset in RANDOMIZATIONS.items():
        if {field: list(ends) for field, ends in asdict(preset).items()} == {key: list(v) for key, v in ranges.items()}:
            return name
    return ""
