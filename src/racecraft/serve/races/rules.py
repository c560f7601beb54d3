"""By which rules models race, from what was asked for; and the sets of rules to choose from."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict
from typing import Any, Final, get_args

from racecraft.race.rules import RaceRules, race_rules
from racecraft.serve.races.schemas import RaceSettings, RuleSet
from racecraft.sim.randomization import PRESETS as RANDOMIZATIONS

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
    names = get_args(RaceSettings.model_fields["rules"].annotation)
    return [RuleSet(name=name, **_shown(race_rules(name, {}))) for name in names]


def randomization_name(ranges: Mapping[str, Any]) -> str:
    """The preset that ranges are, empty where they are none of this version's."""
    for name, preset in RANDOMIZATIONS.items():
        if {field: list(ends) for field, ends in asdict(preset).items()} == {key: list(v) for key, v in ranges.items()}:
            return name
    return ""


def _shown(rules: RaceRules) -> dict[str, Any]:
    return {name: value for name, value in rules.to_dict().items() if name in RuleSet.model_fields}
