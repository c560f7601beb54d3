"""What an attack is: a generator that yields the body of a reward function and is sent what that returned.

The body runs with the tools of somebody who got past Python: ``libc`` (the C library by ctypes), ``call`` (system calls
by name), ``number`` and ``read``. It returns what it found out, or nothing. The generator returns whether anything was
gained.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Generator
from importlib import import_module

from scene import NotHere, Scene

Attack = Callable[[Scene], Generator[str, "float | None", bool]]
ATTACKS: dict[str, Attack] = {}
ROOT = os.geteuid() == 0


def attack(function: Attack) -> Attack:
    """Put an attack on the list."""
    ATTACKS[function.__name__] = function
    return function


def every_attack() -> dict[str, Attack]:
    """All attacks by name."""
    for module in ("reading", "processes", "changing", "kernel", "roundabout"):
        import_module(f"attack_{module}")
    return ATTACKS


def root_only() -> None:
    """Leave it out where its failure would say nothing."""
    if not ROOT:
        raise NotHere("only root may do it anyway")


PRELUDE = """
import ctypes, os, struct, sys, time, _thread
libc = ctypes.pythonapi
A, N = ctypes.c_char_p, None

def number(data):
    return float(bytes(data).partition(b"\\0")[0])

def read(path):
    found = ctypes.create_string_buffer(4096)
    descriptor = libc.open(path, 0)
    return number(found) if libc.read(descriptor, found, 4095) > 0 else 0.0

def call(name, *arguments):
    return libc.syscall(ctypes.c_long(NR[name]), *[ctypes.c_long(a) if isinstance(a, int) else a for a in arguments])

def won(result):
    return 1.0 if result >= 0 else 0.0
"""
