"""A reward function that relies on objects, as AWS's own example does, is tried among those of its run."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from tiny_runs import Train

from racecraft.errors import RewardError
from racecraft.sim import Bots, Objects, Obstacles
from racecraft.training import Opponents, resume

AVOIDS = """\
def reward_function(params):
    _, next_object_index = params['closest_objects']
    x, y = params['objects_location'][next_object_index]
    distance = ((params['x'] - x) ** 2 + (params['y'] - y) ** 2) ** 0.5
    is_same_lane = params['objects_left_of_center'][next_object_index] == params['is_left_of_center']
    return 1e-3 if is_same_lane and distance < 0.3 else 1.0
"""
RACES = {
    "boxes": {"objects": Objects(obstacles=Obstacles(count=2, placement="random"))},
    "bots": {"objects": Objects(bots=Bots(count=1))},
    "another car": {"opponents": Opponents(cars=2)},
}
SHORT = {"evaluate_every": 64, "until": "64 steps"}


@pytest.mark.parametrize("race", RACES)
def test_it_begins_goes_on_and_is_replaced_among_the_objects_of_its_run(tiny: Train, tmp_path: Path, race: str) -> None:
    source = tmp_path / "avoids.py"
    source.write_text(AVOIDS)
    settings: dict[str, Any] = {"reward": source, **SHORT, **RACES[race]}
    tiny(name="mine", **settings)
    run = tmp_path / "runs" / "mine"
    assert resume(run, until="128 steps").steps == 128  # checked anew, as it may have been edited
    source.write_text(AVOIDS.replace("0.3", "0.4"))
    assert resume(run, until="192 steps", reward=source).steps == 192


@pytest.mark.costly
def test_it_is_refused_where_nothing_stands(tiny: Train, tmp_path: Path) -> None:
    source = tmp_path / "avoids.py"
    source.write_text(AVOIDS)
    with pytest.raises(RewardError, match="IndexError") as caught:
        tiny(reward=source, **SHORT)
    assert caught.value.line == 3
