from __future__ import annotations

import numpy as np
import pytest

from racecraft.errors import ConfigError, ShapeError
from racecraft.learn import NetworkSpec, networks
from racecraft.learn.networks import glorot_weights, initial_weights, network_names, parameter_count, weight_shapes

SHALLOW = "DEEP_CONVOLUTIONAL_NETWORK_SHALLOW"


def test_shallow_has_aws_size_per_tower():
    spec = NetworkSpec(name=SHALLOW, num_actions=10)
    assert networks.flat_size(spec) == 11264
    convs = (8 * 8 * 32 + 32) + (4 * 4 * 32 * 64 + 64) + (3 * 3 * 64 * 64 + 64)
    body = convs + 11264 * 512 + 512
    assert body == 5_839_520  # the 5.84 M of AWS
    assert parameter_count(spec, tower="policy") == body + 512 * 10 + 10
    assert parameter_count(spec, tower="critic") == body + 512 + 1


@pytest.mark.parametrize(
    ("name", "sizes"),
    [
        ("DEEP_CONVOLUTIONAL_NETWORK", [(64, 64, 1, 1), (512, 56_000)]),
        ("DEEP_CONVOLUTIONAL_NETWORK_DEEP", [(512, 64, 1, 1), (512, 512, 1, 1), (256, 9_216), (128, 256)]),
    ],
)
def test_inner_dense_layers_of_the_deep_networks_act_at_every_position(name, sizes):
    """TensorFlow's dense layers act on the last axis; AWS's trainer flattens behind these (Coach's InputEmbedder)."""
    shapes = weight_shapes(NetworkSpec(name=name, num_actions=10))
    inner = [shape for key, shape in shapes.items() if key.startswith("policy.") and key.endswith("weight")][4:-1]
    assert inner == sizes


def test_a_policy_of_sac_has_one_more_layer_as_aws_has():
    plain, squashed = (
        weight_shapes(NetworkSpec(name=SHALLOW, num_actions=2, is_discrete=False, is_squashed=is_squashed))
        for is_squashed in (False, True)
    )
    assert squashed["policy.dense2.weight"] == (256, 512)
    assert squashed["policy.head.weight"] == (2, 256)
    assert plain["policy.head.weight"] == (2, 512)
    small = weight_shapes(NetworkSpec(num_actions=2, is_discrete=False, is_squashed=True))
    assert small["policy.head.weight"] == (2, 128)


def test_default_network_is_small():
    spec = NetworkSpec(num_actions=10, state_size=20)
    assert network_names()[0] == spec.name
    assert parameter_count(spec) < 60_000


@pytest.mark.parametrize("name", network_names())
def test_privileged_critic_replaces_only_the_critic(name):
    camera, privileged = (weight_shapes(NetworkSpec(name=name, num_actions=4, state_size=s)) for s in (0, 12))
    policy = {key: shape for key, shape in camera.items() if key.startswith("policy.")}
    assert policy == {key: shape for key, shape in privileged.items() if key.startswith("policy.")}
    assert privileged["critic.dense1.weight"] == (64, 12)


def test_misspelt_network_gets_a_suggestion():
    with pytest.raises(ConfigError, match="allowed are RACECRAFT_SMALL") as caught:
        networks.architecture("RACECRAFT_SMAL")
    assert "RACECRAFT_SMALL" in caught.value.hint


def test_encode_cuts_the_sky_averages_squares_and_folds_blocks():
    spec = NetworkSpec(num_actions=2)
    frames = np.random.default_rng(0).integers(0, 256, (3, 120, 160), dtype=np.uint8)
    observations = networks.encode(spec, frames)
    assert observations.shape == (3, *networks.observation_shape(spec)) == (3, 12, 20, 16)
    pooled = np.floor(frames[:, 24:].reshape(3, 48, 2, 80, 2).mean((2, 4)) + 0.5)
    for row, column, pixel in [(0, 0, 0), (11, 19, 15), (7, 3, 6)]:
        y, x = 4 * row + pixel // 4, 4 * column + pixel % 4
        np.testing.assert_array_equal(observations[:, row, column, pixel], pooled[:, y, x])


@pytest.mark.parametrize("name", network_names())
def test_encode_returns_its_own_copy(name):
    spec = NetworkSpec(name=name, num_actions=2)
    frames = np.zeros((2, *networks.sight_shape(spec)), np.uint8)
    observations = networks.encode(spec, frames)
    frames[:] = 9
    assert not observations.any()
    assert observations.flags.c_contiguous


@pytest.mark.parametrize(
    "frames",
    [np.zeros((1, 60, 80), np.uint8), np.zeros((1, 120, 160), np.float32), np.zeros((120, 160), np.uint8)],
)
def test_encode_refuses_other_images(frames):
    with pytest.raises(ShapeError, match="expected"):
        networks.encode(NetworkSpec(num_actions=2), frames)


def test_initial_weights_are_orthogonal_and_repeatable():
    spec = NetworkSpec(num_actions=5, state_size=8)
    weights, again, other = (initial_weights(spec, seed=seed) for seed in (4, 4, 5))
    for name, array in weights.items():
        assert array.shape == weight_shapes(spec)[name]
        np.testing.assert_array_equal(array, again[name])
    assert not np.array_equal(weights["policy.conv1.weight"], other["policy.conv1.weight"])
    matrix = weights["policy.conv2.weight"].reshape(32, -1)
    np.testing.assert_allclose(matrix @ matrix.T, 2 * np.eye(32), atol=1e-5)
    assert abs(weights["policy.head.weight"]).max() < 0.011


@pytest.mark.parametrize("is_discrete", [True, False])
def test_glorot_weights_are_uniform_within_their_limits_and_repeatable(is_discrete):
    spec = NetworkSpec(num_actions=6, is_discrete=is_discrete)
    weights, again, other = (glorot_weights(spec, seed=seed) for seed in (4, 4, 5))
    assert list(weights) == list(weight_shapes(spec))
    for name, array in weights.items():
        assert array.shape == weight_shapes(spec)[name]
        assert array.dtype == np.float32
        np.testing.assert_array_equal(array, again[name])
    assert not np.array_equal(weights["policy.conv1.weight"], other["policy.conv1.weight"])
    assert not any(array.any() for name, array in weights.items() if name.endswith(".bias"))
    layers = {"conv2": 16 * (16 + 32), "dense1": 128 + weights["policy.dense1.weight"].shape[1]}
    for layer, inputs_and_outputs in layers.items():
        array, limit = weights[f"policy.{layer}.weight"], (6 / inputs_and_outputs) ** 0.5
        assert 0.99 * limit < abs(array).max() <= limit
        assert array.std() == pytest.approx(limit / 3**0.5, rel=0.02)
    head, value = weights["policy.head.weight"], weights["critic.head.weight"]
    assert np.linalg.norm(value) == pytest.approx(1.0)
    if is_discrete:
        assert 0.95 * (6 / (128 + 6)) ** 0.5 < abs(head).max() <= (6 / (128 + 6)) ** 0.5
    else:
        np.testing.assert_allclose(np.linalg.norm(head, axis=1), 0.01, rtol=1e-5)


def test_too_small_frames_are_refused():
    with pytest.raises(ConfigError, match="too small"):
        weight_shapes(NetworkSpec(num_actions=2, frame_shape=(16, 16)))
