"""A picture in a mirror, and what is told of it."""

from __future__ import annotations

import numpy as np
import pytest

from racecraft.perception import Perceiver
from racecraft.perception.answers import NUM_OUTPUTS, NUM_TARGETS
from racecraft.perception.belief import believe
from racecraft.perception.mirror import mirrored_answers, mirrored_observations


def test_observations_are_those_of_the_turned_picture() -> None:
    looker = Perceiver(None, num_threads=1)
    frames = np.random.default_rng(2).integers(0, 256, (3, 120, 160)).astype(np.uint8)
    turned = looker.observe(np.ascontiguousarray(frames[:, :, ::-1]))
    assert (mirrored_observations(looker.observe(frames)) == turned).all()


def test_a_mirror_in_a_mirror_shows_what_there_is() -> None:
    for width in (NUM_TARGETS, NUM_OUTPUTS):
        answers = np.random.default_rng(3).normal(size=(4, width)).astype(np.float32)
        assert (mirrored_answers(mirrored_answers(answers)) == answers).all()
        assert (mirrored_answers(answers) != answers).any()


def test_a_car_to_the_left_is_as_far_to_the_right_and_all_else_as_it_was() -> None:
    outputs = np.random.default_rng(5).uniform(0.1, 1.0, (1, NUM_OUTPUTS)).astype(np.float32)
    belief, turned = believe(outputs), believe(mirrored_answers(outputs))
    for name in ("offset", "heading", "heading_ahead", "curvature"):
        assert (getattr(turned, name) == -getattr(belief, name)).all(), name
    assert belief.middle + turned.middle == pytest.approx(159.0)
    assert (turned.regions == belief.regions[:, :, ::-1]).all()
    same = ("offset_error", "heading_error", "curvature_error", "middle_error", "closeness_error")
    for name in (*same, "half_width", "closeness", "on_road", "is_middle"):
        assert (getattr(turned, name) == getattr(belief, name)).all(), name


def test_what_is_believed_of_a_picture_is_what_is_believed_of_it_in_a_mirror() -> None:
    looker = Perceiver(num_threads=1)
    frames = np.random.default_rng(4).integers(40, 200, (3, 120, 160)).astype(np.uint8)
    belief, turned = looker(frames), looker(np.ascontiguousarray(frames[:, :, ::-1]))
    assert belief.offset == pytest.approx(-turned.offset, abs=1e-5)
    assert belief.heading_ahead == pytest.approx(-turned.heading_ahead, abs=1e-5)
    assert belief.middle + turned.middle == pytest.approx(159.0, abs=1e-3)
    assert belief.regions == pytest.approx(turned.regions[:, :, ::-1], abs=1e-5)
    assert belief.heading_error == pytest.approx(turned.heading_error, abs=1e-5)
