"""Grad-CAM through perception: outputs are the learner's, the gradient is torch's, the picture lies where it looks."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from racecraft import load_track
from racecraft.errors import ConfigError, ShapeError
from racecraft.learn import NetworkSpec
from racecraft.learn.networks import PERCEPTION
from racecraft.perception.answers import ERRORS, IN_SIGHT, MIDDLES, NUM_CONTINUOUS, NUM_OUTPUTS, NUM_TARGETS
from racecraft.perception.learner import SURE, USUAL_LOG_ERROR, BeliefLearner
from racecraft.perception.mirror import mirrored_answers
from racecraft.race.seeing import explain
from racecraft.sim import Simulation, Start

FOLD = 2
"""Pixels to a side of the squares that perception's observations fold into channels."""


@pytest.fixture(scope="module")
def frame() -> np.ndarray:
    """A picture of a car on a road  (120, 160)."""
    start = Start(mode="random", lateral_jitter=0.2, heading_jitter=0.3)
    return np.array(Simulation([load_track("reinvent_2018")], num_envs=1, seed=5, start=start).frames[0])


def learner_for(*, is_discrete: bool = True) -> BeliefLearner:
    spec = NetworkSpec(name=PERCEPTION, num_actions=5 if is_discrete else 2, is_discrete=is_discrete, state_size=16)
    learner = BeliefLearner(spec, seed=3, num_threads=1)
    weights = learner.weights()
    weights["policy.head.weight"] *= 100  # at the beginning all outputs are almost the same
    learner.load_weights(weights)
    return learner


@pytest.mark.parametrize("is_discrete", [True, False])
def test_the_outputs_are_the_learners(frame: np.ndarray, is_discrete: bool) -> None:
    learner = learner_for(is_discrete=is_discrete)
    expected = learner.policy(learner.encode(frame[None]))[0][: learner.spec.num_actions]
    found = explain(learner, frame)
    assert found.outputs == pytest.approx(expected, rel=0.02, abs=0.02)
    assert found.target == (int(found.outputs.argmax()) if is_discrete else 0)
    assert explain(learner, frame, target=1).target == 1


def test_the_picture_is_that_of_torch(frame: np.ndarray) -> None:
    torch = pytest.importorskip("torch")
    learner = learner_for()
    policy = {name: torch.from_numpy(array) for name, array in learner.weights().items()}
    looks = {name: torch.from_numpy(array) for name, array in learner.perceiver.network.weights().items()}
    blocks = learner.perceiver.observe(frame[None])[0]  # rows, columns, squares of two by two pixels
    rows, columns = blocks.shape[:2]
    pixels = blocks.reshape(rows, columns, FOLD, FOLD).transpose(0, 2, 1, 3).reshape(FOLD * rows, FOLD * columns)
    order = mirrored_answers(np.arange(1, NUM_OUTPUTS + 1, dtype=np.float32)[None])[0]
    places, signs = torch.from_numpy(np.abs(order).astype(int) - 1), torch.from_numpy(np.sign(order))

    maps = []

    def seen(picture: np.ndarray) -> torch.Tensor:
        x = torch.from_numpy(picture.astype(np.float32).copy())[None, None] / 255
        for index in (1, 2, 3):
            x = torch.conv2d(x, looks[f"policy.conv{index}.weight"], looks[f"policy.conv{index}.bias"], 2).relu()
        maps.append(x.requires_grad_())
        x = maps[-1].permute(0, 2, 3, 1).reshape(1, -1)
        x = (x @ looks["policy.dense1.weight"].T + looks["policy.dense1.bias"]).relu()
        return (x @ looks["policy.head.weight"].T + looks["policy.head.bias"])[0]

    outputs = 0.5 * (seen(pixels) + seen(pixels[:, ::-1])[places] * signs)
    numbers = outputs.clone()
    numbers[MIDDLES] = numbers[MIDDLES] * (outputs[IN_SIGHT] > 0)
    numbers[NUM_CONTINUOUS:NUM_TARGETS] = numbers[NUM_CONTINUOUS:NUM_TARGETS] / SURE
    numbers[ERRORS] = numbers[ERRORS] - USUAL_LOG_ERROR
    exact = 128 + 127 * numbers / torch.sqrt(1 + numbers**2)
    told = exact + (exact.round() - exact).detach()
    x = torch.cat([told, torch.zeros(5)])[None] / 255
    x = (x @ policy["policy.conv1.weight"].reshape(64, 100).T + policy["policy.conv1.bias"]).relu()
    x = (x @ policy["policy.dense1.weight"].T + policy["policy.dense1.bias"]).relu()
    (x @ policy["policy.head.weight"].T + policy["policy.head.bias"])[0, 2].backward()
    cells = [(m.grad.mean((2, 3), keepdim=True) * m).sum(1).relu()[0].detach().numpy() for m in maps]
    expected = 0.5 * (2 * cells[0] + 2 * cells[1][:, ::-1])  # the mean of both had halved each slope
    found = explain(learner, frame, target=2)
    assert found.layer == "conv3"
    assert expected.max() > 0
    assert found.cells == pytest.approx(expected, rel=0.02, abs=0.01 * float(expected.max()))


def test_it_shows_only_what_perception_looks_at(frame: np.ndarray) -> None:
    learner = learner_for()
    picture = explain(learner, frame).picture
    assert picture.shape == (120, 160)
    assert not picture[:24].any()
    assert picture.min() >= 0
    assert picture.max() == pytest.approx(1.0)
    with pytest.raises(ShapeError):
        explain(learner, frame[:100])
    with pytest.raises(ConfigError, match="one camera alone"):
        explain(BeliefLearner(replace(learner.spec, lidar_size=8)), frame)
