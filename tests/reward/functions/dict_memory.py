'''Keeps state: a dict at the top of the module.'''
memory = {'laps': 0, 'max_speed': 0.0}

def remember(store, params):
    store['max_speed'] = max(store['max_speed'], params['speed'])
    if params['progress'] >= 100:
        store['laps'] += 1
    return store['max_speed']

def reward_function(params):
    top = remember(memory, params)
    return params['speed'] / top if top else 0.0
