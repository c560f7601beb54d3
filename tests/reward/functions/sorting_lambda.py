import operator
from functools import reduce, partial

def distance(a, b):
    return ((a[0] - b[0]) ** 2 + (a[1] - b[1]) ** 2) ** .5

def reward_function(params):
    car = (params['x'], params['y'])
    ranked = sorted(enumerate(params['waypoints']), key=lambda item: distance(item[1], car))
    (i, first), (j, second) = ranked[0], ranked[1]
    nearest = min(params['waypoints'], key=partial(distance, car))
    params['waypoints'].sort(key=operator.itemgetter(0))
    leftmost = params['waypoints'][0][0]
    total = reduce(lambda s, item: s + distance(item[1], car), ranked[:5], 0.0)
    assert nearest == first and leftmost <= first[0]
    return 1 / (1 + total) + (0.1 if abs(i - j) == 1 else 0)
