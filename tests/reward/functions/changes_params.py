def normalise(params):
    params['heading'] = params['heading'] % 360
    params['waypoints'] = [(round(x, 3), round(y, 3)) for x, y in params['waypoints']]
    params['closest_waypoints'].reverse()
    params['my_bonus'] = 0.5
    del params['is_crashed']
    return params

def reward_function(params):
    params = normalise(params)
    nxt = params['closest_waypoints'][0]
    locals().update(params)
    assert 0 <= params['heading'] < 360 and nxt >= 0
    return params['my_bonus'] + params['progress'] / 100
