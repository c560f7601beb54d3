'''Keeps state: in a parameter of its own, whose default is kept between calls, under German names.'''
def reward_function(params, gedächtnis={"weg": 0.0}, *, größe=2.0):
    zurückgelegt = params['progress'] - gedächtnis["weg"]
    gedächtnis["weg"] = params['progress']
    return größe * max(zurückgelegt, 0.0) + 0.01
