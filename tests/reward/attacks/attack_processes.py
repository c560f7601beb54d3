"""Attacks on other processes, and processes of one's own."""

from __future__ import annotations

import ctypes
import os
import platform
import resource
import signal
import time

from plot import attack
from scene import NotHere


@attack
def read_the_trainers_memory(scene):
    place = ctypes.addressof(scene.ours())
    result = yield f"""
        found = ctypes.c_uint64()
        ours = struct.pack("QQ", ctypes.addressof(found), 8)
        libc.process_vm_readv({os.getpid()}, ours, 1, struct.pack("QQ", {place}, 8), 1, 0)
        return float(found.value)
    """
    return result == scene.number


@attack
def write_the_trainers_memory(scene):
    memory = scene.ours()
    yield f"""
        zero = ctypes.c_uint64()
        ours = struct.pack("QQ", ctypes.addressof(zero), 8)
        libc.process_vm_writev({os.getpid()}, ours, 1, struct.pack("QQ", {ctypes.addressof(memory)}, 8), 1, 0)
        return 0.0
    """
    return memory.value != scene.number


@attack
def write_the_trainers_memory_as_a_file(scene):
    memory = scene.ours()
    yield f"""
        descriptor = libc.open(b"/proc/{os.getpid()}/mem", 2)
        libc.pwrite(descriptor, bytes(8), 8, ctypes.c_long({ctypes.addressof(memory)}))
        return 0.0
    """
    return memory.value != scene.number


@attack
def trace_the_trainer(scene):
    scene.ours()
    result = yield f"return won(libc.ptrace(0x4206, {os.getpid()}, None, None))"  # PTRACE_SEIZE, which stops nothing
    return result == 1.0


@attack
def trace_another_process(scene):
    victim = scene.victim()
    result = yield f"return won(libc.ptrace(16, {victim}, None, None))"  # PTRACE_ATTACH
    return result == 1.0


@attack
def kill_another_process(scene):
    victim = scene.victim()
    yield f"return libc.kill({victim}, 9)"
    return scene.victim_is_dead


@attack
def kill_a_thread_of_another_process(scene):
    victim = scene.victim()
    yield f"return libc.tgkill({victim}, {victim}, 9)"
    return scene.victim_is_dead


@attack
def kill_by_a_descriptor(scene):
    victim = scene.victim()
    yield f"return call('pidfd_send_signal', call('pidfd_open', {victim}, 0), 9, None, 0)"
    return scene.victim_is_dead


@attack
def signal_the_trainer(scene):
    found = scene.catch(signal.SIGUSR2)
    yield f"return libc.kill({os.getpid()}, {int(signal.SIGUSR2)})"
    return bool(found)


@attack
def take_a_descriptor_of_the_trainer(scene):
    scene.ours()
    descriptor = scene.keep(os.open(scene.file(), os.O_RDONLY))
    result = yield f"""
        found = ctypes.create_string_buffer(100)
        taken = call("pidfd_getfd", call("pidfd_open", {os.getpid()}, 0), {descriptor}, 0)
        return number(found) if libc.pread(taken, found, 99, ctypes.c_long(0)) > 0 else 0.0
    """
    return result == scene.number


@attack
def limits_of_another_process(scene):
    victim = scene.victim()
    yield f"return libc.prlimit({victim}, 7, struct.pack('QQ', 5, 5), None)"
    return resource.prlimit(victim, resource.RLIMIT_NOFILE)[0] == 5


@attack
def priority_of_another_process(scene):
    victim = scene.victim()
    yield f"return libc.setpriority(0, {victim}, 15)"
    return os.getpriority(os.PRIO_PROCESS, victim) == 15


@attack
def processors_of_another_process(scene):
    victim = scene.victim()
    if len(os.sched_getaffinity(0)) < 2:
        raise NotHere("one processor")
    one = min(os.sched_getaffinity(0))
    yield f"return libc.sched_setaffinity({victim}, 8, struct.pack('Q', {1 << one}))"
    return os.sched_getaffinity(victim) == {one}


@attack
def fork(scene):
    marker = scene.folder / "marker"
    yield f"""
        if libc.fork() == 0:
            libc.creat({bytes(marker)!r}, 0o600)
            os._exit(0)
        time.sleep(0.2)
        return 0.0
    """
    return marker.exists()


@attack
def fork_bomb(scene):
    result = yield """
        count = 0
        for _ in range(20):
            child = libc.fork()
            if child == 0:
                time.sleep(0.3)
                os._exit(0)
            count += child > 0
        return float(count)
    """
    return result == 20


@attack
def clone(scene):
    """By the system call, past the C library."""
    number = 220 if platform.machine() == "aarch64" else 56
    result = yield f"""
        child = libc.syscall(ctypes.c_long({number}), ctypes.c_long(17), 0, 0, 0, 0)
        if child == 0:
            os._exit(0)
        return won(child)
    """
    return result == 1.0


@attack
def threads(scene):
    result = yield """
        found = []
        for _ in range(4):
            _thread.start_new_thread(found.append, (1,))
        time.sleep(0.2)
        return float(len(found))
    """
    return result == 4


@attack
def another_program(scene):
    marker = scene.folder / "marker"
    yield f"""
        arguments = (A * 3)(b"touch", {bytes(marker)!r}, None)
        return libc.execv(b"/usr/bin/touch", arguments)
    """
    return marker.exists()


@attack
def another_program_beside(scene):
    marker = scene.folder / "marker"
    yield f"""
        arguments = (A * 3)(b"touch", {bytes(marker)!r}, None)
        libc.posix_spawn(ctypes.create_string_buffer(8), b"/usr/bin/touch", None, None, arguments, None)
        time.sleep(0.2)
        return 0.0
    """
    return marker.exists()


@attack
def a_program_in_memory(scene):
    result = yield "return won(libc.memfd_create(b'program', 0))"
    return result == 1.0


@attack
def a_process_that_outlives_the_training(scene):
    marker = scene.folder / "marker"
    yield f"""
        if libc.fork() == 0:
            libc.setsid()
            time.sleep(0.4)
            libc.creat({bytes(marker)!r}, 0o600)
            os._exit(0)
        time.sleep(0.2)
        return 0.0
    """
    time.sleep(0.7)
    return marker.exists()
