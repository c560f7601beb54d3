from __future__ import annotations

import numpy as np
import pytest

from racecraft.errors import CheckpointError
from racecraft.learn import NetworkSpec, initial_weights, parameter_count
from racecraft.learn.flat_weights import join_weights, split_weights

SPEC = NetworkSpec(num_actions=3, state_size=2)


def test_what_is_joined_can_be_split_again() -> None:
    weights = initial_weights(SPEC, seed=1)
    backwards = dict(reversed(weights.items()))
    flat = join_weights(backwards, SPEC)
    assert (flat.dtype, flat.shape) == (np.float32, (parameter_count(SPEC),))
    found = split_weights(flat, SPEC)
    assert list(found) == list(weights)
    for name, array in weights.items():
        np.testing.assert_array_equal(found[name], array, err_msg=name)


def test_the_parts_are_views() -> None:
    flat = np.zeros(parameter_count(SPEC), np.float32)
    split_weights(flat, SPEC)["critic.head.bias"][:] = 7.0
    assert flat[-1] == flat.sum() == 7.0


@pytest.mark.parametrize("change", ["missing", "superfluous", "of another shape"])
def test_what_does_not_fit_is_named(change: str) -> None:
    weights = initial_weights(SPEC, seed=1)
    bias = weights.pop("policy.head.bias")
    if change == "superfluous":
        weights |= {"policy.head.bias": bias, "policy.tail.bias": bias}
    elif change == "of another shape":
        weights["policy.head.bias"] = bias[:2]
    name = "policy.tail.bias" if change == "superfluous" else "policy.head.bias"
    with pytest.raises(CheckpointError, match=f"do not fit the network RACECRAFT_SMALL: {name} are missing,"):
        join_weights(weights, SPEC)
