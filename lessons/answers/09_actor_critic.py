# %% right advantages
import numpy as np


def advantages(rewards, values, afterwards, terminated, gamma, lam):
    found, following = np.zeros(len(rewards)), 0.0
    for t in reversed(range(len(rewards))):
        going = 0.0 if terminated[t] else 1.0
        surprise = rewards[t] + gamma * going * afterwards[t] - values[t]
        following = found[t] = surprise + gamma * lam * going * following
    return found


# %% wrong advantages: only the surprise of each step
import numpy as np


def advantages(rewards, values, afterwards, terminated, gamma, lam):
    return rewards + gamma * np.where(terminated, 0.0, afterwards) - values


# %% wrong advantages: there is something after the end
import numpy as np


def advantages(rewards, values, afterwards, terminated, gamma, lam):
    found, following = np.zeros(len(rewards)), 0.0
    for t in reversed(range(len(rewards))):
        following = found[t] = rewards[t] + gamma * afterwards[t] - values[t] + gamma * lam * following
    return found


# %% wrong advantages: the next episode leaks in
import numpy as np


def advantages(rewards, values, afterwards, terminated, gamma, lam):
    found, following = np.zeros(len(rewards)), 0.0
    surprise = rewards + gamma * np.where(terminated, 0.0, afterwards) - values
    for t in reversed(range(len(rewards))):
        following = found[t] = surprise[t] + gamma * lam * following
    return found


# %% wrong advantages: waits for everything
import numpy as np


def advantages(rewards, values, afterwards, terminated, gamma, lam):
    found, following = np.zeros(len(rewards)), 0.0
    surprise = rewards + gamma * np.where(terminated, 0.0, afterwards) - values
    for t in reversed(range(len(rewards))):
        following = found[t] = surprise[t] + gamma * (0.0 if terminated[t] else following)
    return found
