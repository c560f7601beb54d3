"""What the page plans for a race and an action space is what the installed program does: network, learning, files."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from test_core_bits import in_node

from racecraft.agent import ContinuousActionSpace, action_space
from racecraft.sim.objects import objects_for_race
from racecraft.site.plan import plan, told_policy

pytestmark = pytest.mark.slow
OWN = ContinuousActionSpace([-np.radians(20.0), 0.7], [np.radians(25.0), 3.1])


def as_edited(space: ContinuousActionSpace) -> dict[str, Any]:
    limits = space.to_aws()
    pairs = {name: [ends["low"], ends["high"]] for name, ends in limits.items()}
    return {"name": "", "description": "", "kind": "continuous", "actions": [], **pairs}


def test_the_page_plans_every_action_space_of_every_race_as_the_installed_program(tmp_path: Path) -> None:
    told = plan()
    spaces = [*told["spaces"], as_edited(OWN)]
    chosen: dict[str, dict[str, Any]] = {
        "time-trial": {},
        "object-avoidance": {"count": 9},
        "head-to-bot": {"speed": 0.7},
    }
    wishes = [
        {"race": race, "space": space, "objects": objects_for_race(race, settings=settings).to_dict()}
        for race, settings in chosen.items()
        for space in spaces
    ]
    found = in_node("core", [{"what": "policies", "plan": told, "wishes": wishes}], tmp_path)["results"][0]
    assert len(found) == len(wishes) >= 18
    for wish, policy in zip(wishes, found, strict=True):
        space, race = wish["space"], wish["race"]
        objects = objects_for_race(race, settings=chosen[race])
        native = told_policy(action_space(space["name"]) if space["name"] else OWN, objects)
        expected = json.loads(json.dumps(native))  # as it reaches the page
        assert policy == expected, (race, space["name"])
