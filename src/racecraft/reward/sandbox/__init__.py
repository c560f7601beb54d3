"""What keeps reward code in: walls that the kernel holds, put up before the first byte of user code.

    Confinement     what this machine's kernel offers, and what one worker is given of it
    plan            a confinement as the numbers and paths that the worker process enters it with
    inside.py       enters it, in the worker process, which loads this file by its path
    filters/        the system calls that are left, made by tools/syscall_filter.py

User code is taken to run any machine code it likes: nothing here relies on Python refusing anything.
"""

from racecraft.reward.sandbox.confinement import UNCONFINED, Confinement, find_confinement
from racecraft.reward.sandbox.plan import make_plan

__all__ = ["UNCONFINED", "Confinement", "find_confinement", "make_plan"]
