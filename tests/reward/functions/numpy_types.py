import numpy as np

def reward_function(params):
    speeds = np.linspace(0.5, 4.0, 8)
    bucket = np.searchsorted(speeds, params['speed'])
    weights = np.zeros(9, dtype=np.int64)
    weights[:] = [0, 1, 2, 3, 5, 8, 13, 21, 34]
    if params['is_offtrack'] or params['is_crashed']:
        return np.int64(0)
    if bucket == 0:
        return np.bool_(True)
    return weights[bucket] / np.float16(34) if params['steps'] % 2 else np.array(weights[bucket] / 34.0)
