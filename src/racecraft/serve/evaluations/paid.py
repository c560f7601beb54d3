"""What a model's own reward function pays for the laps of an evaluation, whose files know only AWS's default."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Final

from racecraft.analysis import TracedLap, pay_laps
from racecraft.errors import RacecraftError
from racecraft.json_file import read_json_object
from racecraft.reward import keeps_state
from racecraft.run import RunFolder, read_stretches, stretch_at
from racecraft.serve.evaluations.schemas import RewardOfLaps
from racecraft.track import Track

MAX_LAPS: Final = 400
"""Of one evaluation: 20 trials of 20 laps."""
Paid = dict[int, list[float | None]]
"""A reward for every step of a lap, by its number; None where the function is not asked."""


def rewards_of(
    folder: RunFolder, stamp: str, track: Track, trace: Path, laps: Sequence[TracedLap]
) -> tuple[RewardOfLaps, Paid]:
    """Rewards of an evaluation's laps by the function that its policy was trained with.

    Args:
        folder: The run.
        stamp: Of the evaluation.
        track: In the direction driven.
        trace: Its sim-trace.
        laps: What was read from it.
    """
    stretches = read_stretches(folder)
    step = read_json_object(folder.evaluation(stamp) / "evaluation.json").get("step")
    stretch = stretch_at(stretches, step) if isinstance(step, int) else stretches[-1]
    source, error = stretch.reward_function, None
    paid: Paid = {}
    lengths = {lap.number: len(lap.time) for lap in laps}
    try:
        paid = _paid(source, track, trace, lengths, foreign=folder.read_info().foreign)
    except RacecraftError as failure:
        error = str(failure).split("\n")[0]
    about = RewardOfLaps(stretch=stretch.number, stretches=len(stretches), is_afresh=_remembers(source), error=error)
    return about, paid


def _remembers(source: str) -> bool:
    try:
        return keeps_state(source)
    except (SyntaxError, ValueError):
        return False


def _paid(source: str, track: Track, trace: Path, lengths: dict[int, int], *, foreign: bool) -> Paid:
    found: Paid = {}
    for lap in pay_laps(source, track, trace, foreign=foreign, most=MAX_LAPS):
        rewards: list[float | None] = [None] * lengths.get(lap.number, 0)
        for row, reward in zip(lap.rows.tolist(), lap.rewards.tolist(), strict=True):
            if row < len(rewards) and math.isfinite(reward):
                rewards[row] = round(reward, 5)
        found[lap.number] = rewards
    return found
