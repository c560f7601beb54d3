"""What a command gave, and what tests of commands share."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any, NamedTuple

import pytest

GOOD_REWARD = "def reward_function(params):\n    return float(params['progress'])\n"
SMALL = ("--track", "oval", "--num-envs", "8", "--evaluate-every", "512", "--num-threads", "1")


class Outcome(NamedTuple):
    status: int
    out: str
    err: str

    @property
    def document(self) -> Any:
        """The one JSON object on stdout, as strict readers see it."""
        assert self.out.count("\n") == 1
        return json.loads(self.out, parse_constant=lambda name: pytest.fail(f"{name} is no JSON"))


Run = Callable[..., Outcome]
