'''Keeps state: an instance made at import, with history in a list.'''
class Pilot:
    def __init__(self):
        self.history = []
        self.prev_progress = 0.0
        self.prev_steps = 0

    def reset(self):
        self.history = []
        self.prev_progress = 0.0

    def __call__(self, params):
        if params['steps'] < self.prev_steps:
            self.reset()
        gain = params['progress'] - self.prev_progress
        self.prev_progress = params['progress']
        self.prev_steps = params['steps']
        self.history.append(gain)
        if len(self.history) > 30:
            self.history.pop(0)
        mean = sum(self.history) / len(self.history)
        return round(max(gain, -1) + 0.1 * mean, 6)

pilot = Pilot()

def reward_function(params):
    return pilot(params)
