def reward_function(params):
    steps = int(params['steps'])
    progress = int(params['progress'])
    on = int(params['all_wheels_on_track'])
    text = "{}|{}|{}".format(steps, progress, on)
    a, b, c = [float(part) for part in text.split("|")]
    width = round(float(str(params['track_width'])), 3)
    left = bool(params['is_left_of_center']) * 2 - 1
    score = int(on) << 2 | (steps & 1)
    return int(score + b // 10 - (a > 500) + 0 * left * width)
