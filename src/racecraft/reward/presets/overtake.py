"""Overtake: race as `racing` does, keep out of the lane of a car ahead, and be paid for the metres gained on it.

Beside the metres gained along the track, a step pays for the next car or box ahead within two metres:
less the nearer it is while the car heads straight for it, and more for every metre gained on it once the car
is beside its lane, so that passing pays twice. Running into it costs more than leaving the road.
"""

import math

STEP_SECONDS = 1.0 / 15.0  # the car decides fifteen times a second
OFF_TRACK_PENALTY = -1.0
CRASH_PENALTY = -2.0
BORDER_LOSS = 0.5  # fraction of the reward that is lost at the border
REACH = 2.0  # metres ahead from which on another car matters
WIDTH = 0.3  # metres to the side that are enough to pass
TAIL_LOSS = 0.8  # fraction of the reward that is lost right behind another car
PASSING_GAIN = 1.0  # what a metre gained on a car that is being passed pays beside itself


def reward_function(params):
    if params["is_crashed"]:
        return CRASH_PENALTY
    if params["is_offtrack"]:
        return OFF_TRACK_PENALTY

    waypoints = params["waypoints"]
    previous, following = params["closest_waypoints"]
    x0, y0 = waypoints[previous]
    x1, y1 = waypoints[following]
    track_direction = math.atan2(y1 - y0, x1 - x0)
    pace = params["speed"] * math.cos(math.radians(params["heading"]) - track_direction)
    offset = params["distance_from_center"] / (0.5 * params["track_width"])
    reward = pace * STEP_SECONDS * (1.0 - BORDER_LOSS * min(offset, 1.0) ** 2)

    if len(params["objects_distance"]) == 0:
        return reward
    _, ahead = params["closest_objects"]
    gap = (params["objects_distance"][ahead] - params["projection_distance"]) % params["track_length"]
    if gap > REACH:
        return reward

    # How far it is to the side: 0 straight ahead, 1 with room to pass.
    sides = [1.0 if params["objects_left_of_center"][ahead] else -1.0, 1.0 if params["is_left_of_center"] else -1.0]
    theirs = sides[0] * params["objects_distance_from_center"][ahead]
    beside = min(abs(theirs - sides[1] * params["distance_from_center"]) / WIDTH, 1.0)
    near = 1.0 - gap / REACH
    gained = (pace - params["objects_speed"][ahead]) * STEP_SECONDS
    return reward * (1.0 - TAIL_LOSS * near * (1.0 - beside)) + PASSING_GAIN * near * beside * max(gained, 0.0)
