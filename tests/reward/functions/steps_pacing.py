def reward_function(params):
    '''
    Bonus every 50 steps for a car that is faster than planned.
    '''
    steps = params['steps']
    progress = params['progress']
    TOTAL_NUM_STEPS = 220
    reward = 1.0

    if (steps % 50) == 0 and progress >= (steps / TOTAL_NUM_STEPS) * 100:
        reward += 10.0
    if progress == 100:
        reward += 100 * (TOTAL_NUM_STEPS / steps)
    elif params["is_offtrack"]:
        reward -= 5.0
    return float(reward)
