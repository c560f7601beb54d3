# %% right gain
import numpy as np


def gain(ratio, advantage, clip):
    return np.minimum(ratio * advantage, np.clip(ratio, 1 - clip, 1 + clip) * advantage)


# %% wrong gain: nothing is clipped
def gain(ratio, advantage, clip):
    return ratio * advantage


# %% wrong gain: always clipped
import numpy as np


def gain(ratio, advantage, clip):
    return np.clip(ratio, 1 - clip, 1 + clip) * advantage


# %% wrong gain: hopeful
import numpy as np


def gain(ratio, advantage, clip):
    return np.maximum(ratio * advantage, np.clip(ratio, 1 - clip, 1 + clip) * advantage)


# %% right repair
import numpy as np


def accumulate(surprise, is_over, fade):
    advantages, following = np.zeros_like(surprise), np.zeros_like(surprise[0])
    for t in reversed(range(len(surprise))):
        following = surprise[t] + fade * np.where(is_over[t], 0.0, following)
        advantages[t] = following
    return advantages


# %% wrong repair: as it was
import numpy as np


def accumulate(surprise, is_over, fade):
    advantages, following = np.zeros_like(surprise), np.zeros_like(surprise[0])
    for t in reversed(range(len(surprise))):
        following = surprise[t] + fade * following
        advantages[t] = following
    return advantages


# %% wrong repair: the last step is dropped, too
import numpy as np


def accumulate(surprise, is_over, fade):
    advantages, following = np.zeros_like(surprise), np.zeros_like(surprise[0])
    for t in reversed(range(len(surprise))):
        following = np.where(is_over[t], 0.0, surprise[t] + fade * following)
        advantages[t] = following
    return advantages


# %% wrong repair: nothing fades
import numpy as np


def accumulate(surprise, is_over, fade):
    advantages, following = np.zeros_like(surprise), np.zeros_like(surprise[0])
    for t in reversed(range(len(surprise))):
        following = surprise[t] + np.where(is_over[t], 0.0, following)
        advantages[t] = following
    return advantages
