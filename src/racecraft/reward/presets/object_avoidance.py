"""Keep to the road and out of the way of boxes and other cars: the gap ahead counts more than the lane."""

import math

LANE_WEIGHT = 1.0
AVOIDANCE_WEIGHT = 4.0
MARGIN = 0.05  # metres that must be left between the car's middle and the border


def reward_function(params):
    return 1e-3 + LANE_WEIGHT * lane_reward(params) + AVOIDANCE_WEIGHT * avoidance_reward(params)


def lane_reward(params):
    """1 for a car well inside the borders."""
    distance_to_border = 0.5 * params["track_width"] - params["distance_from_center"]
    if params["all_wheels_on_track"] and distance_to_border >= MARGIN:
        return 1.0
    return 1e-3


def avoidance_reward(params):
    """1 for a free road ahead, falling to almost nothing just behind an object in the same lane."""
    locations = params["objects_location"]
    if not locations:
        return 1.0

    _, next_object = params["closest_objects"]
    if params["objects_left_of_center"][next_object] != params["is_left_of_center"]:
        return 1.0

    object_x, object_y = locations[next_object]
    distance = math.hypot(params["x"] - object_x, params["y"] - object_y)
    if 0.5 <= distance < 0.8:
        return 0.5
    if 0.3 <= distance < 0.5:
        return 0.2
    if distance < 0.3:
        return 1e-3
    return 1.0
