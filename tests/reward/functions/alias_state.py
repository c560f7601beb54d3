'''Keeps state: a list of records, changed through another name.'''
RECORDS = [{'id': i, 'visits': 0} for i in range(4)]

def find(share):
    for record in RECORDS:
        if share < (record['id'] + 1) / 4:
            return record
    return RECORDS[-1]

def reward_function(params):
    record = find(params['projection_distance'] / params['track_length'])
    record['visits'] += 1
    return 1.0 / record['visits']
