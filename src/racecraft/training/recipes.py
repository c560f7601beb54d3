"""Recipes: several settings under one name, for what takes more than one of them to learn."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, Final

from racecraft.checks import check_choice
from racecraft.learn import DistillConfig
from racecraft.sim.objects import Bots, Objects, Obstacles
from racecraft.sim.randomization import PRESETS

ROADS: Final = ("library", "generated:0..47,radius=0.45,difficulty=0.9")
"""Many and tight; of the official routes only `reinvent_2018`'s shape is among them."""

FOLDED_ROADS: Final = (
    "library",
    "generated:0..31,radius=0.45,difficulty=0.9",
    "generated:32..51,width=1.07,radius=0.45,difficulty=1,verge=0.3",
    "generated:52..63,width=0.7,radius=0.45,difficulty=1,verge=0.3",
)
"""More, and hairpins one behind the other: on wide roads, as most of the official ones are, and on narrow ones."""

WIDE_ROADS: Final = ("generated:0..23,width=0.9,radius=0.5", "generated:24..47,width=1.1,radius=0.5")
"""With room to pass a box: as wide as the official routes that races among objects used."""

MOSTLY_STRONG: Final = replace(PRESETS["strong"], strength=(-1.0, 10.0))
"""One episode in eleven as it is, nine under all of it: faster than all of them, docs/log/generalisation.md."""

TRAFFIC: Final = Objects(
    obstacles=Obstacles(count=4, placement="random"),
    bots=Bots(count=2, speed=0.3, placement="random", changes_lane=True),
)
"""Both, so that what learns among them knows either."""

RECIPES: Final[Mapping[str, Mapping[str, Any]]] = {
    # Once round every road, at a walk: AWS's own default reward pays for being on the road, not for haste.
    "steady": {
        "track": ROADS,
        "reward": "centerline",
        "actions": "safe",
        "direction": "alternate",
        "randomize": "strong",
        "until": "5 minutes",
    },
    # Fast on roads it has never seen: a teacher that knows the road, on many of them and both ways, and a student that
    # sees it, under conditions that differ from episode to episode. docs/log/generalisation.md has what led here.
    "everywhere": {
        "track": FOLDED_ROADS,
        "reward": "touring",
        "actions": "continuous",
        "algorithm": "distill",
        "direction": "alternate",
        "randomize": MOSTLY_STRONG,
        "until": "15 minutes",
        "evaluate_every": 100_000,
        "evaluation_trials": 48,  # roads differ more than laps do
        "distill": DistillConfig(teacher_steps=2_000_000, student_steps=400_000, buffer_size=64_000),
    },
    # Through boxes and bots on roads it has never seen; the reward, the actions and the LIDAR are those of such races.
    "traffic": {
        "track": WIDE_ROADS,
        "objects": TRAFFIC,
        "algorithm": "distill",
        "direction": "alternate",
        "randomize": "strong",
        "until": "15 minutes",
        "evaluate_every": 150_000,
        "evaluation_trials": 48,
        "distill": DistillConfig(teacher_steps=4_000_000, gamma=0.9, student_steps=300_000, buffer_size=64_000),
    },
}
"""Arguments of `racecraft.training.train`, by name."""


def with_recipe(name: str, given: Mapping[str, Any]) -> dict[str, Any]:
    """A recipe's arguments, and in their place what is given.

    Args:
        name: One of `RECIPES`; without a name it is what is given.
        given: Arguments of `racecraft.training.train`; what is empty or None there is not given.

    Raises:
        ConfigError: There is no such recipe.
    """
    if not name:
        return dict(given)
    check_choice("recipe", name, tuple(RECIPES))
    is_given = {key: value for key, value in given.items() if value not in (None, "", ())}
    return {**given, **RECIPES[name], **is_given}
