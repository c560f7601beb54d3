# %% right targets
import numpy as np


def targets(rewards, terminated, online, target, gamma):
    return rewards + gamma * np.where(terminated, 0.0, target.max(axis=1))


# %% wrong targets: there is something after the end
def targets(rewards, terminated, online, target, gamma):
    return rewards + gamma * target.max(axis=1)


# %% wrong targets: the network that learns is asked
import numpy as np


def targets(rewards, terminated, online, target, gamma):
    return rewards + gamma * np.where(terminated, 0.0, online.max(axis=1))


# %% wrong targets: gamma is forgotten
import numpy as np


def targets(rewards, terminated, online, target, gamma):
    return rewards + np.where(terminated, 0.0, target.max(axis=1))


# %% wrong targets: the mean of the actions
import numpy as np


def targets(rewards, terminated, online, target, gamma):
    return rewards + gamma * np.where(terminated, 0.0, target.mean(axis=1))


# %% wrong targets: one number for all
def targets(rewards, terminated, online, target, gamma):
    return (rewards + gamma * target.max(axis=1)).mean()


# %% right remember
def remember(memory, step, capacity):
    memory.append(step)
    if len(memory) > capacity:
        memory.pop(0)


# %% wrong remember: nothing is forgotten
def remember(memory, step, capacity):
    memory.append(step)


# %% wrong remember: only the last
def remember(memory, step, capacity):
    memory[:] = [step]


# %% wrong remember: the newest but one goes
def remember(memory, step, capacity):
    if len(memory) == capacity:
        memory.pop()
    memory.append(step)


# %% wrong remember: the full memory takes nothing
def remember(memory, step, capacity):
    if len(memory) < capacity:
        memory.append(step)
