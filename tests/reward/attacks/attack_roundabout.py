"""Attacks by a longer way: what asks somebody else to do it, and calls that are younger than most filters."""

from __future__ import annotations

import ctypes
import os
import platform

from plot import attack, root_only
from scene import NotHere, libc

LIST_MOUNTS, OPEN_2, SECRET_MEMORY = 458, 437, 447  # the same numbers on every architecture
ROOT_MOUNT = 2**64 - 1


@attack
def kill_by_a_pipe(scene):
    """A pipe whose news are a signal of one's choice to an owner of one's choice."""
    victim = scene.victim()
    yield f"""
        ends = (ctypes.c_int * 2)()
        libc.pipe(ends)
        for descriptor in range(3, 64):  # one of its own, and those it was given
            libc.fcntl(descriptor, 8, {victim})  # F_SETOWN
            libc.fcntl(descriptor, 10, 9)  # F_SETSIG, SIGKILL
            libc.fcntl(descriptor, 4, libc.fcntl(descriptor, 3, 0) | 0o20000)  # O_ASYNC
        return libc.write(ends[1], b"!", 1)
    """
    return scene.victim_is_dead


@attack
def kill_by_a_queued_signal(scene):
    victim = scene.victim()
    number = 138 if platform.machine() == "aarch64" else 129
    yield f"""
        about = struct.pack("3i", 9, 0, -1) + bytes(116)  # SI_QUEUE
        return libc.syscall(ctypes.c_long({number}), ctypes.c_long({victim}), ctypes.c_long(9), about)
    """
    return scene.victim_is_dead


@attack
def a_slower_lane_for_the_trainer(scene):
    victim = scene.victim()
    yield f"return libc.sched_setscheduler({victim}, 5, struct.pack('i', 0))"  # SCHED_IDLE
    return os.sched_getscheduler(victim) == os.SCHED_IDLE


@attack
def where_another_process_keeps_its_locks(scene):
    """An address inside it, which is half of an attack on its memory."""
    scene.ours()
    number = 100 if platform.machine() == "aarch64" else 274
    result = yield f"""
        place, size = ctypes.c_uint64(), ctypes.c_uint64()
        pointers = ctypes.byref(place), ctypes.byref(size)
        return won(libc.syscall(ctypes.c_long({number}), ctypes.c_long({os.getpid()}), *pointers))
    """
    return result == 1.0


@attack
def read_by_a_younger_open(scene):
    path = scene.file()
    result = yield f"""
        descriptor = libc.syscall(ctypes.c_long({OPEN_2}), -100, {bytes(path)!r}, bytes(24), ctypes.c_long(24))
        found = ctypes.create_string_buffer(100)
        return number(found) if libc.read(descriptor, found, 99) > 0 else 0.0
    """
    return result == scene.number


@attack
def what_is_mounted(scene):
    """Without the name of a path, of which Landlock would know."""
    ask = f"struct.pack('<IIQQQ', 32, 0, {ROOT_MOUNT}, 0, 0)"
    found = (ctypes.c_uint64 * 64)()
    request = (ctypes.c_uint64 * 4)(32, ROOT_MOUNT, 0, 0)
    if libc.syscall(ctypes.c_long(LIST_MOUNTS), request, found, ctypes.c_long(64), ctypes.c_long(0)) < 1:
        raise NotHere("the kernel lists no mounts for this user")
    result = yield f"""
        found = (ctypes.c_uint64 * 64)()
        return won(libc.syscall(ctypes.c_long({LIST_MOUNTS}), {ask}, found, ctypes.c_long(64), ctypes.c_long(0)))
    """
    return result == 1.0


@attack
def memory_that_nobody_else_can_read(scene):
    """Out of the trainer's and the kernel's own sight."""
    descriptor = libc.syscall(ctypes.c_long(SECRET_MEMORY), ctypes.c_long(0))
    if descriptor < 0:
        raise NotHere("the kernel has no secret memory")
    os.close(descriptor)
    result = yield f"return won(libc.syscall(ctypes.c_long({SECRET_MEMORY}), ctypes.c_long(0)))"
    return result == 1.0


@attack
def another_name_for_the_machine(scene):
    """The one it has, so that nothing is lost where it works."""
    root_only()
    name = os.uname().nodename.encode()
    if libc.sethostname(name, len(name)) < 0:
        raise NotHere("root may not name the machine here")
    result = yield f"return won(libc.sethostname({name!r}, {len(name)}))"
    return result == 1.0
