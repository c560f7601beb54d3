"""The mean of a learner's weights: which of both drive, and what a checkpoint holds of them."""

from __future__ import annotations

import numpy as np
import pytest

from racecraft.errors import CheckpointError
from racecraft.learn import NetworkSpec, make_learner
from racecraft.learn.average import WeightAverage
from racecraft.learn.learner import Learner, below, holding

BIAS = "policy.head.bias"


def learner_of(value: float, *, num_actions: int = 3) -> Learner:
    """A learner whose weights are all of this value."""
    learner = make_learner(NetworkSpec(num_actions=num_actions, state_size=2), num_threads=1)
    learner.load_weights({name: np.full_like(array, value) for name, array in learner.weights().items()})
    return learner


def bias(learner: Learner) -> float:
    return float(learner.weights()[BIAS][0])


def averaged(*values: float, share: float = 1.0) -> WeightAverage:
    """The average over iterations that ended with these values."""
    average = WeightAverage(learner_of(0.0), share)
    for iteration, value in enumerate(values, 1):
        average.learner.load_weights(learner_of(value).weights())
        average.add(iteration=iteration)
    return average


def test_the_mean_drives_where_it_is_preferred_and_there_is_one() -> None:
    average = averaged(1.0, 2.0, 6.0)
    assert average.weights()[BIAS][0] == pytest.approx(3.0)
    assert average.weights(is_preferred=False)[BIAS][0] == 6.0
    assert averaged().weights()[BIAS][0] == 0.0
    assert averaged(1.0, 2.0, share=0.0).weights()[BIAS][0] == 2.0


def test_a_learner_holds_other_weights_for_a_while_whatever_happens() -> None:
    learner = learner_of(1.0)
    with holding(learner, learner_of(4.0).weights()):
        assert bias(learner) == 4.0
    assert bias(learner) == 1.0
    with pytest.raises(ZeroDivisionError), holding(learner, learner_of(4.0).weights()):
        raise ZeroDivisionError
    assert bias(learner) == 1.0


@pytest.mark.parametrize("is_preferred", [True, False])
def test_a_checkpoint_has_what_drives_what_learns_and_the_mean(is_preferred: bool) -> None:
    average = averaged(1.0, 3.0)
    state = average.state(is_preferred=is_preferred)
    parts = [name.partition("/")[0] for name in state]
    assert list(dict.fromkeys(parts)) == ["weights", "learning", "average", "optimizer"]
    driving = 2.0 if is_preferred else 3.0
    assert [state[f"{part}/{BIAS}"][0] for part in ("weights", "learning", "average")] == [driving, 3.0, 2.0]
    again = WeightAverage(learner_of(0.0), 1.0)
    again.load_state(state)
    assert bias(again.learner) == 3.0
    average.add(iteration=3)
    again.add(iteration=3)
    assert again.weights()[BIAS][0] == average.weights()[BIAS][0] == pytest.approx(7 / 3)


def test_without_a_mean_a_checkpoint_has_one_set_of_weights() -> None:
    average = averaged(1.0, 3.0, share=0.0)
    state = average.state(is_preferred=True)
    assert {name.partition("/")[0] for name in state} == {"weights", "optimizer"}
    again = WeightAverage(learner_of(0.0), 0.0)
    again.load_state(state)
    assert bias(again.learner) == 3.0


def test_a_mean_of_another_network_is_refused() -> None:
    other = WeightAverage(learner_of(0.0, num_actions=5), 1.0)
    other.add(iteration=1)
    state = averaged(1.0).state(is_preferred=False)
    state |= {f"average/{name}": array for name, array in below("average/", other.state(is_preferred=True)).items()}
    with pytest.raises(CheckpointError, match="averaged weights are not of the same network"):
        averaged().load_state(state)
