def binary_search(values, target, low=0, high=None):
    high = len(values) if high is None else high
    if high - low <= 1:
        return low
    mid = (low + high) // 2
    return binary_search(values, target, mid, high) if values[mid] <= target else binary_search(values, target, low, mid)

def arc(points):
    return [0.0] if len(points) == 1 else arc(points[:-1]) + [0.0]

def reward_function(params):
    count = len(params['waypoints'])
    marks = [params['track_length'] * k / count for k in range(count)]
    k = binary_search(marks, params['projection_distance'])
    depth = len(arc(params['waypoints'][:40]))
    return 1.0 - abs(marks[k] - params['projection_distance']) / params['track_length'] + depth * 1e-3
