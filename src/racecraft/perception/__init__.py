"""Perception: a picture of a driver's camera becomes what a driver needs to know of the road.

frames ──network──▶ Belief ──telling──▶ numbers          (racecraft.perceiving: pictures told, painted, driven by)
            │ in order: └─memory
            └──learner──▶ actions of a network that sees nothing else
simulator's state ──truth──▶ targets ──training──▶ weights of the network ──recalling──▶ weights of the memory
"""

from racecraft.perception.belief import Belief
from racecraft.perception.lessons import Lessons
from racecraft.perception.network import Perceiver
from racecraft.perception.training import train
from racecraft.perception.watching import Watcher

__all__ = ["Belief", "Lessons", "Perceiver", "Watcher", "train"]
