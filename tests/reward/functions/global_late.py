'''Keeps state: globals that exist only after the first call.'''
def reward_function(params):
    global last_progress
    try:
        delta = params['progress'] - last_progress
    except NameError:
        delta = 0.0
    if params['steps'] < 3:
        delta = 0.0
    last_progress = params['progress']
    return max(-1.0, min(delta, 5.0))
