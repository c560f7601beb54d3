"""Stay on the track and do not dawdle: below a speed threshold half of the reward is gone."""

SPEED_THRESHOLD = 1.0  # m/s


def reward_function(params):
    if not params["all_wheels_on_track"]:
        return 1e-3
    if params["speed"] < SPEED_THRESHOLD:
        return 0.5
    return 1.0
