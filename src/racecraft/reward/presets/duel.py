"""Race head to head: pay for every metre really gained, as `lap_time` does, and more dearly for mistakes.

Alone a mistake ends an attempt; in a race it costs a penalty of seconds and a start from standing, while the other car
drives on. It remembers where the car was a step ago. Best with `--actions continuous`.
"""

MISTAKE_PENALTY = -4.0  # on top of what the rest of the episode would have paid

before = {"steps": 0.0, "progress": 0.0}  # this car, a step ago


def reward_function(params):
    steps, progress = params["steps"], params["progress"]
    is_next_step = steps == before["steps"] + 1  # not so when an episode has just begun
    gain = (progress - before["progress"]) / 100.0 * params["track_length"]
    before["steps"], before["progress"] = steps, progress

    if params["is_offtrack"] or params["is_crashed"]:
        return MISTAKE_PENALTY
    return gain if is_next_step else 0.0
