"""Attacks for more than one's share, and at the kernel's less known doors."""

from __future__ import annotations

import ctypes
import os
import platform
import resource

from plot import attack, root_only
from scene import NotHere, libc


@attack
def eight_gigabytes(scene):
    result = yield """
        libc.mmap.restype = ctypes.c_void_p
        place = libc.mmap(None, ctypes.c_size_t(8 << 30), 3, 0x4022, -1, ctypes.c_long(0))
        return float(place not in (None, 2**64 - 1))
    """
    return result == 1.0


@attack
def higher_limits(scene):
    """As high as they were for the one who started the worker."""
    hard = resource.getrlimit(resource.RLIMIT_AS)[1]
    result = yield f"""
        most = struct.pack("Qq", {2**64 - 1 if hard < 0 else hard}, {hard})
        libc.setrlimit(9, most)
        libc.getrlimit(9, found := ctypes.create_string_buffer(16))
        return float(found.raw[8:] == most[8:])
    """
    return result == 1.0


@attack
def deaf_to_signals(scene):
    """To outlive the trainer: whatever asks it to end is ignored."""
    result = yield """
        signals = ctypes.c_uint64(2**64 - 1)
        return won(libc.pthread_sigmask(0, ctypes.byref(signals), None) and -1)
    """
    return result == 1.0


@attack
def an_alarm(scene):
    result = yield "return won(libc.setitimer(0, struct.pack('4q', 0, 0, 60, 0), None))"
    return result == 1.0


@attack
def a_faster_lane(scene):
    """Another scheduling policy for itself."""
    result = yield "return won(libc.sched_setscheduler(0, 3, struct.pack('i', 0)))"
    return result == 1.0


@attack
def memory_that_stays(scene):
    result = yield "return won(libc.mlock(ctypes.create_string_buffer(4096), ctypes.c_size_t(4096)))"
    return result == 1.0


@attack
def a_ring_of_calls(scene):
    """io_uring: files and sockets without a system call for each."""
    probe = libc.syscall(ctypes.c_long(425), 1, ctypes.create_string_buffer(120))
    if probe < 0:
        raise NotHere("the kernel has no io_uring for this user")
    os.close(probe)
    result = yield "return won(call('io_uring_setup', 1, ctypes.create_string_buffer(120)))"
    return result == 1.0


@attack
def faults_of_pages(scene):
    result = yield "return won(call('userfaultfd', 1))"
    return result == 1.0


@attack
def programs_in_the_kernel(scene):
    root_only()
    result = yield "return won(call('bpf', 0, struct.pack('5I', 2, 4, 4, 1, 0) + bytes(100), 120))"
    return result == 1.0


@attack
def events_of_the_processor(scene):
    setup = (ctypes.c_uint8 * 128)(1, 0, 0, 0, 128)  # PERF_TYPE_SOFTWARE
    setup[40] = 0b1100000  # exclude kernel and hypervisor
    if libc.syscall(ctypes.c_long(241 if platform.machine() == "aarch64" else 298), setup, 0, -1, -1, 0) < 0:
        raise NotHere("the kernel counts no events for this user")
    result = yield """
        setup = (ctypes.c_uint8 * 128)(1, 0, 0, 0, 128)
        setup[40] = 0b1100000
        return won(call("perf_event_open", setup, 0, -1, -1, 0))
    """
    return result == 1.0


@attack
def a_world_of_its_own(scene):
    """A user namespace, in which anybody is root; tried by a child first."""
    child = os.fork()
    if child == 0:
        os._exit(libc.unshare(0x10000000) != 0)
    if os.waitpid(child, 0)[1]:
        raise NotHere("the system gives this user no namespaces")
    result = yield "return won(libc.unshare(0x10000000))"
    return result == 1.0


@attack
def mount_a_file_system(scene):
    root_only()
    result = yield f"""
        libc.unshare(0x20000)
        libc.mount(None, b"/", None, ctypes.c_long(0x44000), None)
        return won(libc.mount(b"none", {bytes(scene.folder)!r}, b"tmpfs", ctypes.c_long(0), None))
    """
    return result == 1.0


@attack
def another_root(scene):
    root_only()
    result = yield f"return won(libc.chroot({bytes(scene.folder)!r}))"
    return result == 1.0


@attack
def another_user(scene):
    root_only()
    result = yield "return won(libc.setuid(65533))"
    return result == 1.0


@attack
def keys(scene):
    result = yield "return won(call('keyctl', 0, -4, 1))"  # KEYCTL_GET_KEYRING_ID of the user
    return result == 1.0


@attack
def a_key_of_its_own(scene):
    """Left behind in a ring of the process alone, which ends with it."""
    result = yield "return won(call('add_key', A(b'user'), A(b'racecraft'), A(b'x'), 1, -2))"
    return result == 1.0


@attack
def to_be_looked_at(scene):
    result = yield "return won(libc.prctl(4, 1, 0, 0, 0))"  # PR_SET_DUMPABLE
    return result == 1.0


@attack
def memory_without_chance(scene):
    result = yield "return won(libc.personality(ctypes.c_ulong(0x0040000)))"  # ADDR_NO_RANDOMIZE
    return result == 1.0


@attack
def calls_of_32_bits(scene):
    """Numbers of another architecture mean other calls: 5 is open, 3 is read, by interrupt 0x80."""
    if platform.machine() != "x86_64":
        raise NotHere("only x86-64 has them")
    path = scene.file()
    result = yield f"""
        libc.mmap.restype = ctypes.c_void_p
        place = libc.mmap(None, ctypes.c_size_t(8192), 7, 0x62, -1, ctypes.c_long(0))  # below 4 GB
        code = bytes.fromhex("53 89f8 89f3 4189c8 89d1 4489c2 cd80 4898 5b c3")
        ctypes.memmove(place, code, len(code))
        ctypes.memmove(place + 4096, {bytes(path)!r} + bytes(1), {len(bytes(path)) + 1})
        interrupt = ctypes.CFUNCTYPE(ctypes.c_long, *(ctypes.c_long,) * 4)(place)
        interrupt(3, interrupt(5, place + 4096, 0, 0), place + 4096, 100)
        return number(ctypes.string_at(place + 4096, {len(str(scene.number))}))
    """
    return result == scene.number


@attack
def calls_of_x32(scene):
    if platform.machine() != "x86_64" or libc.syscall(ctypes.c_long(0x40000000 | 39)) != os.getpid():
        raise NotHere("the kernel has no x32")
    path = scene.file()
    result = yield f"""
        descriptor = libc.syscall(ctypes.c_long(0x40000000 | 2), {bytes(path)!r}, 0, 0)
        found = ctypes.create_string_buffer(100)
        libc.read(descriptor, found, 99)
        return number(found)
    """
    return result == scene.number
