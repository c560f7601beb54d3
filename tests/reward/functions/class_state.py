'''Keeps state: an object with self.prev_*.'''
import math

class PARAMS:
    prev_speed = None
    prev_steering_angle = None
    prev_steps = None
    prev_direction_diff = None
    prev_normalized_distance_from_route = None

def angle_mod_360(angle):
    n = math.floor(angle / 360.0)
    angle_between_0_and_360 = angle - n * 360.0
    if angle_between_0_and_360 <= 180.0:
        return angle_between_0_and_360
    else:
        return angle_between_0_and_360 - 360

def get_waypoints_ordered_in_driving_direction(params):
    if params['is_reversed']:
        return list(reversed(params['waypoints']))
    else:
        return params['waypoints']

def reward_function(params):
    heading = params['heading']
    distance_from_center = params['distance_from_center']
    steps = params['steps']
    steering_angle = params['steering_angle']
    speed = params['speed']

    # Reinitialize previous parameters if it is a new episode
    if PARAMS.prev_steps is None or steps < PARAMS.prev_steps:
        PARAMS.prev_speed = None
        PARAMS.prev_steering_angle = None
        PARAMS.prev_direction_diff = None

    has_speed_dropped = False
    if PARAMS.prev_speed is not None:
        if PARAMS.prev_speed > speed:
            has_speed_dropped = True
    is_turn_upcoming = abs(steering_angle) > 10
    speed_maintain_bonus = min(speed / PARAMS.prev_speed, 1) if has_speed_dropped and not is_turn_upcoming else 1

    ways = get_waypoints_ordered_in_driving_direction(params)
    prev, nxt = params['closest_waypoints']
    route = math.degrees(math.atan2(ways[nxt][1] - ways[prev][1], ways[nxt][0] - ways[prev][0]))
    direction_diff = angle_mod_360(route - heading)
    heading_decrease_bonus = 0
    if PARAMS.prev_direction_diff is not None and abs(PARAMS.prev_direction_diff / (direction_diff or 1e-6)) > 1:
        heading_decrease_bonus = min(10, abs(PARAMS.prev_direction_diff / (direction_diff or 1e-6)))

    heading_reward = math.cos(abs(direction_diff) * (math.pi / 180)) ** 10
    distance_reward = 1 - (distance_from_center / (params['track_width'] / 2)) ** 0.4
    if isinstance(distance_reward, complex):
        distance_reward = 0

    PARAMS.prev_speed = speed
    PARAMS.prev_steering_angle = steering_angle
    PARAMS.prev_direction_diff = direction_diff
    PARAMS.prev_steps = steps
    IC = (1.0 + distance_reward + distance_reward ** 2 + distance_reward * heading_reward) * speed_maintain_bonus
    return max(float(IC + heading_decrease_bonus), 1e-3)
