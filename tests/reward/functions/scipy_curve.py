import numpy as np
from scipy.spatial import distance
from scipy import interpolate

def reward_function(params):
    i = params['closest_waypoints'][0]
    points = params['waypoints'][i:i + 6] + params['waypoints'][1:7]
    ahead = np.array(points[:6])
    s = np.append(0, np.cumsum(np.hypot(*np.diff(ahead, axis=0).T)))
    mid = interpolate.interp1d(s, ahead, axis=0)(s[-1] / 2)
    gap = distance.euclidean(mid, (params['x'], params['y']))
    return float(np.exp(-gap))
