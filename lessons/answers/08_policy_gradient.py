# %% right returns
import numpy as np


def returns(rewards, gamma):
    found, following = np.zeros(len(rewards)), 0.0
    for t in reversed(range(len(rewards))):
        following = found[t] = rewards[t] + gamma * following
    return found


# %% wrong returns: everything is praised alike
import numpy as np


def returns(rewards, gamma):
    return np.full(len(rewards), sum(gamma**t * reward for t, reward in enumerate(rewards)))


# %% wrong returns: gamma is forgotten
import numpy as np


def returns(rewards, gamma):
    return np.cumsum(rewards[::-1])[::-1]


# %% wrong returns: from the wrong end
import numpy as np


def returns(rewards, gamma):
    found, before = np.zeros(len(rewards)), 0.0
    for t in range(len(rewards)):
        before = found[t] = rewards[t] + gamma * before
    return found


# %% wrong returns: one number
def returns(rewards, gamma):
    return rewards.sum()


# %% right step
import numpy as np


def step(preferences, action, reward, baseline, rate):
    chances = np.exp(preferences) / np.exp(preferences).sum()
    return preferences + rate * (reward - baseline) * (np.eye(len(preferences))[action] - chances)


# %% wrong step: down instead of up
import numpy as np


def step(preferences, action, reward, baseline, rate):
    chances = np.exp(preferences) / np.exp(preferences).sum()
    return preferences - rate * (reward - baseline) * (np.eye(len(preferences))[action] - chances)


# %% wrong step: without the baseline
import numpy as np


def step(preferences, action, reward, baseline, rate):
    chances = np.exp(preferences) / np.exp(preferences).sum()
    return preferences + rate * reward * (np.eye(len(preferences))[action] - chances)


# %% wrong step: the others stay
def step(preferences, action, reward, baseline, rate):
    preferences[action] += rate * (reward - baseline)
    return preferences


# %% wrong step: nothing comes back
def step(preferences, action, reward, baseline, rate):
    preferences[action] += rate * (reward - baseline)
