"""Point the car along the track: half of the reward is lost when it looks more than ten degrees away."""

import math

DIRECTION_THRESHOLD = 10.0  # degrees


def reward_function(params):
    waypoints = params["waypoints"]
    previous, following = params["closest_waypoints"]

    # The direction of the track is the direction from the waypoint behind the car to the one ahead of it.
    x0, y0 = waypoints[previous]
    x1, y1 = waypoints[following]
    track_direction = math.degrees(math.atan2(y1 - y0, x1 - x0))

    # Both angles run from -180 to 180 degrees, so their difference may have to go the short way round.
    difference = abs(track_direction - params["heading"])
    if difference > 180.0:
        difference = 360.0 - difference

    return 0.5 if difference > DIRECTION_THRESHOLD else 1.0
