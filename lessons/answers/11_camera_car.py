# %% right steer
def steer(offset, turn, bend):
    return -1.2 * offset - 0.8 * turn + 0.45 * bend


# %% wrong steer: the wrong way
def steer(offset, turn, bend):
    return 1.2 * offset + 0.8 * turn + 0.45 * bend


# %% wrong steer: in degrees
def steer(offset, turn, bend):
    return -60 * offset - 45 * turn + 25 * bend


# %% wrong steer: blind to the offset
def steer(offset, turn, bend):
    return -0.8 * turn + 0.45 * bend


# %% wrong steer: too gentle
def steer(offset, turn, bend):
    return -0.1 * offset - 0.05 * turn + 0.05 * bend
