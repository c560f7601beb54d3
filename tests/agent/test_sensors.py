import pytest

from racecraft.agent import LidarConfig, check_sensors, observation_shape
from racecraft.agent.sensors import CAMERAS, LIDARS, SENSOR_NAMES
from racecraft.errors import ConfigError


@pytest.mark.parametrize("camera", CAMERAS)
def test_one_camera_and_at_most_one_lidar(camera):
    assert check_sensors([camera]) == (camera,)
    for lidar in LIDARS:
        assert check_sensors([lidar, camera]) == (lidar, camera)
    with pytest.raises(ConfigError, match="2 cameras"):
        check_sensors([camera, camera])


def test_misspelt_sensor_is_guessed():
    with pytest.raises(ConfigError) as error:
        check_sensors(["FRONT_FACING_CAM"])
    assert error.value.hint == "Did you mean 'FRONT_FACING_CAMERA'?"


def test_shapes_are_those_of_aws_networks():
    shapes = {name: observation_shape(name) for name in SENSOR_NAMES}
    assert shapes["FRONT_FACING_CAMERA"] == shapes["observation"] == shapes["LEFT_CAMERA"] == (120, 160, 1)
    assert shapes["STEREO_CAMERAS"] == (120, 160, 2)
    assert (shapes["LIDAR"], shapes["SECTOR_LIDAR"], shapes["DISCRETIZED_SECTOR_LIDAR"]) == (
        (64,),
        (8,),
        (64,),
    )
    assert observation_shape("DISCRETIZED_SECTOR_LIDAR", lidar=LidarConfig(16, 3)) == (48,)
    with pytest.raises(ConfigError):
        observation_shape("CAMERA")
