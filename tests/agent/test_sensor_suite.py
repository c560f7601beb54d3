"""A car's sensors together: what they need of a simulation, and what they tell a network."""

from __future__ import annotations

import numpy as np
import pytest

from racecraft.agent import FRONT_CAMERA, LidarConfig, SensorSuite, observe_lidar
from racecraft.errors import ConfigError
from racecraft.learn import NetworkSpec, networks
from racecraft.sim import Objects, Obstacles, Simulation
from racecraft.track import load_track


def simulation_for(suite: SensorSuite) -> Simulation:
    objects = Objects(obstacles=Obstacles(count=5, placement="random"))
    cars = Simulation(load_track("oval"), num_envs=3, objects=objects, **suite.simulation_settings())
    cars.reset()
    cars.step(np.tile(np.float32([0.1, 1.0]), (3, 1)))
    return cars


def test_the_front_camera_alone_is_a_view_of_the_frames() -> None:
    cars = simulation_for(FRONT_CAMERA)
    assert FRONT_CAMERA.read(cars) is cars.frames
    assert (FRONT_CAMERA.lenses, FRONT_CAMERA.lidar_size, FRONT_CAMERA.lidar_name) == (1, 0, "")


@pytest.mark.parametrize(
    ("names", "lidar"),
    [
        (("STEREO_CAMERAS",), None),
        (("FRONT_FACING_CAMERA", "LIDAR"), None),
        (("SECTOR_LIDAR", "STEREO_CAMERAS"), None),
        (("LEFT_CAMERA", "DISCRETIZED_SECTOR_LIDAR"), LidarConfig(16, 4, 3.0)),
    ],
)
def test_what_it_reads_fits_the_network_and_holds_every_sensor(names, lidar) -> None:
    suite = SensorSuite(names, lidar)
    cars = simulation_for(suite)
    sight = suite.read(cars)
    spec = NetworkSpec(num_actions=2, lenses=suite.lenses, lidar_size=suite.lidar_size)
    assert sight.dtype == np.uint8
    assert sight.shape == (3, *networks.sight_shape(spec))
    pixels = cars.frames[0].size
    np.testing.assert_array_equal(sight.reshape(3, -1)[:, :pixels], cars.frames.reshape(3, -1))
    if suite.lidar_name:
        told = observe_lidar(suite.lidar_name, cars.lidar, config=lidar)
        heard = sight[:, pixels:] / 255.0
        assert heard.shape == told.shape
        assert abs(heard - told).max() <= 0.5 / 255 + 1e-6
        assert told.any()
        if suite.lidar_name != "LIDAR":
            np.testing.assert_array_equal(heard, told)  # bits are told exactly


def test_a_simulation_without_the_sensors_is_refused() -> None:
    cars = simulation_for(FRONT_CAMERA)
    with pytest.raises(ConfigError, match="not the camera of STEREO_CAMERAS"):
        SensorSuite(("STEREO_CAMERAS",)).read(cars)
    with pytest.raises(ConfigError, match="no LIDAR"):
        SensorSuite(("FRONT_FACING_CAMERA", "LIDAR")).read(cars)
    with pytest.raises(ConfigError, match="not the camera"):
        FRONT_CAMERA.read(Simulation(load_track("oval"), num_envs=1, camera=None))


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ({"names": "FRONT_FACING_CAMERA"}, "names is 'FRONT_FACING_CAMERA'; use a list of AWS's sensor names"),
        ({"names": 5}, "names is 5; use a list"),
        ({"lidar": 5}, "lidar is 5; use a racecraft.agent.LidarConfig, or None"),
    ],
)
def test_what_is_no_list_or_configuration_is_refused(given: dict[str, object], says: str) -> None:
    with pytest.raises(ConfigError, match=says):
        SensorSuite(**given)  # type: ignore[arg-type]


def test_names_that_do_not_go_together_are_refused() -> None:
    with pytest.raises(ConfigError, match="0 cameras"):
        SensorSuite(("LIDAR",))
