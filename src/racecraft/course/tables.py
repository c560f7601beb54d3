"""A table that learns to drive with cuts of one's own, by the parts of `racecraft.classic` that `learn` is made of."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from racecraft.agent import action_space
from racecraft.classic import Worlds, find_recipe, q_table
from racecraft.classic.views import CellView, Cut
from racecraft.course.driving import Drives, drive
from racecraft.env import ENV_ID
from racecraft.env.observation import STATE_BOUNDS


def table_driver(edges: Mapping[str, Sequence[float]], *, seed: int = 1, steps: int = 40_000, cars: int = 20) -> Drives:
    """Let a table with these intervals learn, and drive laps.

    Args:
        edges: Where numbers of the state are cut, by their name in `racecraft.env.observation.STATE_BOUNDS`.
        seed: The same seed repeats it.
        steps: Of all 64 cars together.
        cars: That drive a lap each, afterwards and without exploration.
    """
    columns = list(STATE_BOUNDS)
    cuts = tuple(Cut(columns.index(name), tuple(row)) for name, row in edges.items())
    recipe = find_recipe(ENV_ID, "q-table")
    settings: Any = replace(recipe.settings, steps=steps, cuts=cuts)  # type: ignore[call-arg]
    worlds = Worlds(
        f"racecraft:{ENV_ID}",
        num_envs=settings.num_envs,
        seed=seed,
        view=lambda space: CellView(space, cuts=cuts),
        make=recipe.make,
    )
    rng = np.random.default_rng(seed)
    table, space = q_table.begin(worlds, settings, rng), action_space(str(recipe.make["action_space"]))
    try:
        for _ in q_table.learn(worlds, table, settings, rng):
            pass
    finally:
        worlds.close()

    def commands(states: NDArray[np.float32]) -> NDArray[Any]:
        return space.to_commands(table.act(worlds.view(states)))  # type: ignore[arg-type]

    return drive(commands, str(recipe.make["track"]), cars=cars, seconds=60.0, seed=1000)
