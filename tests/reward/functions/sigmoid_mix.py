import math
import statistics
from collections import Counter, OrderedDict, defaultdict

def sigmoid(z, k=4.0, mid=0.5):
    return 1 / (1 + math.exp(-k * (z - mid)))

def reward_function(params):
    terms = OrderedDict()
    terms['center'] = sigmoid(1 - 2 * params['distance_from_center'] / params['track_width'])
    terms['speed'] = sigmoid(params['speed'] / 4.0)
    terms['steer'] = 1 - abs(params['steering_angle']) / 30.0 * 0.5
    weights = defaultdict(lambda: 1.0, speed=2.0)
    total = sum(weights[name] * value for name, value in terms.items()) / sum(weights[name] for name in terms)
    kinds = Counter('high' if value > .5 else 'low' for value in terms.values())
    if kinds['low'] >= 2:
        total *= .5
    return statistics.mean([total, max(terms.values())])
