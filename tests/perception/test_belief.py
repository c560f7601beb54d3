"""What the outputs of the network mean."""

from __future__ import annotations

import numpy as np
import pytest

from racecraft.perception.answers import (
    ERRORS,
    IN_SIGHT,
    MIDDLES,
    NUM_OUTPUTS,
    NUMBERS,
    ON_ROAD,
    PLACES,
    REGION_COLUMNS,
    REGIONS,
    ROWS,
)
from racecraft.perception.belief import believe


def test_of_nothing_all_is_straight_and_as_likely_as_not() -> None:
    belief = believe(np.zeros((2, NUM_OUTPUTS), np.float32))
    for straight in (belief.offset, belief.heading, belief.heading_ahead, belief.curvature, belief.closeness):
        assert not straight.any()
    for even in (belief.on_road, belief.is_middle, belief.regions):
        assert (even == 0.5).all()
    assert (belief.middle == 79.5).all()
    assert belief.middle.shape == belief.middle_error.shape == belief.is_middle.shape == (2, len(ROWS))
    assert belief.regions.shape == (2, 6, 8)
    assert len(belief) == 2


def test_every_number_is_told_in_its_unit_with_its_own_error() -> None:
    outputs = np.zeros((1, NUM_OUTPUTS), np.float32)
    for place in PLACES.values():
        outputs[0, place] = 0.1 * (place + 1)
        outputs[0, ERRORS.start + place] = np.log(0.01 * (place + 1))
    belief = believe(outputs)
    told = {name: 0.1 * (place + 1) * NUMBERS[name] for name, place in PLACES.items()}
    bends = ("curvature_near", "curvature", "curvature_far")
    assert belief.curvature[0] == pytest.approx([told[name] for name in bends])
    assert belief.curvature_error[0] == pytest.approx([0.1 * told[name] for name in bends])
    for name in ("offset", "heading", "heading_ahead", "closeness"):
        assert getattr(belief, name) == pytest.approx([told[name]]), name
        assert getattr(belief, f"{name}_error") == pytest.approx([0.1 * told[name]]), name
    assert belief.half_width == pytest.approx([told["half_width"]])


def test_what_is_yes_or_no_is_told_as_how_likely_it_is_and_where() -> None:
    outputs = np.zeros((1, NUM_OUTPUTS), np.float32)
    outputs[0, ON_ROAD], outputs[0, IN_SIGHT.start + 3] = np.log(3.0), -np.log(3.0)
    outputs[0, REGIONS.start + len(REGION_COLUMNS) + 2] = 1000.0
    outputs[0, MIDDLES.start + 3] = -0.5
    belief = believe(outputs)
    assert belief.on_road == pytest.approx([0.75])
    assert belief.is_middle[0, 3] == pytest.approx(0.25)
    assert belief.regions[0, 1, 2] == pytest.approx(1.0)
    assert (belief.regions == 0.5).sum() == 47
    assert belief.middle[0, 3] == pytest.approx(39.5)
