'''Keeps state: a closure with nonlocal.'''
def make():
    smoothed = 0.0

    def update(value, alpha=0.2):
        nonlocal smoothed
        smoothed += alpha * (value - smoothed)
        return smoothed

    return update

_smooth = make()

def reward_function(params):
    return _smooth(params['speed']) - 0.01 * abs(params['steering_angle'])
