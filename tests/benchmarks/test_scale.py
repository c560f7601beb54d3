"""The simulation of a world league: a queue is a queue, and the docs show what it says."""

from __future__ import annotations

import importlib.util
import math
import sys
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def scale() -> ModuleType:
    found = importlib.util.spec_from_file_location("scale", ROOT / "benchmarks" / "scale.py")
    assert found is not None
    assert found.loader is not None
    module = importlib.util.module_from_spec(found)
    sys.modules["scale"] = module
    found.loader.exec_module(module)
    return module


@pytest.mark.costly
def test_entries_wait_for_a_free_core_and_no_longer(scale: ModuleType) -> None:
    assert scale.waits([0.0, 0.0, 0.5, 9.0], 1, 2.0).tolist() == [0.0, 2.0, 3.5, 0.0]
    assert scale.waits([0.0, 0.0, 0.5, 9.0], 2, 2.0).tolist() == [0.0, 0.0, 1.5, 0.0]
    rng, load = np.random.default_rng(1), 0.8  # the mean wait of M/D/1: load / (2 (1 - load)) services
    moments = np.cumsum(rng.exponential(1.0 / load, 20_000))
    assert scale.waits(moments, 1, 1.0).mean() == pytest.approx(load / (2 * (1 - load)), rel=0.1)


def test_the_rush_is_as_it_is_said(scale: ModuleType) -> None:
    habits = scale.Habits()
    moments = scale.arrivals(20_000, habits, np.random.default_rng(1))
    assert 0.0 <= moments[0] <= moments[-1] <= scale.DAY
    last = (moments > scale.DAY - habits.haste).mean()
    assert last == pytest.approx((1 - math.exp(-1)) / (1 - math.exp(-scale.DAY / habits.haste)), abs=0.01)
    assert scale.fewest(lambda cores: cores >= 7, 100) == 7


def test_the_docs_show_what_the_script_says(scale: ModuleType) -> None:
    sizes = [scale.size_of(racers, scale.Costs(), scale.Habits(), scale.Prices()) for racers in (10**3, 10**5, 10**7)]
    text = (ROOT / "docs" / "scale.md").read_text(encoding="utf-8")
    assert "\n".join(scale.markdown(sizes)) in text
    assert sizes[2].cost_judging == pytest.approx(100 * sizes[1].cost_judging, rel=0.1)
