"""Race among boxes and other cars, faster than a walk: pay for every metre, and make mistakes dear.

As `dodge`, less the more squarely the next object stands in the way: by nothing two metres before it, by nearly all of
it from two thirds of a metre on. A car at 4 m/s is paid for a lap in a few seconds; were a mistake as cheap as a metre
of it, it would rather run into something now and then than lift.
"""

import math

STEP_SECONDS = 1.0 / 15.0  # the car decides fifteen times a second
MISTAKE = -15.0  # off the road, or into something
BORDER_LOSS = 0.5  # fraction of the reward that is lost at the border
LOOK_AHEAD = 2.0  # metres along the track
LOOK_BEHIND = 0.5  # metres: the car is not past an object before its rear is
ROOM = 0.45  # metres across, from middle to middle, that are enough to pass


def reward_function(params):
    if params["is_offtrack"] or params["is_crashed"]:
        return MISTAKE
    offset = params["distance_from_center"] / (0.5 * params["track_width"])
    return gain(params) * (1.0 - BORDER_LOSS * min(offset, 1.0) ** 2) * (1.0 - danger(params))


def gain(params):
    """Metres along the centre line that the commanded speed makes of this step."""
    waypoints = params["waypoints"]
    previous, following = params["closest_waypoints"]
    x0, y0 = waypoints[previous]
    x1, y1 = waypoints[following]
    track_direction = math.atan2(y1 - y0, x1 - x0)
    return params["speed"] * STEP_SECONDS * math.cos(math.radians(params["heading"]) - track_direction)


def danger(params):
    """0 for a free road, 1 for an object straight ahead and near."""
    worst = 0.0
    if not params["objects_location"]:
        return worst
    here = params["distance_from_center"] if params["is_left_of_center"] else -params["distance_from_center"]
    length = params["track_length"]
    for index in params["closest_objects"]:
        ahead = params["objects_distance"][index] - params["projection_distance"]
        ahead = (ahead + 0.5 * length) % length - 0.5 * length  # the shorter way round the lap
        if -LOOK_BEHIND < ahead < LOOK_AHEAD:
            there = params["objects_distance_from_center"][index]
            if not params["objects_left_of_center"][index]:
                there = -there
            in_the_way = max(0.0, 1.0 - abs(there - here) / ROOM)
            nearness = min(1.0, 1.5 * (1.0 - max(ahead, 0.0) / LOOK_AHEAD))
            worst = max(worst, in_the_way * nearness)
    return worst
