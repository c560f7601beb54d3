import dataclasses
import json
import math

import pytest

from racecraft.errors import ConfigError
from racecraft.race.rules import RULE_SETS, RaceRules, race_rules, rules_by_name


def test_defaults_are_those_of_deepracer_for_cloud():
    rules = RaceRules()
    assert (rules.laps, rules.is_continuous, rules.max_resets) == (3, True, 100)
    assert (rules.offtrack_penalty, rules.collision_penalty) == (5.0, 5.0)
    assert rules == RULE_SETS["drfc"]


def test_defaults_of_our_own():
    rules = RaceRules()
    assert (rules.mercy_after, rules.time_limit, rules.immobilized_penalty) == (3, 0.0, 0.0)
    assert (rules.starts, rules.start_offset, rules.direction) == ("line", 0.0, "forward")
    assert (rules.lateral_jitter, rules.heading_jitter) == (0.02, math.radians(2.0))


def test_entries_of_a_race_start_all_over_the_lap_unless_it_says_otherwise():
    rules = race_rules("worker", {"laps": 2})
    assert rules == dataclasses.replace(
        RULE_SETS["worker"], laps=2, starts="lap", lateral_jitter=0.1, heading_jitter=math.radians(5.0)
    )
    assert race_rules("drfc", {"starts": "line", "lateral_jitter": 0.0}).starts == "line"


def test_defaults_of_the_simulation_worker():
    rules = RULE_SETS["worker"]
    assert (rules.laps, rules.is_continuous, rules.max_resets) == (10, False, 0)
    assert (rules.offtrack_penalty, rules.collision_penalty) == (2.0, 5.0)


def test_each_mistake_has_its_penalty():
    rules = RaceRules(offtrack_penalty=2.0, collision_penalty=3.0, immobilized_penalty=0.5)
    assert rules.penalty("off_track") == rules.penalty("reversed") == 2.0
    assert rules.penalty("crashed") == 3.0
    assert rules.penalty("immobilized") == 0.5


@pytest.mark.parametrize(("seconds", "steps"), [(0.0, 0), (2.0, 30), (5.0, 75), (0.03, 0), (0.04, 1), (1.0, 15)])
def test_penalties_are_whole_steps(seconds, steps):
    assert RaceRules(offtrack_penalty=seconds).penalty_steps("off_track") == steps


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("laps", 0),
        ("laps", 1001),
        ("laps", 1.5),
        ("laps", True),
        ("laps", "3"),
        ("is_continuous", 1),
        ("max_resets", -1),
        ("max_resets", 2.0),
        ("offtrack_penalty", -0.1),
        ("offtrack_penalty", float("nan")),
        ("collision_penalty", float("inf")),
        ("collision_penalty", None),
        ("immobilized_penalty", 1e9),
        ("time_limit", -1),
        ("start_offset", 1.0),
        ("start_offset", -0.1),
        ("lateral_jitter", 2.0),
        ("heading_jitter", 4.0),
        ("direction", "alternate"),
        ("direction", None),
    ],
)
def test_a_wrong_rule_names_itself_and_its_value(field, value):
    with pytest.raises(ConfigError, match=field) as error:
        RaceRules(**{field: value})
    assert repr(value) in str(error.value)
    assert "allowed" in str(error.value)


def test_rules_by_name_with_single_ones_changed():
    assert rules_by_name("worker", {}) == RULE_SETS["worker"]
    assert rules_by_name("worker", {"laps": 2}) == dataclasses.replace(RULE_SETS["worker"], laps=2)
    own = RaceRules(laps=7)
    assert rules_by_name(own, {"max_resets": 1}) == RaceRules(laps=7, max_resets=1)
    with pytest.raises(ConfigError, match="'wrker'") as caught:
        rules_by_name("wrker", {})
    with pytest.raises(ConfigError, match=r"rules is 5; use drfc, .* or racecraft\.RaceRules"):
        rules_by_name(5, {})
    with pytest.raises(ConfigError, match=r"There is no race rule 'lap'\. Did you mean 'laps'\?"):
        rules_by_name("drfc", {"lap": 2})
    assert "worker" in caught.value.hint


def test_rules_are_frozen_and_plain():
    rules = RaceRules(laps=2)
    with pytest.raises(dataclasses.FrozenInstanceError):
        rules.laps = 3
    assert RaceRules(**json.loads(json.dumps(rules.to_dict()))) == rules


def test_rules_go_through_plain_values():
    for rules in RULE_SETS.values():
        assert RaceRules.from_dict(rules.to_dict()) == rules
    assert RaceRules.from_dict({"laps": 2}) == RaceRules(laps=2)
    with pytest.raises(ConfigError, match=r"no race rule 'lapps'\. Did you mean 'laps'"):
        RaceRules.from_dict({"lapps": 2})
    with pytest.raises(ConfigError, match="laps is 'many'"):
        RaceRules.from_dict({"laps": "many"})
