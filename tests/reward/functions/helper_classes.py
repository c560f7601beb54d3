import math

class Vec(object):
    def __init__(self, x, y):
        self.x = x
        self.y = y
    def __sub__(self, other):
        return Vec(self.x - other.x, self.y - other.y)
    def __mul__(self, k):
        return Vec(self.x * k, self.y * k)
    __rmul__ = __mul__
    def dot(self, other):
        return self.x * other.x + self.y * other.y
    @property
    def norm(self):
        return math.hypot(self.x, self.y)
    @staticmethod
    def polar(degrees):
        return Vec(math.cos(math.radians(degrees)), math.sin(math.radians(degrees)))

class Track:
    def __init__(self, params):
        self.points = [Vec(*p) for p in params['waypoints']]
        self.here, self.next = params['closest_waypoints']
    def tangent(self):
        return self.points[self.next] - self.points[self.here]

class Scorer(Track):
    WEIGHTS = {'heading': 0.7, 'speed': 0.3}
    def score(self, params):
        t = self.tangent()
        along = Vec.polar(params['heading']).dot(t) / max(t.norm, 1e-9)
        return self.WEIGHTS['heading'] * along + self.WEIGHTS['speed'] * params['speed'] / 4

def reward_function(params):
    s = Scorer(params)
    return s.score(params)
