'''Keeps state: the famous mutable default argument.'''
def smooth(value, window=[]):
    window.append(value)
    del window[:-5]
    return sum(window) / len(window)

def reward_function(params):
    return 1.0 - min(1.0, smooth(abs(params['steering_angle'])) / 30.0)
