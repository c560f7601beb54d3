"""What perception is for: pictures of any kind told and painted, and a driver by sight.

pictures, video, replay, run ──reading──▶ frames ──(racecraft.perception)──▶ Belief ──painting──▶ pictures, numbers
                                                                               └────driving──▶ commands
"""

from racecraft.perceiving.driving import PerceptionDriver
from racecraft.perceiving.looking import perceive

__all__ = ["PerceptionDriver", "perceive"]
