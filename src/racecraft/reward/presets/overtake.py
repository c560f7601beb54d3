"""Overtake: race the clock as `lap_time` does, keep out of the lane of a car ahead, and be paid twice for passing it.

A step pays for the metres of the lap that the car really gained since the last one. With another car or box within two
metres ahead it pays less, the nearer that is and the more squarely in the way, and more for every metre gained on it
once there is room beside it. Running into it costs more than leaving the road. It remembers where the car was
a step ago. Best with `--actions continuous`.
"""

STEP_SECONDS = 1.0 / 15.0  # the car decides fifteen times a second
OFF_TRACK_PENALTY = -1.0
CRASH_PENALTY = -2.0
REACH = 2.0  # metres ahead from which on another car matters
WIDTH = 0.3  # metres to the side that are enough to pass
TAIL_LOSS = 0.8  # fraction of the reward that is lost right behind another car
PASSING_GAIN = 1.0  # what a metre gained on a car that is being passed pays beside itself

before = {"steps": 0.0, "progress": 0.0}  # this car, a step ago


def reward_function(params):
    steps, progress = params["steps"], params["progress"]
    is_next_step = steps == before["steps"] + 1  # not so when an episode has just begun
    gain = (progress - before["progress"]) / 100.0 * params["track_length"]
    before["steps"], before["progress"] = steps, progress

    if params["is_crashed"]:
        return CRASH_PENALTY
    if params["is_offtrack"]:
        return OFF_TRACK_PENALTY
    if not is_next_step:
        return 0.0
    return gain + passing(params, gain)


def passing(params, gain):
    """What the next car or box ahead adds to the gain of a step, or takes from it."""
    if len(params["objects_distance"]) == 0:
        return 0.0
    _, ahead = params["closest_objects"]
    gap = (params["objects_distance"][ahead] - params["projection_distance"]) % params["track_length"]
    if gap > REACH:
        return 0.0
    here = params["distance_from_center"] if params["is_left_of_center"] else -params["distance_from_center"]
    there = params["objects_distance_from_center"][ahead]
    if not params["objects_left_of_center"][ahead]:
        there = -there

    # How far it is to the side: 0 straight ahead, 1 with room to pass.
    beside = min(abs(there - here) / WIDTH, 1.0)
    near = 1.0 - gap / REACH
    gained = gain - params["objects_speed"][ahead] * STEP_SECONDS
    return near * (PASSING_GAIN * beside * max(gained, 0.0) - TAIL_LOSS * (1.0 - beside) * gain)
