"""What the page plans for an action space is what the installed program does: network, learning, commands, files."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from test_core_bits import in_node

from racecraft.agent import ContinuousActionSpace, action_space
from racecraft.site.plan import plan, told_policy

pytestmark = pytest.mark.slow
OWN = ContinuousActionSpace([-np.radians(20.0), 0.7], [np.radians(25.0), 3.1])


def as_edited(space: ContinuousActionSpace) -> dict[str, Any]:
    limits = space.to_aws()
    pairs = {name: [ends["low"], ends["high"]] for name, ends in limits.items()}
    return {"name": "", "description": "", "kind": "continuous", "actions": [], **pairs}


def test_the_page_plans_every_action_space_as_the_installed_program(tmp_path: Path) -> None:
    told = plan()
    spaces = [*told["spaces"], as_edited(OWN)]
    found = in_node("core", [{"what": "policies", "plan": told, "spaces": spaces}], tmp_path)["results"][0]
    assert len(found) == len(spaces) >= 6
    for space, policy in zip(spaces, found, strict=True):
        native = told_policy(action_space(space["name"]) if space["name"] else OWN)
        expected = json.loads(json.dumps(native))  # as it reaches the page
        assert policy == expected, space["name"]
