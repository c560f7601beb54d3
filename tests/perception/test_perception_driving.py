"""A driver that sees only what perception tells."""

from __future__ import annotations

import numpy as np
import pytest

from racecraft import load_track
from racecraft.perceiving import PerceptionDriver
from racecraft.perceiving.driving import state_of
from racecraft.perception import Perceiver, Watcher
from racecraft.perception.answers import NUM_OUTPUTS, NUM_TARGETS, NUMBERS
from racecraft.perception.belief import Belief, believe
from racecraft.perception.memory import unknown
from racecraft.race.generalization import generalize
from racecraft.sim.columns import STATE_COLUMNS


def belief_of(*, error: float = 0.01, **numbers: float) -> Belief:
    """Of one picture of a road that is 0.8 m wide."""
    outputs = np.zeros((1, NUM_OUTPUTS), np.float32)
    for name, value in {"half_width": 0.4, **numbers}.items():
        outputs[0, list(NUMBERS).index(name)] = value / NUMBERS[name]
    outputs[0, NUM_TARGETS] = np.log(error / NUMBERS["offset"])
    return believe(outputs)


class Seen:
    """Sees what it is told to."""

    def __init__(self, belief: Belief) -> None:
        self.belief = belief

    def __call__(self, _: object) -> Belief:
        return self.belief


def commands_of(belief: Belief) -> tuple[float, float]:
    driver = PerceptionDriver(Seen(belief), remembers=False)  # type: ignore[arg-type]
    steering, speed = driver(np.zeros((1, 120, 160), np.uint8))[0]
    return float(steering), float(speed)


@pytest.mark.costly
@pytest.mark.parametrize("randomize", ["strong", "real"])
def test_it_laps_roads_that_perception_never_learned_from(randomize: str) -> None:
    found = generalize(
        PerceptionDriver(), [load_track("kidney"), load_track("bowtie")], num_trials=2, randomize=randomize, seed=3
    )
    assert (found.laps, found.trials) == (8, 8)
    slowest = max(time / result.length for result in found.results for time in result.lap_times)
    assert slowest < 1 / 1.2


def test_it_steers_back_to_the_middle_and_into_bends() -> None:
    straight, _ = commands_of(belief_of())
    assert straight == pytest.approx(0.0, abs=1e-6)
    assert commands_of(belief_of(offset=0.1))[0] < -0.05
    assert commands_of(belief_of(offset=-0.1))[0] > 0.05
    assert commands_of(belief_of(heading=0.2))[0] < -0.05
    assert commands_of(belief_of(curvature_near=0.8, curvature=0.8))[0] > 0.05


def test_it_slows_for_bends_and_where_it_is_not_sure() -> None:
    fast = commands_of(belief_of())[1]
    assert 1.2 < fast < 1.5
    assert commands_of(belief_of(curvature_near=2.0, curvature=2.0))[1] < 0.8 * fast
    assert commands_of(belief_of(error=0.2))[1] < 0.5 * fast


@pytest.mark.costly
def test_it_remembers_what_it_did_last() -> None:
    perceiver, cars, before = Perceiver(num_threads=1), np.array([3, 1]), unknown(2)
    frames = np.random.default_rng(11).integers(40, 200, (4, 2, 120, 160)).astype(np.uint8)
    driver, watcher, late = PerceptionDriver(perceiver), Watcher(perceiver), Watcher(perceiver)
    for some in frames[:3]:
        commands = driver(some, cars)
        for one, told in ((watcher, commands), (late, before)):
            one(some, cars)
            one.tell(told, cars)
        before = commands.copy()
        assert np.isfinite(commands).all()
        assert driver._watcher is not None
    assert (driver._watcher(frames[3], cars).heading == watcher(frames[3], cars).heading).all()
    assert (late(frames[3], cars).heading != watcher(frames[3], cars).heading).all()


def test_a_belief_becomes_the_state_that_the_simulator_would_tell() -> None:
    state = dict(zip(STATE_COLUMNS, state_of(belief_of(offset=0.2, heading=0.3, curvature=0.5))[0], strict=True))
    assert state["offset"] == pytest.approx(0.5)
    narrow = state_of(belief_of(offset=0.03, half_width=0.15))[0]
    assert narrow[STATE_COLUMNS.index("offset")] == pytest.approx(0.2)
    assert state["sin_heading_error"] == pytest.approx(np.sin(0.3))
    assert state["cos_heading_error"] == pytest.approx(np.cos(0.3))
    assert [state[f"curvature_{i}"] for i in range(8)] == pytest.approx([0, 0, 0, 0.25, 0.5, 0.25, 0, 0])
