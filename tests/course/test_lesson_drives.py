"""Drivers of known habits do what they are known for, and are paid what a reward says."""

from __future__ import annotations

import numpy as np
import pytest

from racecraft.classic import learn
from racecraft.course.drivers import DRIVERS, earnings
from racecraft.course.driving import Drives, drive
from racecraft.errors import RewardError


@pytest.fixture(scope="module")
def driven() -> dict[str, Drives]:
    return {
        name: drive(habit.driver(), cars=3, seconds=10, seed=1, is_turned=habit.is_turned, action_space="continuous")
        for name, habit in DRIVERS.items()
    }


@pytest.mark.costly
def test_habits(driven: dict[str, Drives]) -> None:
    speeds = {name: float(np.nanmean(one.speed[8:])) for name, one in driven.items()}
    assert speeds["slow"] == pytest.approx(0.5, abs=0.1)
    assert speeds["steady"] == pytest.approx(1.0, abs=0.1)
    assert speeds["brisk"] == pytest.approx(1.5, abs=0.1)
    assert 1.7 < speeds["quick"] < 2.1
    for name in ("slow", "steady", "brisk", "quick", "weaving"):
        assert np.nanmax(np.abs(driven[name].offset)) < (0.45 if name == "weaving" else 0.3), name
        assert set(driven[name].endings) <= {"in_progress", "lap_complete"}, name
    assert np.nanmean(np.abs(driven["weaving"].steering)) > 2 * np.nanmean(np.abs(driven["brisk"].steering))
    assert np.nanmean(np.abs(driven["on the border"].offset)) > 0.3
    assert driven["wrong way"].endings == ("reversed",) * 3
    assert np.nanmin(driven["wrong way"].progress) < 0.0


def test_what_is_driven_ends_with_the_lap(driven: dict[str, Drives]) -> None:
    quick = driven["quick"]
    assert quick.laps == 3
    assert quick.lap_seconds == pytest.approx(quick.track.length / 1.9, rel=0.1)
    assert np.isnan(driven["slow"].lap_seconds)
    finished = np.isfinite(quick.x).sum(axis=0)
    assert len(set(finished.tolist())) > 1, "none waits for the others"
    for one in driven.values():
        over = np.isnan(one.x)
        assert (over == np.isnan(one.rewards)).all()
        assert (over[1:] >= over[:-1]).all()


@pytest.mark.costly
def test_who_has_learned_drives_where_that_was_or_where_it_is_told_to() -> None:
    learned = learn("racecraft:Racecraft-v0", "q-table", make={"track": "hairpin"}, seed=1, until="1 steps")
    one = {"cars": 1, "seconds": 0.2}
    assert drive(learned, **one).track.name == "hairpin"
    assert drive(learned, "oval", **one).track.name == "oval"
    assert drive(DRIVERS["slow"].driver(), **one, action_space="continuous").track.name == "oval"


def test_earnings_are_those_of_a_second() -> None:
    paid = earnings(lambda params: 1.0)
    assert paid == dict.fromkeys(DRIVERS, pytest.approx(15.0))
    speeds = earnings(lambda params: params["speed"] / 15.0)
    assert speeds["slow"] == pytest.approx(0.5, abs=0.01)
    assert speeds["steady"] == pytest.approx(1.0, abs=0.01)
    with pytest.raises(RewardError):
        earnings(lambda params: float("nan"))
