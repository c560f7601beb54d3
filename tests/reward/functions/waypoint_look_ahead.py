'''Steer at a waypoint some way ahead, as so many do.'''
import math

def reward_function(params):
    # Read input variables
    waypoints = params['waypoints']
    closest_waypoints = params['closest_waypoints']
    heading = params['heading']
    x = params['x']
    y = params['y']

    # look 5 waypoints ahead
    LOOK_AHEAD = 5
    next_index = (closest_waypoints[1] + LOOK_AHEAD) % len(waypoints)
    target = waypoints[next_index]

    # direction from the car to that point, in degrees
    track_direction = math.atan2(target[1] - y, target[0] - x)
    track_direction = math.degrees(track_direction)

    direction_diff = abs(track_direction - heading)
    if direction_diff > 180:
        direction_diff = 360 - direction_diff

    DIRECTION_THRESHOLD = 10.0
    reward = 1.0
    if direction_diff > DIRECTION_THRESHOLD:
        reward *= 0.5
    if not params['all_wheels_on_track']:
        reward = 1e-3
    return float(reward)
