# %% right choose: ε fades
def choose(values, counts, rng):
    if rng.random() < 10.0 / (10.0 + counts.sum()):
        return int(rng.integers(len(values)))
    return int(values.argmax())


# %% right choose: the upper end of what a machine may be worth, as UCB has it
import numpy as np


def choose(values, counts, rng):
    if (counts == 0).any():
        return int(counts.argmin())
    return int((values + np.sqrt(2.0 * np.log(counts.sum()) / counts)).argmax())


# %% wrong choose: the best so far, always
def choose(values, counts, rng):
    return int(values.argmax())


# %% wrong choose: by lot, always
def choose(values, counts, rng):
    return int(rng.integers(len(values)))


# %% wrong choose: half by lot, for ever
def choose(values, counts, rng):
    if rng.random() < 0.5:
        return int(rng.integers(len(values)))
    return int(values.argmax())


# %% wrong choose: the value instead of the number
def choose(values, counts, rng):
    return values.max()
