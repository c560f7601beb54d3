"""Race: pay for every metre gained along the track in this step. Learns fast, and learns to drive fast.

The reward of a step is the distance the car is about to gain along the centre line, in metres, a little
less towards the borders so that a beginner learns to stay away from them, and -1 for leaving the road. It
depends on this step alone, so it needs no memory, and it adds up to about the length of the lap.
"""

import math

STEP_SECONDS = 1.0 / 15.0  # the car decides fifteen times a second
OFF_TRACK_PENALTY = -1.0
BORDER_LOSS = 0.5  # fraction of the reward that is lost at the border


def reward_function(params):
    if params["is_offtrack"] or params["is_crashed"]:
        return OFF_TRACK_PENALTY

    # How much of the car's speed points along the track: all of it straight ahead, none sideways, negative
    # backwards.
    waypoints = params["waypoints"]
    previous, following = params["closest_waypoints"]
    x0, y0 = waypoints[previous]
    x1, y1 = waypoints[following]
    track_direction = math.atan2(y1 - y0, x1 - x0)
    gain = params["speed"] * STEP_SECONDS * math.cos(math.radians(params["heading"]) - track_direction)

    # 0 on the centre line, 1 at the border. Squared, so that a wide band in the middle is almost free: the
    # racing line needs that room.
    offset = params["distance_from_center"] / (0.5 * params["track_width"])
    return gain * (1.0 - BORDER_LOSS * min(offset, 1.0) ** 2)
