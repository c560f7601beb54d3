"""Finish in fewer steps: a bonus every hundred steps for a car that is ahead of the target pace."""

TARGET_STEPS = 300  # steps for a whole lap; at 15 steps a second this is a lap of 20 seconds
BONUS = 10.0


def reward_function(params):
    steps = params["steps"]
    reward = 1.0

    # Where would a car be now that finishes the lap in exactly TARGET_STEPS?
    expected_progress = 100.0 * steps / TARGET_STEPS
    if steps % 100 == 0 and params["progress"] > expected_progress:
        reward += BONUS
    return reward
