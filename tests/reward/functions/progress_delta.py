'''Keeps state: progress and time of the call before, in a class without an instance.'''
class State:
    progress = 0.0
    time = 0.0

    @classmethod
    def delta(cls, params):
        if params['steps'] <= 2:
            cls.progress, cls.time = 0.0, 0.0
        dp, dt = params['progress'] - cls.progress, params['sim_time'] - cls.time
        cls.progress, cls.time = params['progress'], params['sim_time']
        return dp / dt if dt > 0 else 0.0

def reward_function(params):
    rate = State.delta(params)
    return -10.0 if params['is_offtrack'] else 0.1 * rate
