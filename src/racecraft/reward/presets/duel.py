"""Race head to head: be paid for every metre really gained, and three more where it is won from a car nearby.

Alone a car is fast for its own sake. In a race the same metre is worth more where it is won from somebody: without that
a pass, a metre or two of gain, is never worth its danger, and whoever is behind follows to the line. A mistake costs a
penalty of seconds and a start from standing while the others drive on, so it is dear. It remembers where the car and
the one nearest to it were a step ago. Best with `--actions continuous`.
"""

MISTAKE_PENALTY = -8.0  # on top of what the rest of the episode would have paid
REACH = 2.0  # metres along the road, ahead or behind, within which another car is raced
RACING = 3.0  # what a metre gained on it pays, beside itself
FASTEST = 0.6  # metres a step; a car that is farther on was put somewhere else

before = {"steps": 0.0, "progress": 0.0, "rival": 0.0, "there": 0.0}  # this car and its rival, a step ago


def reward_function(params):
    steps, progress = params["steps"], params["progress"]
    is_next_step = steps == before["steps"] + 1  # not so when an episode has just begun
    gain = (progress - before["progress"]) / 100.0 * params["track_length"]
    raced = won(params, gain)
    before["steps"], before["progress"] = steps, progress

    if params["is_offtrack"] or params["is_crashed"]:
        return MISTAKE_PENALTY
    return gain + RACING * raced if is_next_step else 0.0


def won(params, gain):
    """Metres that a step of such a gain took from the nearest other car, if that is being raced."""
    if len(params["objects_distance"]) == 0:
        return 0.0
    here, length, places = params["projection_distance"], params["track_length"], params["objects_distance"]
    behind, ahead = params["closest_objects"]
    is_ahead = abs(along(places[ahead], here, length)) <= abs(along(places[behind], here, length))
    rival = ahead if is_ahead else behind
    theirs = along(places[rival], before["there"], length)
    is_same = rival == before["rival"] and -0.1 < theirs < FASTEST
    before["rival"], before["there"] = rival, places[rival]
    return gain - theirs if is_same and abs(along(places[rival], here, length)) < REACH else 0.0


def along(there, here, length):
    """Metres from here to there, by the shorter way round the lap."""
    return (there - here + 0.5 * length) % length - 0.5 * length
