# Fast on the straights, slow in the corners (waypoint numbers of the 2018 track).
FAST = list(range(0, 20)) + list(range(95, 119))
MEDIUM = [i for i in range(20, 40)] + [70, 71, 72, 73, 74, 75]

def reward_function(params):
    wp = params['closest_waypoints'][1]
    speed = params['speed']
    if wp in FAST:
        want = 3
    elif wp in MEDIUM:
        want = 2
    else:
        want = 1.2
    if speed >= want: reward = 1
    elif speed >= want * 0.75: reward = 0.5
    else: reward = 0.1
    if params['distance_from_center'] > 0.4 * params['track_width']: reward = reward / 2
    return reward
