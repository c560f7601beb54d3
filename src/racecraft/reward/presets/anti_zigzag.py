"""Follow the centre line without zigzagging: hard steering costs a fifth of the reward."""

STEERING_THRESHOLD = 15.0  # degrees; more than this, to either side, counts as hard steering


def reward_function(params):
    track_width = params["track_width"]
    distance_from_center = params["distance_from_center"]

    if distance_from_center <= 0.10 * track_width:
        reward = 1.0
    elif distance_from_center <= 0.25 * track_width:
        reward = 0.5
    elif distance_from_center <= 0.50 * track_width:
        reward = 0.1
    else:
        reward = 1e-3

    if abs(params["steering_angle"]) > STEERING_THRESHOLD:
        reward *= 0.8
    return reward
