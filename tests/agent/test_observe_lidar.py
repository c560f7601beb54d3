"""AWS's three LIDAR sensors, from the same rays."""

from __future__ import annotations

import math

import numpy as np
import pytest

from racecraft.agent import LidarConfig, observation_shape, observe_lidar
from racecraft.errors import ConfigError, ShapeError


def discretized(rays: list[float], config: LidarConfig) -> list[float]:
    """As AWS's text says it, one sector after the other."""
    bits: list[float] = []
    per_sector = 64 // config.num_sectors
    for sector in range(config.num_sectors):
        nearest = min(min(rays[sector * per_sector : (sector + 1) * per_sector]), config.clipping_dist)
        one_hot = [0.0] * (config.num_values_per_sector + 1)
        one_hot[math.floor(nearest / (config.clipping_dist / config.num_values_per_sector))] = 1.0
        bits += one_hot[:-1]  # the last bin means that there is nothing
    return bits


RAYS = np.random.default_rng(2).uniform(0.15, 6.0, (50, 64)).astype(np.float32)


def test_lidar_clips_the_distances():
    found = observe_lidar("LIDAR", RAYS)
    np.testing.assert_array_equal(found, np.minimum(RAYS, 1.0))
    assert found.shape[1:] == observation_shape("LIDAR")


def test_sector_lidar_says_whether_anything_is_near():
    rays = np.full((2, 64), 12.0, np.float32)
    rays[0, 7], rays[0, 8], rays[1, 63] = 0.51, 0.49, 0.15
    found = observe_lidar("SECTOR_LIDAR", rays)
    assert found.tolist() == [[0, 1, 0, 0, 0, 0, 0, 0], [0, 0, 0, 0, 0, 0, 0, 1]]
    assert found.shape[1:] == observation_shape("SECTOR_LIDAR")


@pytest.mark.parametrize(
    "config", [LidarConfig(), LidarConfig(4, 6, 3.0), LidarConfig(64, 1, 0.5), LidarConfig(1, 64, 12.0)]
)
def test_discretized_sector_lidar_is_one_bit_for_each_sector(config):
    found = observe_lidar("DISCRETIZED_SECTOR_LIDAR", RAYS, config=config)
    assert found.tolist() == [discretized(row, config) for row in RAYS.tolist()]
    assert found.shape[1:] == observation_shape("DISCRETIZED_SECTOR_LIDAR", lidar=config)


def test_a_free_world_is_all_zeros():
    free = np.full((1, 64), 12.0, np.float32)
    for name in ("SECTOR_LIDAR", "DISCRETIZED_SECTOR_LIDAR"):
        assert not observe_lidar(name, free).any()


def test_what_cannot_be_is_refused():
    with pytest.raises(ConfigError, match="LIDAR sensor is 'SECTOR_LIDR'; allowed are LIDAR"):
        observe_lidar("SECTOR_LIDR", RAYS)
    with pytest.raises(ShapeError, match=r"expected \(N, 64\)"):
        observe_lidar("LIDAR", RAYS[:, :8])
