def reward_function(p):
    speed = p.get('speed', 0.0)
    width = p.get('track_width') or 1.0
    off = p.get('is_offtrack', False) or p.get('is_crashed', False)
    left = p.get('is_left_of_center')
    objects = p.get('objects_location', [])
    if 'closest_objects' in p and len(objects):
        speed = speed / 2
    bias = {True: 0.1, False: 0.0}[left]
    return 0 if off else speed * (1 - p.get('distance_from_center', 0) / width) + bias
