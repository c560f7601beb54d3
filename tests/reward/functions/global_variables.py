'''Keeps state: module globals, changed through `global`.'''
prev_speed = 0
prev_steering = None
best_progress = {}

def reward_function(params):
    global prev_speed, prev_steering

    if params['steps'] <= 2:
        prev_speed = 0
        prev_steering = None

    reward = 1.0
    if params['speed'] > prev_speed and prev_speed > 0:
        reward += 0.5
    if prev_steering is not None and abs(prev_steering - params['steering_angle']) > 15:
        reward *= 0.7

    prev_speed = params['speed']
    prev_steering = params['steering_angle']
    return float(reward)
