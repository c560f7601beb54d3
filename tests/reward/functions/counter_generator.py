'''Keeps state: a counter that a generator holds.'''
import itertools
from collections import deque, namedtuple

ticks = itertools.count(1)
recent = deque(maxlen=4)
Sample = namedtuple('Sample', 'tick speed')

def reward_function(params):
    recent.append(Sample(next(ticks), params['speed']))
    spread = max(s.speed for s in recent) - min(s.speed for s in recent)
    return 1.0 / (1.0 + spread) + (recent[-1].tick % 2) * 0.01
