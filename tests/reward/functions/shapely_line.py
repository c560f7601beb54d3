from shapely.geometry import Point, LineString

def reward_function(params):
    line = LineString(params['waypoints'])
    car = Point(params['x'], params['y'])
    gap = line.distance(car)
    half = params['track_width'] / 2.0
    assert abs(gap - params['distance_from_center']) < 1e-6
    return max(1 - gap / half, 1e-3)
