"""Grad-CAM: the forward pass is the learner's, the gradient is torch's, the picture lies where the network looks."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from racecraft.errors import ConfigError, ShapeError
from racecraft.learn import NetworkSpec, make_learner
from racecraft.learn.networks import initial_weights, sky_rows
from racecraft.learn.saliency import grad_cam

NETWORKS = ("RACECRAFT_SMALL", "DEEP_CONVOLUTIONAL_NETWORK_SHALLOW")


def setting(name: str, *, is_discrete: bool = True) -> tuple[NetworkSpec, dict[str, np.ndarray], np.ndarray]:
    spec = NetworkSpec(name=name, num_actions=5 if is_discrete else 2, is_discrete=is_discrete, state_size=16)
    weights = initial_weights(spec, seed=3)
    weights["policy.head.weight"] *= 100  # at the beginning all outputs are almost the same
    frame = np.random.default_rng(4).integers(0, 256, spec.frame_shape, dtype=np.uint8)
    return spec, weights, frame


@pytest.mark.costly
@pytest.mark.parametrize("name", NETWORKS)
@pytest.mark.parametrize("is_discrete", [True, False])
def test_the_forward_pass_is_the_learners(name: str, is_discrete: bool) -> None:
    spec, weights, frame = setting(name, is_discrete=is_discrete)
    learner = make_learner(spec, seed=None, num_threads=1)
    learner.load_weights(weights)
    expected = learner.policy(learner.encode(frame[None]))[0][: spec.num_actions]
    found = grad_cam(spec, weights, frame)
    assert found.outputs == pytest.approx(expected, rel=0.02, abs=0.02)
    assert found.target == (int(found.outputs.argmax()) if is_discrete else 0)


@pytest.mark.costly
@pytest.mark.parametrize("name", NETWORKS)
def test_the_picture_is_that_of_torch(name: str) -> None:
    torch = pytest.importorskip("torch")
    spec, weights, frame = setting(name)
    tensors = {key: torch.from_numpy(value) for key, value in weights.items()}
    pixels = frame[sky_rows(spec) :].astype(np.float32)
    if name == "RACECRAFT_SMALL":
        height, width = pixels.shape
        pixels = np.floor(pixels.reshape(height // 2, 2, width // 2, 2).sum(axis=(1, 3)) / 4 + 0.5)
        strides, chosen = (4, 2, 2), 1
    else:
        strides, chosen = (4, 2, 1), 2
    x = torch.from_numpy(pixels)[None, None] / 255
    for index, stride in enumerate(strides, 1):
        x = torch.conv2d(x, tensors[f"policy.conv{index}.weight"], tensors[f"policy.conv{index}.bias"], stride).relu()
        if index == chosen + 1:
            middle = x.requires_grad_()
            x = middle
    x = x.permute(0, 2, 3, 1).reshape(1, -1)
    x = (x @ tensors["policy.dense1.weight"].T + tensors["policy.dense1.bias"]).relu()
    outputs = (x @ tensors["policy.head.weight"].T + tensors["policy.head.bias"])[0]
    (slope,) = torch.autograd.grad(outputs[2], middle)
    expected = (slope.mean((2, 3), keepdim=True) * middle).sum(1).relu()[0].detach().numpy()
    found = grad_cam(spec, weights, frame, target=2)
    assert found.layer == f"conv{chosen + 1}"
    assert found.cells == pytest.approx(expected, rel=0.01, abs=1e-3 * float(expected.max()))


def test_it_shows_only_what_the_network_sees() -> None:
    spec, weights, frame = setting("RACECRAFT_SMALL")
    picture = grad_cam(spec, weights, frame).picture
    assert picture.shape == spec.frame_shape
    assert not picture[: sky_rows(spec)].any()
    assert picture.min() >= 0
    assert picture.max() == pytest.approx(1.0)
    with pytest.raises(ConfigError, match="one camera alone"):
        grad_cam(replace(spec, lidar_size=8), weights, frame)
    with pytest.raises(ShapeError):
        grad_cam(spec, weights, frame[:100])
