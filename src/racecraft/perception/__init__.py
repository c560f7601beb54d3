"""Perception: a picture of a driver's camera becomes what a driver needs to know of the road.

pictures ──reading──▶ frames ──network──▶ Belief ──telling, painting──▶ numbers, pictures
                                  │          ├────driving──▶ commands
                      in order:   └─memory───┘
simulator's state ──truth──▶ targets ──training──▶ weights of the network ──recalling──▶ weights of the memory
"""

from racecraft.perception.belief import Belief
from racecraft.perception.driving import PerceptionDriver
from racecraft.perception.lessons import Lessons
from racecraft.perception.looking import perceive
from racecraft.perception.network import Perceiver
from racecraft.perception.training import train
from racecraft.perception.watching import Watcher

__all__ = ["Belief", "Lessons", "Perceiver", "PerceptionDriver", "Watcher", "perceive", "train"]
