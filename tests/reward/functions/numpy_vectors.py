import numpy as np

def reward_function(params):
    wp = np.array(params['waypoints'])
    pos = np.array([params['x'], params['y']])
    d = np.linalg.norm(wp - pos, axis=1)
    nearest = np.argmin(d)
    ahead = wp[(nearest + np.arange(1, 8)) % len(wp)]
    aim = ahead.mean(axis=0) - pos
    heading = np.deg2rad(params['heading'])
    cosine = np.dot(aim / np.linalg.norm(aim), [np.cos(heading), np.sin(heading)])
    return np.clip(cosine, 0, 1) * np.float32(params['speed'])
