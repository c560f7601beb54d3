"""Hidden frames and how alike choices are: by hand, and of real drivers."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from racecraft.race.conditions import Conditions
from racecraft.race.entry import load_entry
from racecraft.race.likeness import ALIKE, FRAMES, RANGE, hidden_choices, likeness
from racecraft.race.rules import RaceRules
from racecraft.run.starters import unpack_starter
from racecraft.track import load_track


def drawn(seed: int) -> np.ndarray:
    return np.rint(np.random.default_rng(seed).random((FRAMES, 2)) * RANGE).astype(np.int16)


def test_the_same_is_1_and_chance_is_0() -> None:
    mine = drawn(1)
    others = np.stack([mine, mine[::-1], drawn(2), mine + np.int16(1)])
    found = likeness(mine, others)
    assert found[0] == 1.0
    assert found[1:3] == pytest.approx(0.0, abs=0.1)
    assert 0.99 < found[3] < 1.0


def test_it_is_what_the_definition_says() -> None:
    mine, theirs = drawn(1) // np.int16(3), drawn(2) // np.int16(2)
    apart, by_chance = 0.0, 0.0
    for column, width in enumerate(RANGE):
        one, other = mine[:, column] / width, theirs[:, column] / width
        apart += np.abs(other - one).mean()
        by_chance += np.abs(other[:, None] - one[None]).mean()
    assert likeness(mine, theirs[None])[0] == pytest.approx(1 - apart / by_chance)


def test_who_always_does_the_same_is_like_nobody() -> None:
    still = np.full((FRAMES, 2), 500, np.int16)
    assert likeness(still, still[None])[0] == 0.0


def test_real_drivers_and_a_copy(tmp_path: Path) -> None:
    conditions = Conditions(track=load_track("oval"), rules=RaceRules(laps=1))
    quick, steady = (load_entry(unpack_starter(name, tmp_path), num_threads=1) for name in ("quick", "steady"))
    mine = hidden_choices(quick, conditions, seed=5)
    assert mine.shape == (FRAMES, 2)
    assert (hidden_choices(quick, conditions, seed=5) == mine).all()
    assert (hidden_choices(quick, conditions, seed=6) != mine).any()
    assert likeness(mine, hidden_choices(steady, conditions, seed=5)[None])[0] < ALIKE
    draw = np.random.default_rng(3)
    noised = {
        name: one + (0.03 * one.std() * draw.standard_normal(one.shape)).astype(np.float32)
        for name, one in quick.policy.learner.weights().items()
    }
    quick.policy.learner.load_weights(noised)
    copied = hidden_choices(quick, conditions, seed=5)
    assert (copied != mine).any()
    assert likeness(mine, copied[None])[0] >= ALIKE
