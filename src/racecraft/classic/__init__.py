"""Algorithms to be read, for any Gymnasium environment: tables, DQN, policy gradients, actor-critics, PPO and SAC.

    from racecraft.classic import learn

    learned = learn("CartPole-v1", "dqn", seed=1)
    print(learned.mean_return)

Each algorithm is one file that reads from top to bottom; what they share (a network with its gradient, worlds, a
memory) is beside them. NumPy does all arithmetic, so a run repeats itself on the same machine by its seed.
"""

from racecraft.classic.algorithms import ALGORITHMS
from racecraft.classic.job import Learned, Progress, learn, recall, resume
from racecraft.classic.recipes import RECIPES, default_algorithm, find_recipe
from racecraft.classic.worlds import Worlds

__all__ = [
    "ALGORITHMS",
    "RECIPES",
    "Learned",
    "Progress",
    "Worlds",
    "default_algorithm",
    "find_recipe",
    "learn",
    "recall",
    "resume",
]
