"""Race against the clock: pay for every metre of the lap that the car really gained since the last step.

`racing` pays for the speed that was commanded; this pays for progress, which a car makes none of while it slides, and
more of on the inside of a bend. It remembers where the car was a step ago. Best with `--actions continuous`.
"""

OFF_TRACK_PENALTY = -1.0

before = {"steps": 0.0, "progress": 0.0}  # this car, a step ago


def reward_function(params):
    steps, progress = params["steps"], params["progress"]
    is_next_step = steps == before["steps"] + 1  # not so when an episode has just begun
    gain = (progress - before["progress"]) / 100.0 * params["track_length"]
    before["steps"], before["progress"] = steps, progress

    if params["is_offtrack"] or params["is_crashed"]:
        return OFF_TRACK_PENALTY
    return gain if is_next_step else 0.0
