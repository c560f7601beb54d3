'''Keeps state: an attribute of the function.'''
def reward_function(params):
    if not hasattr(reward_function, 'count'):
        reward_function.count = 0
    reward_function.count += 1
    if params['steps'] == 2:
        reward_function.count = 1
    return reward_function.count / (reward_function.count + 10.0)
