"""What does not fit a learner is refused, and changes nothing."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from minibatches import OBJECTIVE, minibatch_for

from racecraft.errors import CheckpointError, ConfigError, ShapeError
from racecraft.learn import NetworkSpec
from racecraft.learn.native_learner import NativeLearner

SMALL = NetworkSpec(num_actions=5, state_size=21)


def test_foreign_weights_are_refused_and_change_nothing():
    learner = NativeLearner(NetworkSpec(num_actions=4))
    before = learner.weights()
    with pytest.raises(CheckpointError, match=r"policy\.head"):
        learner.load_weights(NativeLearner(NetworkSpec(num_actions=5)).weights())
    with pytest.raises(CheckpointError, match="missing"):
        learner.load_weights({})
    with pytest.raises(CheckpointError):
        learner.load_optimizer_state({})
    state = learner.optimizer_state()
    del state["step"]
    with pytest.raises(CheckpointError, match="step"):
        learner.load_optimizer_state(state)
    for name, weights in learner.weights().items():
        np.testing.assert_array_equal(weights, before[name])


@pytest.mark.parametrize(
    "frames", [np.zeros((2, 60, 80), np.uint8), np.zeros((120, 160), np.uint8), np.zeros((1, 120, 160), np.float32)]
)
def test_frames_of_another_shape_are_refused(frames):
    with pytest.raises(ShapeError, match="frames"):
        NativeLearner(NetworkSpec(num_actions=4)).encode(frames)


@pytest.mark.parametrize("field", ["observations", "states", "actions", "log_probs", "advantages", "returns"])
@pytest.mark.parametrize("is_discrete", [True, False])
def test_minibatches_of_another_shape_are_refused(field, is_discrete):
    learner = NativeLearner(dataclasses.replace(SMALL, is_discrete=is_discrete))
    minibatch = minibatch_for(learner, 8)
    with pytest.raises(ShapeError):
        learner.update(dataclasses.replace(minibatch, **{field: getattr(minibatch, field)[:7]}), OBJECTIVE)
    with pytest.raises(ShapeError):
        learner.update(dataclasses.replace(minibatch, **{field: getattr(minibatch, field)[..., None]}), OBJECTIVE)


@pytest.mark.parametrize("action", [-1, 5, 2**40])
def test_actions_outside_the_table_are_refused(action):
    learner = NativeLearner(SMALL)
    minibatch = minibatch_for(learner, 8)
    minibatch.actions[3] = action
    with pytest.raises(ShapeError, match="expected 0 to 4"):
        learner.update(minibatch, OBJECTIVE)


def test_an_empty_minibatch_is_refused():
    learner = NativeLearner(SMALL)
    with pytest.raises(ValueError, match="at least one sample"):
        learner.update(minibatch_for(learner, 0), OBJECTIVE)


@pytest.mark.parametrize("rows", [[-1, 0], [0, 16]])
def test_rows_beyond_the_samples_are_refused(rows):
    learner = NativeLearner(SMALL)
    with pytest.raises(ShapeError, match="rows"):
        learner.update(dataclasses.replace(minibatch_for(learner, 16), rows=np.array(rows)), OBJECTIVE)


def test_networks_that_do_not_fit_are_refused():
    with pytest.raises(ConfigError, match="too small"):
        NativeLearner(NetworkSpec(num_actions=2, frame_shape=(32, 32)))
    with pytest.raises(ConfigError, match="allowed are RACECRAFT_SMALL"):
        NativeLearner(NetworkSpec(name="RESNET", num_actions=2))
