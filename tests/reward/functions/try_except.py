def reward_function(params):
    reward = 0.0
    try:
        reward = 1.0 / params['distance_from_center'] if params['distance_from_center'] > 0.05 else 20.0
        reward += params['waypoints'][params['closest_waypoints'][1] + 3][0] * 0.0
        reward += 1.0 / len(params['objects_distance'])
    except (IndexError, KeyError) as e:
        print('past the end: ' + str(e))
    except ZeroDivisionError:
        pass
    except Exception:
        raise
    else:
        reward += 1
    finally:
        payload = saved_speed = params['speed']
    load = save = payload + saved_speed
    return load if reward is None else reward
