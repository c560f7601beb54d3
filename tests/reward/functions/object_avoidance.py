import math

def reward_function(params):
    all_wheels_on_track = params['all_wheels_on_track']
    distance_from_center = params['distance_from_center']
    track_width = params['track_width']
    objects_location = params['objects_location']
    agent_x = params['x']
    agent_y = params['y']
    closest_objects = params['closest_objects']
    objects_left_of_center = params['objects_left_of_center']
    is_left_of_center = params['is_left_of_center']

    reward = 1e-3
    if all_wheels_on_track and (0.5 * track_width - distance_from_center) >= 0.05:
        reward_lane = 1.0
    else:
        reward_lane = 1e-3

    reward_avoid = 1.0
    if len(objects_location) > 0:
        _, next_index = closest_objects
        next_x, next_y = objects_location[next_index]
        gap = math.sqrt((agent_x - next_x) ** 2 + (agent_y - next_y) ** 2)
        same_lane = objects_left_of_center[next_index] == is_left_of_center
        if same_lane:
            if gap < 0.3: reward_avoid = 1e-3
            elif gap < 0.5: reward_avoid *= 0.2
            elif gap < 0.8: reward_avoid *= 0.5
        for heading, speed in zip(params['objects_heading'], params['objects_speed']):
            reward_avoid -= 0.01 * speed
    if not params['object_in_camera']:
        reward_avoid = min(reward_avoid, 1.0)
    reward += 1.0 * reward_lane + 4.0 * reward_avoid
    return reward
