from math import atan2, degrees, radians, cos, sin, pi, sqrt, hypot, fmod, copysign

def wrap(a):
    while a > 180.0:
        a -= 360.0
    while a < -180.0:
        a += 360.0
    return a

def reward_function(params):
    w, (p, n) = params['waypoints'], params['closest_waypoints']
    track = degrees(atan2(w[n][1] - w[p][1], w[n][0] - w[p][0]))
    a = wrap(track - params['heading'])
    b = degrees(atan2(sin(radians(track - params['heading'])), cos(radians(track - params['heading']))))
    c = (track - params['heading'] + 540) % 360 - 180
    assert abs(wrap(a - b)) < 1e-6 and abs(wrap(a - c)) < 1e-6
    lookahead = wrap(a - params['steering_angle'])
    return cos(radians(a)) ** 2 * sqrt(params['speed']) * (1 - fmod(abs(lookahead), 180.0) / 360.0)
