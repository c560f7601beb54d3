"""Fast on straights, slow into bends, never off the road: looks ahead along the waypoints."""

import math

LOOK_AHEAD = 1.0  # m
SHARP = 40.0  # degrees that the road turns within that distance: a sharp bend
FASTEST, SLOWEST = 2.0, 1.0  # m/s, on a straight and in a sharp bend; the action space has both


def reward_function(params):
    if params["is_offtrack"]:
        return 1e-3

    # 1 on the centre line, 0 at the border.
    centred = 1.0 - min(params["distance_from_center"] / (0.5 * params["track_width"]), 1.0)

    # 1 at the speed that the road ahead asks for, less the further from it.
    turn = min(abs(turn_ahead(params)) / SHARP, 1.0)
    wanted = FASTEST - (FASTEST - SLOWEST) * turn
    paced = math.exp(-((params["speed"] - wanted) ** 2))

    # What counts is progress along the road, so a car that points elsewhere gets less.
    waypoints = params["waypoints"]
    before, after = (waypoints[index] for index in params["closest_waypoints"])
    error = math.radians(params["heading"]) - math.atan2(after[1] - before[1], after[0] - before[0])
    aligned = max(math.cos(error), 0.0)

    return float(aligned * (0.3 + 0.4 * centred + 0.6 * paced))


def turn_ahead(params):
    """Degrees that the road turns within the next metre, left positive."""
    waypoints = params["waypoints"]
    first = index = params["closest_waypoints"][0]
    distance = 0.0
    while distance < LOOK_AHEAD:
        here, there = waypoints[index % len(waypoints)], waypoints[(index + 1) % len(waypoints)]
        distance += max(math.dist(here, there), 1e-3)  # the last waypoint is the first again: no distance at all
        index += 1
    turn = direction(waypoints, index) - direction(waypoints, first)
    return (turn + 180.0) % 360.0 - 180.0


def direction(waypoints, index):
    """Direction of the road at a waypoint, degrees."""
    count = len(waypoints)
    here, there = waypoints[index % count], waypoints[(index + 1) % count]
    if here == there:
        there = waypoints[(index + 2) % count]
    return math.degrees(math.atan2(there[1] - here[1], there[0] - here[0]))
