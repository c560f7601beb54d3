"""Racecraft's ids in Gymnasium's registry."""

from __future__ import annotations

from typing import Final

import gymnasium

ENV_ID: Final = "Racecraft-v0"
EPISODE_STEPS: Final = 3000
"""Steps of 1/15 s that truncate an episode, unless told otherwise."""


def register_environments() -> None:
    """Make ``gymnasium.make`` and ``gymnasium.make_vec`` know Racecraft; calling again does nothing.

    Importing `racecraft.env` does this, and so does importing `racecraft` after Gymnasium. There is no plug-in
    mechanism since Gymnasium 1.0, so one of these comes first, or the id names what to import:
    ``gymnasium.make("racecraft.env:Racecraft-v0")``.
    """
    if ENV_ID not in gymnasium.registry:
        gymnasium.register(
            id=ENV_ID,
            entry_point="racecraft.env.racecraft_env:make_single",
            vector_entry_point="racecraft.env.vector_env:RacecraftVectorEnv",
            max_episode_steps=EPISODE_STEPS,
        )
