"""Tour roads it has never seen: pay for every metre really gained, but not for taking a bend at the limit of the tyres.

As `lap_time`, with two margins. Metres near the border are worth half of those in the middle, and accelerating across
the road harder than COMFORT costs: that leaves a fifth of the front tyres' grip for what a driver could not
know. It remembers where the car was a step ago. Best with `--recipe everywhere`.
"""

import math

OFF_TRACK_PENALTY = -1.0
BORDER_LOSS = 0.5  # fraction of the reward that is lost at the border
COMFORT = 2.5  # m/s2 across the road
HASTE_PENALTY = 0.05  # for each time COMFORT beyond it
WHEELBASE = 0.165  # m

before = {"steps": 0.0, "progress": 0.0}  # this car, a step ago


def reward_function(params):
    steps, progress = params["steps"], params["progress"]
    is_next_step = steps == before["steps"] + 1  # not so when an episode has just begun
    gain = (progress - before["progress"]) / 100.0 * params["track_length"]
    before["steps"], before["progress"] = steps, progress

    if params["is_offtrack"] or params["is_crashed"]:
        return OFF_TRACK_PENALTY
    if not is_next_step:
        return 0.0

    # On a circle of this radius: speed squared over radius.
    curvature = math.tan(math.radians(abs(params["steering_angle"]))) / WHEELBASE
    across = params["speed"] ** 2 * curvature

    offset = params["distance_from_center"] / (0.5 * params["track_width"])
    metres = gain * (1.0 - BORDER_LOSS * min(offset, 1.0) ** 2)
    return metres - HASTE_PENALTY * max(across / COMFORT - 1.0, 0.0)
