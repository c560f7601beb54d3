import math

def circle_radius(points):
    # circle through three points; None for a straight line
    (x1, y1), (x2, y2), (x3, y3) = points
    a = math.hypot(x2 - x1, y2 - y1)
    b = math.hypot(x3 - x2, y3 - y2)
    c = math.hypot(x3 - x1, y3 - y1)
    area = abs((x2 - x1) * (y3 - y1) - (x3 - x1) * (y2 - y1)) / 2
    if area < 1e-9:
        return float("inf")
    return a * b * c / (4 * area)

def reward_function(params):
    waypoints = params["waypoints"][:-1] if params["waypoints"][0] == params["waypoints"][-1] else params["waypoints"]
    n = len(waypoints)
    i = params["closest_waypoints"][1] % n
    samples = [waypoints[(i + k) % n] for k in (0, 3, 6)]
    radius = circle_radius(samples)
    best_speed = min(4.0, max(1.0, math.sqrt(3.0 * radius))) if radius != float("inf") else 4.0
    error = abs(best_speed - params["speed"])
    return math.e ** (-error) if not params["is_offtrack"] else -1
