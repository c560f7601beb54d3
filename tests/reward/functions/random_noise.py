import random

def reward_function(params):
    # dropout on the reward, somebody thought it would help
    reward = params['speed']
    if random.random() < 0.1:
        reward = 0.0
    return reward + random.gauss(0, 0.01)
