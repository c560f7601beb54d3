"""From the rays of the simulated LIDAR to what AWS's LIDAR sensors tell a network.

simulation.lidar (N, 64) metres -> *observe_lidar* -> LIDAR | SECTOR_LIDAR | DISCRETIZED_SECTOR_LIDAR
"""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from racecraft.agent.sensors import LIDAR_RAYS, LIDARS, LidarConfig
from racecraft.checks import check_choice
from racecraft.errors import ShapeError

NEAREST: Final = 0.15  # m
FARTHEST: Final = 1.0  # m, of the sensor LIDAR; what is farther away is told as this
NUM_SECTORS: Final = 8
SECTOR_LIMIT: Final = 0.5  # m, below which SECTOR_LIDAR calls a sector occupied


def observe_lidar(name: str, rays: NDArray[np.float32], *, config: LidarConfig | None = None) -> NDArray[np.float32]:
    """What a LIDAR sensor tells.

    ``LIDAR``: the distances, clipped to 0.15 to 1 m  (N, 64). ``SECTOR_LIDAR``: for each of 8 sectors, whether
    anything is nearer than 0.5 m  (N, 8). ``DISCRETIZED_SECTOR_LIDAR``: for each sector, which of equal bins up to
    the clipping distance holds its nearest distance, as one bit; none where the sector is free
    (N, sectors x values).

    Args:
        name: Of the sensor.
        rays: m, `Simulation.lidar`  (N, 64).
        config: Of ``DISCRETIZED_SECTOR_LIDAR``; the default sizes when None.

    Raises:
        ConfigError: There is no such sensor.
        ShapeError: The rays are not (N, 64).
    """
    check_choice("LIDAR sensor", name, LIDARS)
    if rays.ndim != 2 or rays.shape[1] != LIDAR_RAYS:
        raise ShapeError(f"rays have shape {rays.shape}, expected (N, {LIDAR_RAYS}): one row per car, in metres.")
    if name == "LIDAR":
        return np.asarray(np.clip(rays, NEAREST, FARTHEST), dtype=np.float32)
    if name == "SECTOR_LIDAR":
        return np.asarray(_nearest(rays, NUM_SECTORS) < SECTOR_LIMIT, dtype=np.float32)
    config = config or LidarConfig()
    nearest = _nearest(rays, config.num_sectors)
    values = config.num_values_per_sector
    which = np.floor(nearest.astype(np.float64) / (config.clipping_dist / values))
    bits = (which[..., None] == np.arange(values)) & (nearest < config.clipping_dist)[..., None]
    return np.asarray(bits.reshape(len(rays), -1), dtype=np.float32)


def _nearest(rays: NDArray[np.float32], num_sectors: int) -> NDArray[np.float32]:
    """Nearest distance of each sector  (N, num_sectors)."""
    return np.asarray(rays.reshape(len(rays), num_sectors, -1).min(axis=2))
